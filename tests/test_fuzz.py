"""The fuzzer: it finds planted faults, and no input that once failed fails again."""

import random
from pathlib import Path

import pytest
from fuzz import changes, core_arrays, inputs, judges, planted_faults, samples
from fuzz.process import Worker
from support import core_calls

REGRESSIONS = sorted((Path(__file__).parent / "fuzz" / "regressions").glob("*.json"))
FOUND = {
    "raises": "traceback",
    "planner_raises": "planner 'x' raised ValueError",
    "hangs": "no answer within",
    "crashes": "signal 11",
    "leaves_half_a_file": "refused, and left out.json",
    "is_silent": "exit code 2 without a sentence",
    "accepts_everything": "two arms of one name",
    "overwrites": "changed cell.json",
}


@pytest.fixture(scope="module")
def worker():
    out = Worker(longest_s=60.0)
    yield out
    out.close()


def given(kind, **files):
    return inputs.Input(kind=kind, line=inputs.with_limits(samples.LINES[kind][1]), files=files)


@pytest.mark.parametrize("kind", samples.LINES)
def test_the_good_inputs_are_accepted(kind, worker):
    code, faults = inputs.tried(given(kind), worker)
    assert (code in (0, 1), faults) == (True, [])


@pytest.mark.parametrize("path", REGRESSIONS, ids=lambda path: path.stem)
def test_what_once_failed_is_handled(path, worker):
    code, faults = inputs.tried(inputs.Input.from_json(path.read_text()), worker)
    assert code is not None, faults
    assert faults == []


def test_every_planted_fault_has_a_test():
    assert set(FOUND) == {
        name
        for name, value in vars(planted_faults).items()
        if getattr(value, "__module__", "") == planted_faults.__name__
    }


@pytest.mark.parametrize("planted", FOUND)
def test_planted_faults_are_found(planted):
    worker = Worker(longest_s=1.0)
    inputs.tried(given("list"), worker)  # the process has imported everything
    double = b'{"arms": [{"name": "a"}, {"name": "a"}]}'
    _, faults = inputs.tried(given("cell", **{"cell.json": double}), worker, planted)
    assert any(FOUND[planted] in fault for fault in faults), faults
    worker.close()


@pytest.mark.parametrize("document", ['{"shape": "box", "size": [0, 1, 1]}', "[NaN]", '{"a": 1e999}', "3"])
def test_the_validator_knows_nonsense(document):
    assert judges.reasons(judges.json.loads(document))


def test_the_same_seed_gives_the_same_inputs_and_most_differ(tmp_path):
    good = samples.write_all(tmp_path)
    drawn = [inputs.drawn(good, random.Random(f"{k}")) for k in range(200)]
    assert drawn == [inputs.drawn(good, random.Random(f"{k}")) for k in range(200)]
    assert len({given.to_json() for given in drawn}) > 150
    many = (inputs.drawn(good, random.Random(f"{k}")) for k in range(2000))
    assert {given.kind for given in many} == set(samples.LINES)


def test_hostile_calls_reach_every_function_and_are_repeatable(tmp_path):
    names = [core_arrays.arguments_of(random.Random(f"0/{k}"))[0] for k in range(3000)]
    assert set(names) == set(core_calls.CALLS)
    place = tmp_path / "number"
    place.write_bytes(bytes(8))
    first = core_arrays.run(7, 200, place)
    assert first == core_arrays.run(7, 200, place)
    assert 0 < first["returned"] < 200


def test_options_of_commands_exist():
    assert set(changes.OPTIONS) == {line[0] for _, line in samples.LINES.values()}
