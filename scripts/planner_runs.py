"""Runs of one planner over many instances, each plan checked twice: the work that `bench_planners.py` gives away."""

from __future__ import annotations

import hashlib
import resource
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import mmp_planners
from mmp_env import InvalidInstanceError, MmpError, check_plan, draw_instance, load_instances, make_problem, ring_cell
from mmp_env.cell import Cell
from mmp_env.plan import Plan
from mmp_env.plan_file import plan_to_dict
from mmp_env.problem import Problem
from mmp_env.writing import json_text
from mmp_planners import PlanResult
from mmp_planners.calling import call

_COUNT = 50
_FEW_ARMS, _LIMIT_OF_FEW_S, _LIMIT_S = 4, 5.0, 10.0
_PATIENCE = 10


@dataclass(frozen=True, kw_only=True)
class Job:
    """One planner on one source: an environment id, `id:robot`, or an instance file.

    An id has `count` instances, those of the seeds from `seed` on, which are the planner's seeds too; a file has its
    own (the first `count`, all by default), planned with `seed`. `limit_s` None: 5 s up to four arms, 10 s beyond.
    """

    source: str
    planner: str
    seed: int = 0
    count: int | None = None
    limit_s: float | None = None
    options: dict[str, Any] = field(default_factory=dict)
    exact: bool = True

    @property
    def name(self) -> str:
        """What the source is called in figures."""
        return Path(self.source).stem if self.source.endswith(".json") else self.source.replace(":", " ")

    @property
    def label(self) -> str:
        """What the planner and its options are called in figures."""
        return " ".join([self.planner, *(f"{key}={value}" for key, value in sorted(self.options.items()))])


@dataclass(frozen=True, kw_only=True)
class Instance:
    """One problem of a job, made when it is its turn; `seed` is the planner's."""

    name: str
    seed: int
    limit_s: float
    problem: Callable[[], Problem]


@dataclass(frozen=True, kw_only=True)
class Run:
    """What became of one instance. `faults` are violations by the spheres, `exact_faults` by the geoms, if checked.

    An invalid instance has no `time_s`; `first_s` is when the first plan was proved, of planners that improve on it;
    `digest` is a hash of the plan's file.
    """

    instance: str
    status: str
    time_s: float | None = None
    first_s: float | None = None
    nodes: int | None = None
    cost_rad: float | None = None
    cost_ratio: float | None = None
    deadline_hit: bool = False
    faults: list[str] = field(default_factory=list)
    exact_faults: list[str] | None = None
    digest: str | None = None


def instances(job: Job) -> Iterator[Instance]:
    """The instances of a job. Raises `MmpError` for a source that is none."""
    return _of_file(job) if job.source.endswith(".json") else _of_environment(job)


def _of_file(job: Job) -> Iterator[Instance]:
    file = load_instances(job.source)
    limit_s = _limit(job, len(file.cell.arms))
    for instance in file.instances[: job.count]:
        problem = partial(file.problem, instance)
        yield Instance(name=instance.name, seed=job.seed, limit_s=limit_s, problem=problem)


def _of_environment(job: Job) -> Iterator[Instance]:
    environment, _, robot = job.source.partition(":")
    arms = environment.removeprefix("MultiArmCell-")
    if not arms.isdigit():
        raise MmpError(f"'{job.source}' is neither an environment id, such as MultiArmCell-8:panda, nor a .json file")
    cell = ring_cell(int(arms), robot or "ur5e")
    limit_s = _limit(job, len(cell.arms))
    for seed in range(job.seed, job.seed + (_COUNT if job.count is None else job.count)):
        name = f"{environment}/{seed}"
        yield Instance(name=name, seed=seed, limit_s=limit_s, problem=partial(_drawn, cell, seed, name))


def _drawn(cell: Cell, seed: int, name: str) -> Problem:
    return make_problem(cell, *draw_instance(cell, seed=seed), name=name)


def check_job(job: Job) -> None:
    """Raises `MmpError` for a job that cannot be done, before a process is started for it."""
    mmp_planners.make(job.planner, **job.options)
    next(instances(job))


def run_all(job: Job) -> tuple[list[Run], float]:
    """Every instance of a job, one after the other, and the peak memory of this process [MB]."""
    planner = mmp_planners.make(job.planner, **job.options)
    runs = []
    for instance in instances(job):
        runs.append(_run(job, planner, instance))
        print(f"{job.name} {job.label} {_told(runs[-1])}", file=sys.stderr, flush=True)
    return runs, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def plan_twice(job: Job) -> list[tuple[str | None, str | None]]:
    """For every instance, hashes of its plan file from two runs with the same seed.

    They have so much time that none is cut short because the machine is busy.
    """
    planner = mmp_planners.make(job.planner, **job.options)
    long = [replace(instance, limit_s=_PATIENCE * instance.limit_s) for instance in instances(job)]
    return [
        (_digest(_planned(job.planner, planner, x)[0]), _digest(_planned(job.planner, planner, x)[0])) for x in long
    ]


def _limit(job: Job, arms: int) -> float:
    return job.limit_s if job.limit_s is not None else _LIMIT_OF_FEW_S if arms <= _FEW_ARMS else _LIMIT_S


def _planned(name: str, planner: mmp_planners.Planner, instance: Instance) -> tuple[PlanResult, float]:
    """The result and its planning time [s]: the cell is built before the clock starts, the certificate is in it."""
    try:
        problem = instance.problem()
    except InvalidInstanceError:
        return PlanResult(status=mmp_planners.Status.INVALID), 0.0
    begin = time.perf_counter()
    result = call(name, planner, problem, seed=instance.seed, time_limit=instance.limit_s)
    return result, time.perf_counter() - begin


def _run(job: Job, planner: mmp_planners.Planner, instance: Instance) -> Run:
    result, spent = _planned(job.planner, planner, instance)
    if result.status is mmp_planners.Status.INVALID:
        return Run(instance=instance.name, status=str(result.status))
    plan = result.plan
    return Run(
        instance=instance.name,
        status=str(result.status),
        time_s=spent,
        first_s=result.stats.get("first_plan_s"),
        nodes=result.stats.get("expanded_nodes"),
        cost_rad=plan.cost_rad if plan else None,
        cost_ratio=plan.cost_rad / plan.problem.cost_lower_bound_rad if plan else None,
        deadline_hit=bool(result.stats.get("deadline_hit")),
        faults=_faults(plan, exact=False),
        exact_faults=_faults(plan, exact=True) if job.exact else None,
        digest=_digest(result),
    )


def _faults(plan: Plan | None, *, exact: bool) -> list[str]:
    """Every violation that the checker finds in what would stand in the plan's file."""
    if plan is None:
        return []
    return [str(violation) for violation in check_plan(plan_to_dict(plan), exact=exact).violations]


def _digest(result: PlanResult) -> str | None:
    """A hash of the plan's file, None without a plan."""
    return hashlib.sha256(json_text(plan_to_dict(result.plan)).encode()).hexdigest() if result.plan else None


def _told(run: Run) -> str:
    told = f"{run.instance}: {run.status}"
    if run.time_s is not None:
        told += f", {run.time_s:.3f} s"
    if run.nodes is not None:
        told += f", {run.nodes} nodes"
    return "; ".join([told, *run.faults, *(run.exact_faults or [])])
