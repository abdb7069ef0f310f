"""Steps that take and put down objects, and what the objects of some jobs must be like."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol, runtime_checkable

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.names import NAMES, is_name
from mmp_env.wording import shown

MOST_OBJECTS = 1000
"""Largest number of objects."""


@dataclass(frozen=True)
class Grasp:
    """A step that takes an object. From then on it moves with the tool."""

    object: str


@dataclass(frozen=True)
class Release:
    """A step that puts down an object. From then on it lies where it is."""

    object: str


@runtime_checkable
class UsingJob(Protocol):
    """The part of a `Job` that uses objects."""

    @property
    def name(self) -> str: ...
    @property
    def steps(self) -> Sequence[Any]: ...
    @property
    def arm(self) -> str | None: ...
    @property
    def after(self) -> Sequence[str]: ...


@dataclass(frozen=True)
class Use:
    """A step of a job that grasps or releases an object; `number` is that of the job."""

    job: UsingJob
    number: int
    step: int

    @property
    def where(self) -> str:
        """Begin of messages, such as `step 1 of job 'a'`."""
        return f"step {self.step} of job '{self.job.name}'"

    @property
    def grasps(self) -> bool:
        return isinstance(self.job.steps[self.step], Grasp)


def check_objects(cell: Cell, objects: Sequence[Obstacle], jobs: Sequence[UsingJob]) -> None:
    """Raises `MmpError` unless every object is one that arms can hold, and the jobs use each one at a time."""
    names = [each.name for each in objects]
    if len(names) > MOST_OBJECTS:
        raise MmpError(f"the work has {len(names)} objects; {MOST_OBJECTS} is the most")
    obstacles = {obstacle.name for obstacle in cell.obstacles}
    for each in objects:
        if not is_name(each.name):
            raise MmpError(f"an object is named {shown(each.name)}; a name must be {NAMES}")
        if each.name in obstacles:
            raise MmpError(f"object '{each.name}' has the name of an obstacle of the cell; names must differ")
        if each.shape == "mesh":
            raise MmpError(f"object '{each.name}' is a mesh; an arm holds a box, sphere, cylinder or capsule")
        if each.may_touch:
            raise MmpError(f"object '{each.name}' has may_touch; that is for obstacles of the cell")
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise MmpError(f"two objects are named '{twice[0]}'; names must differ")
    uses = _uses(jobs, names)
    before = _before(jobs)
    for name, found in uses.items():
        _check_uses(name, _in_order(name, found, before))
    _check_grippers(cell, jobs, objects)


def _uses(jobs: Sequence[UsingJob], names: Sequence[str]) -> dict[str, list[Use]]:
    """Returns object -> the steps that use it, job after job. Raises `MmpError` for an unknown object."""
    out: dict[str, list[Use]] = {}
    for number, job in enumerate(jobs):
        held: str | None = None
        for k, step in enumerate(job.steps):
            if not isinstance(step, Grasp | Release):
                continue
            use = Use(job=job, number=number, step=k)
            if step.object not in names:
                raise MmpError(f"{use.where}: {UnknownNameError('object', step.object, names)}")
            if isinstance(step, Grasp) and held is not None:
                raise MmpError(f"{use.where} grasps '{step.object}', but the gripper is full: it holds '{held}'")
            held = step.object if isinstance(step, Grasp) else None
            out.setdefault(step.object, []).append(use)
    return out


def _before(jobs: Sequence[UsingJob]) -> list[int]:
    """Returns for each job the jobs that are done before it, as bits by their numbers."""
    numbers = {job.name: k for k, job in enumerate(jobs)}
    out: dict[int, int] = {}
    waiting = [(k, False) for k in reversed(range(len(jobs)))]
    while waiting:
        k, ready = waiting.pop()
        after = [numbers[name] for name in jobs[k].after]
        if ready:
            out[k] = 0
            for j in after:
                out[k] |= out[j] | 1 << j
        elif k not in out:
            waiting += [(k, True), *((j, False) for j in after)]
    return [out[k] for k in range(len(jobs))]


def _in_order(name: str, uses: Sequence[Use], before: Sequence[int]) -> list[Use]:
    """Returns the uses of an object in their order. Raises `MmpError` if two jobs have no order."""
    numbers = sorted({use.number for use in uses}, key=lambda k: (before[k].bit_count(), k))
    for first, second in pairwise(numbers):
        if not before[second] >> first & 1:
            jobs = {use.number: use.job.name for use in uses}
            raise MmpError(
                f"jobs '{jobs[first]}' and '{jobs[second]}' both use object '{name}', and neither comes after the"
                " other; give one of them an 'after'"
            )
    place = {k: index for index, k in enumerate(numbers)}
    return sorted(uses, key=lambda use: (place[use.number], use.step))


def _check_uses(name: str, uses: Sequence[Use]) -> None:
    """Raises `MmpError` unless the object is grasped and released in turn, each time by one arm."""
    holder: Use | None = None
    for use in uses:
        if use.grasps:
            if holder is not None:
                same = holder.job is use.job or (holder.job.arm is not None and holder.job.arm == use.job.arm)
                who = "the arm itself" if same else "another arm"
                raise MmpError(f"{use.where} grasps '{name}', which {who} holds since {holder.where}")
            holder = use
            continue
        if holder is None:
            raise MmpError(f"{use.where} releases '{name}', which is not held")
        if holder.job is not use.job and (holder.job.arm is None or holder.job.arm != use.job.arm):
            raise MmpError(
                f"{use.where} releases '{name}', which {holder.where} grasps; both jobs must name the same arm"
            )
        holder = None


def least_width(solid: Obstacle) -> float:
    """Returns the least width of a solid that is no mesh, over all directions [m]."""
    return float(2 * solid.half_extents.min())


def _check_grippers(cell: Cell, jobs: Sequence[UsingJob], objects: Sequence[Obstacle]) -> None:
    """Raises `MmpError` for a grasp of an object that is larger than the opening of every gripper that may do it."""
    widths: Mapping[str, float] = {each.name: least_width(each) for each in objects}
    for number, job in enumerate(jobs):
        arms = [arm for arm in cell.arms if job.arm in (None, arm.name)]
        for k, step in enumerate(job.steps):
            if not isinstance(step, Grasp):
                continue
            where = Use(job=job, number=number, step=k).where
            openings = [arm.opening for arm in arms]
            known = [opening for opening in openings if opening is not None]
            if len(known) == len(openings) and widths[step.object] > max(known):
                raise MmpError(
                    f"{where} grasps '{step.object}', which is {widths[step.object]:g} m wide; the gripper opens"
                    f" {max(known):g} m"
                )
            if all(arm.held is not None for arm in arms):
                held = arms[0].held
                assert held is not None
                raise MmpError(
                    f"{where} grasps '{step.object}', but the gripper is full: arm '{arms[0].name}' holds"
                    f" '{held.name}' from the start"
                )
