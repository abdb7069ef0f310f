"""The fault kit: a plan survives each failing call, and the kit finds planted faults."""

import sys

import pytest
from faults import __main__ as tool
from faults import judges
from faults.commands import COMMANDS, Command
from faults.kit import Kit

PLANTED = {
    "half_written": ("full", "open('out.json', 'w').write('{\"a\": [1, 2, 3, 4]}')", "half-written out.json"),
    "lost": (
        "error",
        "import contextlib\nwith contextlib.suppress(OSError): open('out.json', 'w').write('{}')",
        "without",
    ),
    "traceback": ("readonly", "open('out.json', 'w').write('{}')", "traceback"),
    "silent": ("full", "import sys\ntry: open('out.json', 'w').write('{}')\nexcept OSError: sys.exit(2)", "a sentence"),
    "leaves": ("error", "open('.mmp-1.tmp', 'w').write('x')\nopen('.mmp-1.tmp', 'w').close()", "left .mmp-1.tmp"),
    "killed": ("kill", "open('out.json', 'w').write('[1, 2, 3, 4]')", "half-written out.json"),
    "overwrites": ("error", "open('plan.json', 'w').write('{}')", "changed plan.json"),
}


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    return Kit(tmp_path_factory.mktemp("faults"))


@pytest.mark.parametrize("kind", ["full", "kill", "memory"])
def test_a_plan_survives_calls_that_fail(kit, kind, tmp_path):
    command = COMMANDS["plan"]
    good = tool.good_run(kit, command, kind, tmp_path / "good")
    assert good.code == 0
    assert good.calls >= 8
    for at in tool.points(good.calls, 4):
        assert tool.tried(kit, command, kind, at, good) == []


@pytest.mark.parametrize("planted", PLANTED)
def test_planted_faults_are_found(kit, planted, tmp_path):
    kind, program, fault = PLANTED[planted]
    command = Command([], program=[sys.executable, "-c", program])
    good = tool.good_run(kit, command, kind, tmp_path / "good")
    found = [each for at in range(good.calls) for each in tool.tried(kit, command, kind, at, good)]
    assert any(fault in each for each in found), found


def test_what_was_reported_and_is_lost_is_found(kit, tmp_path):
    with kit.folder() as (folder, before):
        run = kit.run(Command([], program=[sys.executable, "-c", ""]), folder, before)
        kept = {"results/results.jsonl": before["results/results.jsonl"] + b'{"more": 1}\n'}
        assert judges.faults_after(run, run, kept) == ["then lost '{\"more\": 1}' of results/results.jsonl"]


def test_all_points_or_some_over_all_are_tried():
    assert tool.points(5, None) == [0, 1, 2, 3, 4]
    assert tool.points(100, 4) == [0, 33, 66, 99]
    assert tool.points(3, 1) == [0]
