"""Simulation of a cell whose objects are grasped and released: a body for each object, in each of its phases.

MuJoCo cannot move a body from the world to an arm. So each object is several bodies, of which one is there at a time:
where it lies, or in the tool that holds it. The others collide with nothing, weigh nothing and are not drawn. Contacts
that are allowed for a time are those of a body of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.held import HELD
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.contacts import PHASE
from mmp_env.sim.scene import OBSTACLE_PREFIX, add_held, add_object, compile_scene
from mmp_env.sim.simulation import Simulation
from mmp_env.work.replay import Window
from mmp_env.work.world import holding_parts

Allowed = frozenset[str]
"""Bodies that a body may touch."""


@dataclass(frozen=True, kw_only=True)
class Phase:
    """An object that lies (`arm` is empty) or hangs, and what it may touch there: solids of the cell, or parts."""

    arm: str
    solid: Obstacle
    allowed: Allowed


class Phases:
    """The bodies of all objects in all windows.

    Args:
        cell: arms and obstacles.
        windows: the objects over time.
    """

    def __init__(self, cell: Cell, windows: Sequence[Window]) -> None:
        self._cell, self.windows = cell, windows
        self._numbers: dict[Phase, int] = {}
        self._excluded: set[tuple[str, str]] = set()
        self.active = [self._bodies(window) for window in windows]

    @property
    def names(self) -> list[str]:
        """Names of all bodies."""
        return [self._name(phase) for phase in self._numbers]

    def model(self) -> mujoco.MjModel:
        """Returns the model of the cell with all bodies."""
        obstacles = {f"{OBSTACLE_PREFIX}{each.name}": each.name for each in self._cell.obstacles}
        own = {obstacles[name] for pair in self._excluded for name in pair if name in obstacles}
        return compile_scene(self._cell, moving_setpoints=True, bodies=own, more=self._add)

    def _add(self, spec: mujoco.MjSpec) -> None:
        for phase in self._numbers:
            name = self._name(phase)
            if not phase.arm:
                add_object(spec, phase.solid, name)
                continue
            arm = self._cell.arm(phase.arm)
            add_held(spec, arm, phase.solid, name.partition("/")[2])
            for part in holding_parts(arm):
                spec.add_exclude(bodyname1=part, bodyname2=name)
        for first, second in sorted(self._excluded):
            spec.add_exclude(bodyname1=first, bodyname2=second)

    def _bodies(self, window: Window) -> list[str]:
        """Returns the names of the bodies of a window."""
        world, obstacles = window.world, {each.name for each in self._cell.obstacles}
        lying, out = {}, []
        for name, solid in world.lying.items():
            parts = frozenset(part for part, other in world.touching if other == name and not part.endswith(f"/{HELD}"))
            lying[name] = self._known(Phase(arm="", solid=solid, allowed=parts))
            self._excluded |= {(lying[name], part) for part in parts}
            out.append(lying[name])
        for arm, solid in world.held.items():
            solids = frozenset(other for part, other in world.touching if part == f"{arm}/{HELD}")
            body = self._known(Phase(arm=arm, solid=solid, allowed=solids))
            out.append(body)
            known = {name: f"{OBSTACLE_PREFIX}{name}" for name in obstacles} | lying
            self._excluded |= {(body, known[name]) for name in solids if name in known}
        return out

    def _known(self, phase: Phase) -> str:
        self._numbers.setdefault(phase, len(self._numbers))
        return self._name(phase)

    def _name(self, phase: Phase) -> str:
        of = f"{phase.arm}/{HELD}" if phase.arm else f"{OBSTACLE_PREFIX}{phase.solid.name}"
        return f"{of}{PHASE}{self._numbers[phase]}"


class ObjectSimulation(Simulation):
    """A simulation in which objects lie, hang and may touch as in windows of time.

    Args:
        cell: arms and obstacles without objects.
        windows: the objects over time, from the begin of the clock.
    """

    def __init__(self, cell: Cell, windows: Sequence[Window]) -> None:
        self._phases = Phases(cell, windows)
        model = self._phases.model()
        self._bodies = {name: int(model.body(name).id) for name in self._phases.names}
        rows = list(self._bodies.values())
        self._weights = {body: (float(model.body_mass[body]), model.body_inertia[body].copy()) for body in rows}
        self._geoms = {body: int(model.body_geomadr[body]) for body in rows}
        self._scratch, self._window, self._steps = mujoco.MjData(model), -1, 0
        super().__init__(cell, mujoco.MjData(model))
        self._bare: mujoco.MjModel | None = None
        self._enter(0)

    @property
    def scene_model(self) -> mujoco.MjModel:
        """The model of the cell without objects, for audits of clearances between arms and obstacles."""
        if self._bare is None:
            self._bare = compile_scene(self.cell, moving_setpoints=True)
        return self._bare

    def place(self, q: Float[np.ndarray, "n"]) -> None:
        """As in `Simulation`. The objects are where they are at the begin."""
        self._steps = 0
        self._enter(0)
        super().place(q)

    def follow(
        self,
        reference: Float[np.ndarray, "t n"],
        velocity: Float[np.ndarray, "t n"],
        end: Float[np.ndarray, "n"] | None = None,
    ) -> Float[np.ndarray, "t n"]:
        """As in `Simulation`; the objects change hands between two steps."""
        out, first = [], 0
        while first < len(reference):
            until = min(first + self._steps_left(), len(reference))
            out.append(super().follow(reference[first:until], velocity[first:until], end))
            self._steps += until - first
            first = until
            if self._steps_left() <= 0:
                self._enter(self._window + 1)
        return np.concatenate(out) if out else np.empty_like(reference)

    def _steps_left(self) -> int:
        """Returns the number of steps until the next window; many in the last one."""
        windows = self._phases.windows
        if self._window + 1 == len(windows):
            return 1 << 60
        return int(np.ceil(windows[self._window].end_s / self.timestep_s - 1e-6)) - self._steps

    def _enter(self, window: int) -> None:
        """Lets the bodies of a window be there, and no others."""
        windows = self._phases.windows
        while window + 1 < len(windows) and windows[window].end_s / self.timestep_s - 1e-6 <= self._steps:
            window += 1
        self._window = window
        active = {self._bodies[name] for name in self._phases.active[window]}
        for body, geom in self._geoms.items():
            there = body in active
            self.model.geom_contype[geom] = self.model.geom_conaffinity[geom] = int(there)
            self.model.geom_rgba[geom, 3] = float(there)
            mass, inertia = self._weights[body]
            self.model.body_mass[body], self.model.body_inertia[body] = mass * there, inertia * there
        mujoco.mj_setConst(self.model, self._scratch)
