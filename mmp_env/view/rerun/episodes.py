"""Data of `RerunRecorder`: it collects rows and sends them in blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.model.margins import NO_MARGINS
from mmp_env.sim.contacts import Contact
from mmp_env.sim.execution import SHOWN_STEPS, ExecutionReport
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.blueprint import view_3d
from mmp_env.view.rerun.colors import CONTACT, curve_colors
from mmp_env.view.rerun.geoms import CELL, STAGE, CellGeoms, joined
from mmp_env.view.rerun.sdk import entity_part, require
from mmp_env.view.rerun.sphere_clouds import log_radii, send_centers

ROOT = "/episodes"
SPHERES, ACTIONS, CONTACTS = f"{ROOT}/spheres", f"{ROOT}/actions", f"{ROOT}/contacts"
SCALARS = {"reward": (0, 114, 178), "return": (0, 158, 115), "distance": (213, 94, 0), "episode": (130, 130, 130)}
"""Colours of the curves: reward of a step, return of the episode, largest joint distance from the goal [rad]."""
_BLOCK = 200


class EpisodeLog:
    """Steps of an environment, one row each. A reset is a row without an action, and may bring other objects."""

    def __init__(self, stream: Any, env: Any) -> None:
        rerun = require()
        self._stream, self._env = stream, env
        self._rows: list[dict[str, Any]] = []
        self._steps, self._episode, self._return = 0, -1, 0.0
        self._enter()
        for name, color in SCALARS.items():
            stream.log(f"{ROOT}/{name}", rerun.SeriesLines(names=[name], colors=[color]), static=True)
        for arm, color in curve_colors(env.cell).items():
            dof = env.cell.arm(arm).dof
            names = [f"{arm}/joint{k + 1}" for k in range(dof)]
            stream.log(
                f"{ACTIONS}/{entity_part(arm)}", rerun.SeriesLines(names=names, colors=[color] * dof), static=True
            )

    def begin(self, info: dict[str, Any]) -> None:
        """Adds a reset of the environment."""
        if self._env.cell is not self._cell:
            self._send()
            self._enter()
        self._episode, self._return = self._episode + 1, 0.0
        self._note(None, 0.0, info)

    def add(self, action: Float[np.ndarray, "n"], reward: float, info: dict[str, Any]) -> None:
        """Adds a step."""
        self._return += reward
        self._note(action, reward, info)

    def play(self, report: ExecutionReport) -> None:
        """Adds the execution of a plan as further steps: positions and contacts."""
        self._send()
        frames = np.unique([*range(0, len(report.times), SHOWN_STEPS), len(report.times) - 1])
        index = [timelines.sequence(timelines.STEP, range(self._steps, self._steps + len(frames)))]
        q = {arm: report.positions[arm][frames] for arm in self._cell.arm_names}
        self._geoms.send_poses(index, joined(self._cell, q))
        send_centers(self._stream, SPHERES, index, self._cell, q, NO_MARGINS)
        at = np.searchsorted(report.times[frames], [contact.time_s for contact in report.contacts])
        steps = self._steps + np.minimum(at, len(frames) - 1)
        self._send_contacts(list(zip(steps.tolist(), report.contacts, strict=True)))
        self._steps += len(frames)

    def end(self) -> Any:
        """Sends the remaining rows and returns the blueprint."""
        self._send()
        rrb = require().blueprint
        views = rrb.Horizontal(
            view_3d(self._geoms.model, [STAGE, CELL], "The cell"),
            view_3d(self._geoms.model, [STAGE, SPHERES], "Spheres"),
        )
        below = rrb.Horizontal(
            rrb.TimeSeriesView(origin=ROOT, contents=["$origin/reward", "$origin/return"], name="Reward, return"),
            rrb.TimeSeriesView(origin=ROOT, contents=["$origin/distance"], name="Distance from the goal [rad]"),
            rrb.TimeSeriesView(origin=ACTIONS, name="Actions", plot_legend=rrb.PlotLegend(visible=False)),
            rrb.TextLogView(origin=CONTACTS, name="Contacts", columns=rrb.TextLogColumns(text_log_columns=["Body"])),
        )
        panel = rrb.TimePanel(timeline=timelines.STEP, state="collapsed", fps=10.0, play_state="playing")
        return rrb.Blueprint(rrb.Vertical(views, below, row_shares=[3, 2]), panel, collapse_panels=True)

    def _enter(self) -> None:
        """Logs the environment's current cell, with the objects of its task, from this step on."""
        env, stream = self._env, self._stream
        self._cell: Cell = env.cell
        stream.set_time(timelines.STEP, sequence=self._steps)
        if self._steps:
            for path in (STAGE, CELL, SPHERES):
                stream.log(path, require().Clear(recursive=True))
        self._geoms = CellGeoms(stream, env.cell, env.model, static=False)
        log_radii(stream, SPHERES, env.cell, static=False)
        stream.reset_time()

    def _note(self, action: Float[np.ndarray, "n"] | None, reward: float, info: dict[str, Any]) -> None:
        data = self._env.data
        self._rows.append(
            {
                "step": self._steps,
                "q": data.qpos.copy(),
                "positions": data.xpos.copy(),
                "quaternions": data.xquat.copy(),
                "action": action,
                "scalars": (reward, self._return, info["distance_rad"], float(self._episode)),
                "contacts": info["contacts"],
            }
        )
        self._steps += 1
        if len(self._rows) >= _BLOCK:
            self._send()

    def _send(self) -> None:
        rows, self._rows = self._rows, []
        if not rows:
            return
        rerun = require()
        index = [timelines.sequence(timelines.STEP, [row["step"] for row in rows])]
        self._geoms.send_bodies(index, *(np.array([row[key] for row in rows]) for key in ("positions", "quaternions")))
        ends = np.cumsum([arm.dof for arm in self._cell.arms])[:-1]
        parts = np.split(np.array([row["q"] for row in rows]), ends, axis=1)
        q = dict(zip(self._cell.arm_names, parts, strict=True))
        send_centers(self._stream, SPHERES, index, self._cell, q, NO_MARGINS)
        for name, column in zip(SCALARS, zip(*(row["scalars"] for row in rows), strict=True), strict=True):
            self._stream.send_columns(f"{ROOT}/{name}", index, rerun.Scalars.columns(scalars=column))
        self._send_actions([row for row in rows if row["action"] is not None], ends)
        self._send_contacts([(row["step"], contact) for row in rows for contact in row["contacts"]])

    def _send_actions(self, rows: list[dict[str, Any]], ends: np.ndarray) -> None:
        if not rows:
            return
        rerun = require()
        index = [timelines.sequence(timelines.STEP, [row["step"] for row in rows])]
        parts = np.split(np.array([row["action"] for row in rows]), ends, axis=1)
        for arm, part in zip(self._cell.arm_names, parts, strict=True):
            columns = rerun.Scalars.columns(scalars=part.ravel()).partition([part.shape[1]] * len(part))
            self._stream.send_columns(f"{ACTIONS}/{entity_part(arm)}", index, columns)

    def _send_contacts(self, contacts: Sequence[tuple[int, Contact]]) -> None:
        """Sends a line of text for each contact, at its step."""
        if not contacts:
            return
        rerun = require()
        index = [timelines.sequence(timelines.STEP, [step for step, _ in contacts])]
        words = [f"{c.body_a} and {c.body_b}, {1e3 * c.depth_m:.1f} mm deep" for _, c in contacts]
        columns = rerun.TextLog.columns(text=words, level=["WARN"] * len(contacts), color=[CONTACT] * len(contacts))
        self._stream.send_columns(CONTACTS, index, columns)
