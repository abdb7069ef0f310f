"""Planners of an installed test package, for the tests of `mmp bench`. Worker processes find them by entry points."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from support.stand_in_planners import Helpless, Liar, Straight, straight_plan

from mmp_env.events import NodeExpanded
from mmp_env.model.plan import Plan
from mmp_planners import PlanResult, Status, StopPlanning, ignore, make

HERE = Path(__file__).parents[1]


@dataclass
class Quick(Straight):
    """Goes straight, and keeps no state."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        name = {"name": "quick", "options": {"w": self.w}, "seed": seed}
        plan = straight_plan(problem, name, self.steps)
        return PlanResult(status=Status.SOLVED, plan=plan, stats={"bound_met": True})


@dataclass
class Slow(Quick):
    """Goes straight, writes a file for each run, and waits while the file `hold` exists."""

    takes: float = 0.0
    folder: str = "."

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        folder = Path(self.folder)
        mark = folder / f"{problem.name.replace('/', '-')}.{os.getpid()}"
        mark.write_text(f"{os.getpid()}")
        time.sleep(self.takes)
        while (folder / "hold").exists():
            time.sleep(0.01)
        return super().plan(problem, seed=seed)


@dataclass
class Rogue:
    """Does the misdeed that the option `deed` names."""

    deed: str = "raise"

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        print("a word to the terminal")
        return DEEDS[self.deed](problem, straight_plan(problem, {"name": "rogue"}))


@dataclass
class Sulks:
    """Cannot be made."""

    def __post_init__(self):
        raise RuntimeError("not today")

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        raise AssertionError("never called")


@dataclass
class Searching:
    """Searches like `apf-ecbs`, with events."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        watch("what nobody understands")
        strange = NodeExpanded(elapsed_s=0.0, node=0, open_nodes=0, expanded_nodes=1, conflicts=0)
        object.__setattr__(strange, "node", self)
        watch(strange)
        return make("apf-ecbs").plan(problem, seed=seed, time_limit=time_limit, watch=watch)


@dataclass
class Stubborn:
    """Prints that it has begun, and ignores interruptions."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        print(f"waiting {os.getpid()}", flush=True)
        _hang(problem, None)


@dataclass
class Chatty:
    """Emits events for ever, and ignores the deadline."""

    def plan(self, problem, *, seed=0, time_limit=math.inf, watch=ignore):
        while True:
            watch(NodeExpanded(elapsed_s=0.0, node=0, open_nodes=0, expanded_nodes=1, conflicts=0))


class Odd:
    """Takes a problem and nothing else."""

    def plan(self, problem):
        raise AssertionError("never called")


def _raise(problem, plan):
    raise KeyError("a bug")


def _crash(problem, plan):
    os.kill(os.getpid(), signal.SIGSEGV)


def _hang(problem, plan):
    while True:
        with contextlib.suppress(BaseException):
            time.sleep(60)


def _tear(problem, plan):
    """Writes the first bytes of a message to every open file descriptor, and stops."""
    for descriptor in range(3, 64):
        with contextlib.suppress(OSError):
            os.write(descriptor, (1000).to_bytes(4, "big") + b"answer")
    _hang(problem, plan)


def _eat(problem, plan):
    eaten = [np.ones(2**23) for _ in range(30)]  # 64 MB each
    _hang(problem, eaten)


def _stop(problem, plan):
    raise StopPlanning("enough")


def _other_problem(problem, plan):
    away = {name: rows + 0.1 for name, rows in plan.positions.items()}
    other = replace(problem, start={n: q[0] for n, q in away.items()}, goal={n: q[-1] for n, q in away.items()})
    return PlanResult(status=Status.SOLVED, plan=Plan(problem=other, times=plan.times, positions=away))


class Unusual(BaseException):
    """An exception that `except Exception` lets through."""


class Mute(Exception):
    """An exception whose text cannot be read."""

    def __str__(self):
        raise RuntimeError("no comment")


class Guarded:
    """A result whose attributes cannot be read."""

    status, stats = Status.SOLVED, {}

    @property
    def plan(self):
        raise Unusual("hands off")


def _throw(error):
    raise error


def _leave_the_folder(problem, plan):
    os.chdir("/")
    return _sound(plan)


def _fork(problem, plan):
    os.fork()  # both processes return
    return _sound(plan)


def _fork_and_stay(problem, plan):
    if os.fork() == 0:
        time.sleep(60)
    return _sound(plan)


