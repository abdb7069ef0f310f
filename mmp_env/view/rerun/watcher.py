"""The watcher that makes a recording of a search and of the plan that came of it."""

from __future__ import annotations

from os import PathLike
from types import TracebackType
from typing import Any

from mmp_env.events import Event
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.blueprint import Contents, of_search
from mmp_env.view.rerun.expansions import send_expansions, send_progress
from mmp_env.view.rerun.geoms import CellGeoms, joined
from mmp_env.view.rerun.plan_view import send_plan
from mmp_env.view.rerun.record import Record
from mmp_env.view.rerun.repulsion_view import send_repulsions
from mmp_env.view.rerun.sdk import Recording, check, whole
from mmp_env.view.rerun.timeline_hints import send_timeline_hints
from mmp_env.view.rerun.tree import send_tree

MOST_NODES = 200
"""Expanded nodes whose paths, conflicts and spheres are recorded: the first ones, and the solution."""
MOST_REPULSIONS = 20
"""Repulsive modifications that are recorded step by step: the first ones."""


class RerunWatcher:
    """Records what a planner does with `problem`, for the rerun viewer; a context manager.

    `to` is a file `*.rrd`, or `spawn` to open the viewer. While the planner runs it only takes notes; the recording is
    written when the context ends, however it ends: all of it or nothing. `most_nodes` expanded nodes and
    `most_repulsions` are shown in detail, the tree and its curves as a whole. Raises `MmpError` where rerun is not
    installed, `to` cannot be written or there is no display for the viewer.
    """

    wants_iterates = True
    """Read by planners: they tell of every iterate of repulsion."""

    def __init__(
        self,
        problem: Problem,
        to: str | PathLike[str],
        *,
        most_nodes: int = MOST_NODES,
        most_repulsions: int = MOST_REPULSIONS,
    ) -> None:
        check(to)
        self.problem = problem
        self._to = to
        self._record = Record(problem=problem, most_looks=most_nodes, most_pushes=most_repulsions)
        self._plan: Plan | None = None
        self._closed = False

    def __call__(self, event: Event) -> None:
        self._record(event)

    def __enter__(self) -> RerunWatcher:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def show_plan(self, plan: Plan | None) -> None:
        """Records a plan of the same cell too, the last one given; nothing where it is None.

        Raises `MmpError` for a plan that lacks an arm, or is longer than `LONGEST_S`.
        """
        if plan is not None:
            plan.check_complete()
            timelines.check_duration(plan.makespan_s)
        self._plan = plan if plan is not None else self._plan

    def close(self) -> None:
        """Writes the recording, once; nothing more can be added to it."""
        if self._closed:
            return
        self._closed = True
        record, problem = self._record, self.problem
        contents = Contents(
            expansions=record.count,
            nodes=len(record.tree.nodes),
            repulsions=bool(record.pushes),
            plan=self._plan is not None,
        )
        name = problem.name or problem.cell.name
        with whole(self._to) as to:
            recording = Recording(to, f"{contents.kind} of {problem.cell.name}", name)
            geoms = self._write(recording.stream)
            send_timeline_hints(recording.stream, contents.tabs)
            recording.end(of_search(problem.cell, geoms.model, contents))

    def _write(self, stream: Any) -> CellGeoms:
        record, problem = self._record, self.problem
        geoms = CellGeoms(stream, problem.cell)
        start = joined(problem.cell, {name: q[None] for name, q in problem.start.items()})
        geoms.send_poses([timelines.sequence(timelines.EXPANSION, [0])], start)
        send_tree(stream, record)
        send_progress(stream, record)
        send_expansions(stream, record)
        send_repulsions(stream, record)
        if self._plan is not None:
            send_plan(stream, self._plan, geoms)
        return geoms
