"""Messages of a planner's process: plain data, which names no code that the reader would have to run."""

from __future__ import annotations

import dataclasses
import io
import pickle
from collections.abc import Mapping
from typing import Any

from mmp_env import events
from mmp_env.events import Event
from mmp_env.files.writing import plain
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.model.read_only import read_only
from mmp_planners import PlanResult, Status

_NUMPY = {"_reconstruct", "_frombuffer", "scalar", "ndarray", "dtype"}
_PARTS = [field.name for field in dataclasses.fields(Plan) if field.name != "problem"]


def encode(message: Any) -> bytes:
    """Returns the message as bytes. Raises what a value raises that cannot be pickled."""
    return pickle.dumps(message, protocol=5)


def decode(data: bytes) -> Any:
    """Returns the message. Raises `pickle.UnpicklingError` if it holds anything but data."""
    return _Reader(io.BytesIO(data)).load()


def is_known(event: Any) -> bool:
    """Returns whether it is one of the events of `mmp_env.events`, which all watchers know."""
    return isinstance(event, Event) and getattr(events, type(event).__name__, None) is type(event)


def result_to_data(result: PlanResult) -> dict[str, Any]:
    """Returns a validated result without its problem, and with the statistics that JSON can hold."""
    plan = None if result.plan is None else {name: getattr(result.plan, name) for name in _PARTS}
    return {"status": str(result.status), "stats": _writable(result.stats), "plan": plan}


def result_from_data(data: Any, problem: Problem) -> PlanResult:
    """Returns the result for `problem`, not yet validated. Raises any exception for other data."""
    plan = None if data["plan"] is None else Plan(problem=problem, **data["plan"])
    return PlanResult(status=Status(data["status"]), stats=data["stats"], plan=plan)


def _writable(stats: Mapping[str, Any]) -> dict[str, Any]:
    out = {}
    for key, value in stats.items():
        try:
            out[str(key)] = plain(value)
        except TypeError:
            continue
    return out


class _Reader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if module == "mmp_env.events":
            found = getattr(events, name, None)  # `getattr` finds no name with dots, so none that the module imports
            if isinstance(found, type) and issubclass(found, Event):
                return found
        elif (module, name) == ("mmp_env.model.read_only", "read_only"):
            return read_only
        elif module.partition(".")[0] == "numpy" and name in _NUMPY:
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"a message names {module}.{name}, which is no data")