def _meddle(problem, plan):
    """Plans to another goal, and changes the problem to match."""
    arm = problem.cell.arms[0]
    for array in (*problem.goal.values(), arm.position, arm.robot.upper):
        array.base.flags.writeable = array.flags.writeable = True
        array += 0.01
    object.__setattr__(arm.robot, "name", "panda")
    object.__setattr__(problem, "start", {name: q + 0.01 for name, q in problem.start.items()})
    moved = {name: rows + 0.01 for name, rows in plan.positions.items()}
    return PlanResult(status=Status.SOLVED, plan=replace(plan, positions=moved))


def _sound(plan, **changes):
    return PlanResult(status=Status.SOLVED, plan=replace(plan, **changes))


def _forged(plan, **changes):
    for name, value in changes.items():
        object.__setattr__(plan, name, value)
    return PlanResult(status=Status.SOLVED, plan=plan)


DEEDS = {
    "raise": _raise,
    "crash": _crash,
    "hang": _hang,
    "tear": _tear,
    "eat": _eat,
    "stop": _stop,
    "exit": lambda problem, plan: sys.exit(0),
    "leave": lambda problem, plan: os._exit(3),
    "interrupt": lambda problem, plan: signal.raise_signal(signal.SIGINT),
    "nothing": lambda problem, plan: None,
    "plan": lambda problem, plan: plan,
    "status": lambda problem, plan: PlanResult(status="won", plan=plan),
    "no_plan": lambda problem, plan: PlanResult(status=Status.SOLVED),
    "a_plan_and_a_timeout": lambda problem, plan: PlanResult(status=Status.TIMEOUT, plan=plan),
    "another_plan": lambda problem, plan: PlanResult(status=Status.SOLVED, plan=[1, 2]),
    "arms": lambda problem, plan: PlanResult(status=Status.SOLVED, plan=replace(plan, positions={})),
    "stats": lambda problem, plan: PlanResult(status=Status.TIMEOUT, stats={"expanded_nodes": "many"}),
    "no_stats": lambda problem, plan: PlanResult(status=Status.TIMEOUT, stats=3),
    "objects": lambda problem, plan: PlanResult(status=Status.TIMEOUT, stats={"bound_met": object()}),
    "other_problem": _other_problem,
    "unusual": lambda problem, plan: _throw(Unusual("so there")),
    "mute": lambda problem, plan: _throw(Mute()),
    "guarded": lambda problem, plan: Guarded(),
    "no_options": lambda problem, plan: _sound(plan, planner={"options": None}),
    "no_name": lambda problem, plan: _sound(plan, planner={"name": 3}),
    "text": lambda problem, plan: _forged(plan, positions={a: q.astype(str) for a, q in plan.positions.items()}),
    "no_number": lambda problem, plan: _forged(plan, positions={a: np.nan * q for a, q in plan.positions.items()}),
    "all_text": lambda problem, plan: _forged(plan, positions="left, then right"),
    "move": _leave_the_folder,
    "fork": _fork,
    "fork_and_stay": _fork_and_stay,
    "meddle": _meddle,
    "sound": lambda problem, plan: _sound(plan),
    "endless": lambda problem, plan: _sound(plan, times=1e13 * plan.times),
    "countless": lambda problem, plan: PlanResult(
        status=Status.SOLVED, plan=plan, stats={"expanded_nodes": 10**400, "generated_nodes": 1}
    ),
    "no_interrupt": lambda problem, plan: _throw(KeyboardInterrupt),
    "close": lambda problem, plan: os.closerange(3, 256),
}
POINTS = {
    "quick": "support.bench_stand_ins:Quick",
    "slow": "support.bench_stand_ins:Slow",
    "rogue": "support.bench_stand_ins:Rogue",
    "sulks": "support.bench_stand_ins:Sulks",
    "odd": "support.bench_stand_ins:Odd",
    "helpless": f"support.bench_stand_ins:{Helpless.__name__}",
    "liar": f"support.bench_stand_ins:{Liar.__name__}",
    "absent": "no_such_package:Planner",
    "deadly": "deadly_import:Planner",
    "leaving": "leaving_import:Planner",
    "gone": "gone_import:Planner",
    "searching": "support.bench_stand_ins:Searching",
    "stubborn": "support.bench_stand_ins:Stubborn",
    "chatty": "support.bench_stand_ins:Chatty",
}


def install(folder: Path) -> None:
    """Makes a folder that is an installed distribution with these planners if it is on Python's path."""
    info = folder / "bench_stand_ins-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bench-stand-ins\nVersion: 1.0\n")
    lines = "\n".join(f"{name} = {value}" for name, value in POINTS.items())
    (info / "entry_points.txt").write_text(f"[mmp_env.planners]\n{lines}\n")
    (folder / "deadly_import.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    (folder / "gone_import.py").write_text("import os\nos._exit(0)\n")
    (folder / "leaving_import.py").write_text("import sys\nsys.exit('bye')\n")
