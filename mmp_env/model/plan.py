"""A plan: one trajectory per arm on a common clock, linear between its times."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.argument_checks import as_numbers, given, refused
from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.model.problem import Problem
from mmp_env.model.read_only import ReadOnly
from mmp_env.wording import counted, in_seconds


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan(ReadOnly):
    """The trajectories of all arms. Mappings and arrays are read-only, also in copies.

    Attributes:
        problem: the problem that the plan solves.
        times: [t] [s], ascending from 0.
        positions: arm name -> [t, dof] [rad].
        planner: name, options and seed of the planner.
        stats: counts of the run, no wall-clock times: the same run gives the same plan file.
        velocities: arm name -> [t, dof] [rad/s], of a retimed plan.
        accelerations: arm name -> [t, dof] [rad/s^2], of a retimed plan.
        max_acceleration: arm name -> [dof] [rad/s^2], limits of a retimed plan.
        max_jerk: arm name -> [dof] [rad/s^3], limits of a retimed plan.

    Raises:
        MmpError: if an attribute that maps arm names to arrays is no mapping.
    """

    problem: Problem
    times: Float[np.ndarray, "t"]
    positions: Mapping[str, Float[np.ndarray, "t dof"]]
    planner: Mapping[str, Any] = field(default_factory=dict)
    stats: Mapping[str, Any] = field(default_factory=dict)
    velocities: Mapping[str, Float[np.ndarray, "t dof"]] | None = None
    accelerations: Mapping[str, Float[np.ndarray, "t dof"]] | None = None
    max_acceleration: Mapping[str, Float[np.ndarray, "dof"]] | None = None
    max_jerk: Mapping[str, Float[np.ndarray, "dof"]] | None = None

    def __post_init__(self) -> None:
        for name in ("positions", "velocities", "accelerations", "max_acceleration", "max_jerk"):
            value = getattr(self, name)
            if value is not None or name == "positions":
                given(f"{name} of a plan", value, Mapping, "a mapping from arm name to array")
        super().__post_init__()

    @brief
    def __repr__(self) -> str:
        problem, maker = self.problem.name or self.problem.cell.name, self.planner.get("name")
        size = f"{counted(len(self.positions), 'arm')}, {counted(len(self.times), 'sample')}"
        return (
            f"for {problem}: {size}, {in_seconds(self.makespan_s)}, {self.cost_rad:.2f} rad,"
            f" {'retimed' if self.retimed else 'not retimed'}{f', by {maker}' if maker else ''}"
        )

    @property
    def makespan_s(self) -> float:
        """Duration of the plan [s]."""
        return float(self.times[-1])

    @property
    def retimed(self) -> bool:
        """Whether the plan has velocities, as `mmp_env.retime` adds them, and not only straight lines."""
        return self.velocities is not None

    @property
    def steps_in_velocity(self) -> bool:
        """Whether the plan moves and is not retimed: its velocity jumps, which no motor can follow."""
        return not self.retimed and self.cost_rad > 0

    @cached_property
    def cost_rad(self) -> float:
        """Cost [rad]: the sum of |dq| over arms, joints and steps. A metre of a slide counts as a radian."""
        return float(sum(np.add.reduce(np.abs(q[1:] - q[:-1]), axis=None) for q in self.positions.values()))

    def check_complete(self) -> None:
        """Raises `MmpError` for a plan without an arm of its cell.

        Executions and pictures let such an arm stand still.
        """
        lacking = [name for name in self.problem.cell.arm_names if name not in self.positions]
        if lacking:
            raise MmpError(f"the plan does not say where arm '{lacking[0]}' of its cell is")

    def at(self, t: float) -> dict[str, Float[np.ndarray, "dof"]]:
        """Returns the configurations at time `t` [s]: arm name -> [dof] [rad].

        The arms stand still before the first and after the last time.

        Raises:
            MmpError: unless `t` is a number.
        """
        time_s = as_numbers(t)
        if time_s is None or time_s.ndim or np.isnan(time_s):
            raise refused("t", t, "a time [s]")
        return {arm: q[0] for arm, q in self.sampled(time_s[None]).items()}

    def sampled(self, times: Float[np.ndarray, "n"]) -> dict[str, Float[np.ndarray, "n dof"]]:
        """Returns the configurations at `times` [n] [s]: arm name -> [n, dof] [rad].

        The arms stand still before the first and after the last time of the plan.
        """
        return {
            arm: np.column_stack([np.interp(times, self.times, column) for column in q.T])
            for arm, q in self.positions.items()
        }

    def finer_times(self, step_rad: float) -> Float[np.ndarray, "n"]:
        """Returns times [s] between which no joint moves farther than `step_rad`: those of the plan, and more."""
        moves = [np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0) for q in self.positions.values()]
        counts = np.maximum(np.ceil(np.max(moves, axis=0, initial=0.0) / step_rad), 1).astype(int)
        pieces = [
            np.linspace(begin, end, count, endpoint=False)
            for begin, end, count in zip(self.times[:-1], self.times[1:], counts, strict=True)
        ]
        return np.concatenate([*pieces, self.times[-1:]])

    def show(
        self,
        report: Any = None,
        *,
        width: int = 480,
        height: int = 360,
        fps: float = 8.0,
        fine: bool = False,
        tool_paths: bool = True,
    ) -> Any:
        """Returns a film for a notebook, which is made when the notebook shows it.

        Args:
            report: an `ExecutionReport` of the plan, to show the recorded motion; None shows the plan itself.
            width: of the film [px].
            height: of the film [px].
            fps: frames per second, 60 at most.
            fine: draws shadows and smooth edges, which takes several times as long without a graphics card.
            tool_paths: draws the paths of the tools as lines.

        Returns:
            A `mmp_env.PlanView`.
        """
        view = importlib.import_module("mmp_env.view.notebook")  # by name: the model imports no view
        return view.PlanView(self, report, width=width, height=height, fps=fps, fine=fine, tool_paths=tool_paths)


def what_else(given: object) -> str:
    """Returns words for an object that is not a plan."""
    return "None" if given is None else f"of type {type(given).__name__}"


def how_to_plan(given: object) -> str:
    """Returns the end of a sentence: how to get the plan from another object; empty for an unknown one."""
    if isinstance(given, str | PathLike):
        return "; load a plan file with load_plan"
    if hasattr(given, "plan") and hasattr(given, "status"):
        return "; give the .plan of the planner's result"
    return ""
