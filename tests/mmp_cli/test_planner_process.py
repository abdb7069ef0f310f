"""A planner of another package may do anything: `mmp plan` answers with one sentence and the right exit code."""

import contextlib
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import time

import pytest
from support import bench_runs

from mmp_cli import planner_messages, planner_process
from mmp_env.files.plan_file import load_plan

DEEDS = {
    "raise": "raised KeyError: 'a bug' (bench_stand_ins.py, line ",
    "unusual": "raised Unusual: so there (bench_stand_ins.py, line ",
    "no_interrupt": "raised KeyboardInterrupt",
    "mute": "raised Mute, whose text cannot be read (bench_stand_ins.py, line ",
    "exit": "raised SystemExit: 0",
    "leave": "gave no answer: its process ended with exit code 3 while planning",
    "crash": "gave no answer: its process was killed by SIGSEGV (it crashed) while planning",
    "close": "gave no answer: its process",
    "guarded": "returned no result: what plan() returned cannot be read: Unusual: hands off",
    "no_options": "returned no result: the planner of the plan has the options null; they must be a mapping",
    "no_name": "returned no result: the planner of the plan has the name 3; it must be text",
    "text": "where numbers are wanted",
    "no_number": "returned no result: the plan holds nan where finite numbers are wanted",
    "all_text": "returned no result: the plan's numbers are of type str; they must be a mapping, arm -> numbers",
}
UNMADE = {
    "gone": "planner 'gone' does not load: its process ended with exit code 0 while loading",
    "deadly": "planner 'deadly' does not load: its process was killed by SIGSEGV (it crashed) while loading",
    "leaving": "planner 'leaving' (leaving_import:Planner) does not load: SystemExit: bye",
    "sulks": "planner 'sulks' cannot be made: RuntimeError: not today",
}


@pytest.fixture
def plan(mmp, instances, tmp_path, monkeypatch):
    """Runs `mmp plan` in this process with the planner `rogue`, whose option `deed` says what it does."""
    monkeypatch.syspath_prepend(bench_runs.site(tmp_path))
    monkeypatch.chdir(tmp_path)

    def run(deed, *words):
        return mmp("plan", instances, "--planner", "rogue", "--set", f"deed={deed}", "--json", *words)

    return run


@pytest.mark.parametrize("deed", DEEDS)
def test_a_misdeed_is_one_sentence_and_exit_1(plan, deed, tmp_path):
    ran = plan(deed, "--out", "plan.json")
    assert (ran.code, ran.err.count("\n")) == (1, 1)
    assert ran.err.startswith("mmp: planner 'rogue' ")
    assert DEEDS[deed] in ran.err
    assert (ran.result["status"], ran.result["valid"], ran.result["plan"]) == ("error", None, None)
    assert not (tmp_path / "plan.json").exists()


@pytest.mark.parametrize("name", UNMADE)
def test_a_planner_that_cannot_be_made_is_one_sentence_and_exit_2(mmp, instances, tmp_path, monkeypatch, name):
    monkeypatch.syspath_prepend(bench_runs.site(tmp_path))
    ran = mmp("plan", instances, "--planner", name, "--json")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == f"mmp: {UNMADE[name]}\n"


def test_an_option_that_it_does_not_have_is_misuse(plan):
    ran = plan("sound", "--set", "dead=1")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "mmp: planner 'rogue' has no option 'dead'. Did you mean 'deed'? Known: deed\n"


@pytest.mark.parametrize("deed", ["sound", "move", "fork", "fork_and_stay"])
def test_side_effects_of_the_planner_change_nothing_in_the_program(plan, deed, tmp_path):
    ran = plan(deed, "--out", "plan.json")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.count("\n") == 1
    assert ran.result["valid"]
    assert os.getcwd() == str(tmp_path)
    assert load_plan(tmp_path / "plan.json").planner == {"name": "rogue"}


def test_a_planner_cannot_change_the_instance_that_is_checked(plan, tmp_path):
    ran = plan("meddle", "--out", "plan.json")
    assert (ran.code, ran.result["status"], ran.result["valid"]) == (1, "solved", False)
    assert "THE CHECKER REFUTES THIS PLAN" in ran.err
    plan("sound", "--out", "sound.json")
    meddled, sound = (json.loads((tmp_path / f"{name}.json").read_text())["problem"] for name in ("plan", "sound"))
    assert meddled == sound


def test_a_planner_that_does_not_end_is_killed_after_the_grace_time(plan, monkeypatch):
    monkeypatch.setattr(planner_process, "GRACE_S", 0.05)
    ran = plan("hang", "--time-limit", "0.5")
    assert (ran.code, ran.result["status"]) == (1, "error")
    message = "gave no answer: its process was ended, still planning 0.1 s after its time limit of 0.5 s"
    assert ran.err == f"mmp: planner 'rogue' {message}\n"


@pytest.mark.parametrize("name", ["rogue", "ecbs"])
def test_a_planner_that_uses_too_much_memory_is_killed(mmp, instances, tmp_path, monkeypatch, name):
    monkeypatch.syspath_prepend(bench_runs.site(tmp_path))
    deed = ["--set", "deed=eat"] if name == "rogue" else []
    limit = 700 if deed else 1
    ran = mmp("plan", instances, "--planner", name, *deed, "--memory-limit", limit, "--json")
    message = rf"mmp: planner '{name}' .*its process was ended: it used \d+ MB while (planning|loading), "
    assert re.match(message + f"over the memory limit of {limit} MB", ran.err)
    assert ran.code in (1, 2)


