"""Hostile calls of the native core: the fuzzer judges what they raise and return, and keeps their arguments."""

import importlib
import json
import random

import numpy as np
import pytest
from fuzz import core_arrays, core_results, kept_calls
from support import checkout_scripts
from support.core_calls import CALLS
from support.core_objects import CELL, ROWS
from support.wrong_arguments import WRONG

from mmp_env.errors import MmpError

NAN_ROWS = np.full((4, 2), np.nan)


def raising(error):
    def of(**_):
        raise error

    return of


def fault(name, result, **changed):
    arguments = CALLS[name].valid | changed
    return core_arrays.attempt(name, arguments, lambda **_: result)[1]


def test_hostile_calls_reach_every_function_and_are_repeatable(tmp_path):
    assert {core_arrays.name_of("0", k) for k in range(3000)} == set(CALLS)
    place = tmp_path / "number"
    place.write_bytes(bytes(8))
    first = core_arrays.run("7", 200, place)
    assert first == core_arrays.run("7", 200, place)
    assert 0 < first["returned"] < 200
    assert first["faults"] == {}


@pytest.mark.parametrize("error", [ValueError("x"), TypeError("x"), MmpError("x")])
def test_a_refusal_is_no_fault(error):
    assert core_arrays.attempt("tool_points", CALLS["tool_points"].valid, raising(error)) == (False, "")


@pytest.mark.parametrize(
    "error", [SystemError("x"), MemoryError("x"), OverflowError("x"), RuntimeError("x"), KeyError("x")]
)
def test_another_exception_is_a_fault(error):
    assert "raised" in core_arrays.attempt("tool_points", CALLS["tool_points"].valid, raising(error))[1]


def test_too_little_memory_is_a_fault_unless_an_argument_is_huge():
    huge = CALLS["tool_points"].valid | {"q": np.zeros((core_results.HUGE, 2))}
    assert core_arrays.attempt("tool_points", huge, raising(MemoryError())) == (False, "")


@pytest.mark.parametrize(
    ("name", "result", "words"),
    [
        ("tool_points", np.zeros((3, 3)), "shapes [(3, 3)]"),
        ("tool_points", np.full((4, 3), np.nan), "returned a number that is not finite"),
        ("static_clearance", np.full(4, np.inf), "returned a number that is not finite"),
        ("hull_distances", np.array([[-np.inf, np.inf]] * 3), "returned a number that is not finite"),
        ("with_turns", (np.zeros((2, 3)), np.zeros((1, 1))), "shapes [(2, 3), (1, 1)]"),
        ("replan", ([np.zeros((4, 2)), np.zeros((3, 2))], 0), "shapes [(4, 2), (3, 2)]"),
    ],
)
def test_nonsense_that_is_returned_is_a_fault(name, result, words):
    assert words in fault(name, result)


@pytest.mark.parametrize("name", ["tool_points", "static_clearance", "spheres"])
def test_a_configuration_that_is_not_a_number_must_be_refused(name):
    assert "took q with a number that is not finite" in fault(name, None, q=NAN_ROWS)


def test_a_state_that_is_not_a_number_must_not_be_certified():
    assert "took q with a number that is not finite" in fault("certify", None, q=[ROWS, NAN_ROWS])


def test_overlapping_hulls_and_nothing_found_are_no_faults():
    assert fault("hull_distances", np.array([[-np.inf, 0.0]] * 3)) == ""
    assert fault("SingleArm.plan", (None, 10)) == ""
    far = np.zeros(4, dtype=np.int32), np.full(4, np.inf)
    assert fault("deepest_balls", far, radii=np.zeros(0), centers=np.zeros((0, 3))) == ""
    assert fault("deepest_balls", far)


@pytest.mark.parametrize("name", CALLS)
def test_valid_calls_have_no_faults(name):
    assert core_arrays.attempt(name, CALLS[name].valid)[1] == ""


def test_huge_arrays_and_arrays_without_strides_are_drawn():
    drawn = [core_arrays.hostile(ROWS, random.Random(k)) for k in range(5000)]
    arrays = [value for value in drawn if isinstance(value, np.ndarray)]
    assert any(array.size >= core_results.HUGE for array in arrays)
    assert any(array.size >= core_results.HUGE and 0 in array.strides for array in arrays)
    assert any(array.shape == ROWS.shape and 0 in array.strides for array in arrays)


def layout(value):
    """Returns what must be kept of a value: types, numbers and the layout of arrays, and the object of the core."""
    if isinstance(value, np.ndarray):
        items = value.tolist() if value.dtype.kind == "O" else value.tobytes()
        return value.dtype, value.shape, () if value.dtype.kind == "O" else value.strides, repr(items)
    if isinstance(value, list | tuple):
        return type(value), [layout(item) for item in value]
    is_native = type(value).__module__.startswith("mmp_env._core")
    return type(value), id(value) if is_native else None if type(value) is object else repr(value)


def test_kept_calls_have_the_same_arguments():
    for k in range(3000):
        name, arguments = core_arrays.call_of("kept", k)
        again = kept_calls.from_json(kept_calls.to_json(name, arguments))
        assert again[0] == name
        assert {key: layout(value) for key, value in again[1].items()} == {
            key: layout(value) for key, value in arguments.items()
        }, name


def test_all_wrong_values_can_be_kept():
    for kind, values in WRONG.items():
        for value in [*values, *core_arrays.OBJECTS, CELL]:
            again = kept_calls.from_json(kept_calls.to_json(kind, {"x": value}))[1]["x"]
            assert layout(again) == layout(value), kind


def test_a_faulty_call_is_kept_and_reported(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    fuzzer = importlib.import_module("fuzz.__main__")
    tested = fuzzer.Fuzzing(fuzzer.Settings(0, 0.0, tmp_path, 1.0, 0.0), {})

    class Answering:
        def ask(self, request):
            return {"calls": 10, "returned": 4, "faults": {"7": "raised SystemError: x"}}

    tested._call_core(Answering(), "0/core/1")
    assert (tested.calls, tested.returned, len(tested.found)) == (10, 4, 1)
    (path,) = tmp_path.glob("*.json")
    assert kept_calls.from_json(path.read_text())[0] == core_arrays.name_of("0/core/1", 7)
    assert set(json.loads(path.read_text())) == {"name", "arguments"}