def test_a_memory_limit_that_is_kept_changes_no_plan(mmp, instances, tmp_path):
    for name, more in (("free", []), ("limited", ["--memory-limit", 10**5])):
        assert mmp("plan", instances, "--planner", "ecbs", "--out", tmp_path / name, *more).code == 0
    assert (tmp_path / "free").read_bytes() == (tmp_path / "limited").read_bytes()


def test_a_planner_that_writes_half_a_message_is_killed(tmp_path, instances):
    command = [sys.executable, "-c", "from mmp_cli.main import main; raise SystemExit(main())", "plan", str(instances)]
    ran = subprocess.run(
        [*command, "--planner", "rogue", "--set", "deed=tear", "--json", "--time-limit", "0.2"],
        env=bench_runs.environment(tmp_path),
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (ran.returncode, json.loads(ran.stdout)["status"]) == (1, "error")
    assert "its process was ended, still planning" in ran.stderr


def test_a_planner_that_emits_events_for_ever_is_killed(mmp, instances, tmp_path, monkeypatch):
    monkeypatch.setattr(planner_process, "GRACE_S", 0.05)
    monkeypatch.syspath_prepend(bench_runs.site(tmp_path))
    ran = mmp("plan", instances, "--planner", "chatty", "--json", "--time-limit", "0.5")
    assert (ran.code, ran.result["status"]) == (1, "error")
    assert "its process was ended, still planning 0.1 s after its time limit of 0.5 s" in ran.err


@pytest.mark.parametrize(
    ("module", "name"),
    [("mmp_env.events", "np.load"), ("mmp_env.events", "dataclass"), ("numpy_of_a_stranger", "dtype")],
)
def test_a_message_that_names_code_is_not_read(module, name):
    named = b"".join(b"\x8c" + bytes([len(word)]) + word.encode() for word in (module, name))
    with pytest.raises(pickle.UnpicklingError, match=f"names {module}.{name}, which is no data"):
        planner_messages.decode(b"\x80\x04" + named + b"\x93.")


def test_the_grace_time_is_five_seconds_and_a_tenth_of_the_limit():
    assert (planner_process.grace_s(0.0), planner_process.grace_s(60.0)) == (5.0, 11.0)


def test_watchers_get_the_same_events_as_from_a_planner_of_this_package(mmp, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(bench_runs.site(tmp_path))
    words = ["plan", "MultiArmCell-4", "--seed", 2, "--json"]
    trees, plans = [], []
    for name in ("searching", "apf-ecbs"):
        files = [tmp_path / f"{name}.{kind}" for kind in ("svg", "json", "rrd")]
        shown = [
            word for option, file in zip(("--tree", "--out", "--rerun"), files, strict=True) for word in (option, file)
        ]
        ran = mmp(*words, "--planner", name, *shown)
        assert (ran.code, ran.err) == (0, "")
        trees.append(re.sub(rf"{name}|after [0-9.]+ s", "...", files[0].read_text()))
        plans.append(files[1].read_bytes())
        assert files[2].stat().st_size > 100_000
    assert plans[0] == plans[1]
    assert trees[0] == trees[1]


@contextlib.contextmanager
def planning(tmp_path, instances, planner, *words):
    """Starts `mmp plan` as another process, with a planner that prints when it has begun."""
    command = [sys.executable, "-c", "from mmp_cli.main import main; raise SystemExit(main())", "plan", str(instances)]
    with subprocess.Popen(
        [*command, "--planner", planner, *map(str, words)],
        env=bench_runs.environment(tmp_path),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process, int(process.stderr.readline().split()[-1])
        finally:
            process.kill()


def test_output_of_a_planner_does_not_spoil_the_json(tmp_path, instances):
    command = [sys.executable, "-c", "from mmp_cli.main import main; raise SystemExit(main())", "plan", str(instances)]
    ran = subprocess.run(
        [*command, "--planner", "rogue", "--set", "deed=sound", "--json"],
        env=bench_runs.environment(tmp_path),
        capture_output=True,
        text=True,
        check=False,
    )
    assert json.loads(ran.stdout)["status"] == "solved"
    assert "a word to the terminal" in ran.stderr


def test_ctrl_c_twice_ends_a_planner_that_ignores_signals(tmp_path, instances):
    with planning(tmp_path, instances, "stubborn") as (process, planner):
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
            time.sleep(0.2)
        assert process.returncode == 130
        assert process.stderr.read().endswith("mmp: interrupted\n")
    with pytest.raises(ProcessLookupError):
        os.kill(planner, 0)


def test_the_planner_process_does_not_outlive_the_program(tmp_path, instances):
    with planning(tmp_path, instances, "stubborn") as (process, planner):
        process.kill()
        process.wait()
        end = time.monotonic() + 60
        with contextlib.suppress(ProcessLookupError):
            while time.monotonic() < end:
                os.kill(planner, 0)
                time.sleep(0.05)
    with pytest.raises(ProcessLookupError):
        os.kill(planner, 0)
