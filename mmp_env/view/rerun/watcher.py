"""The watcher that records a search and its plan."""

from __future__ import annotations

from os import PathLike
from typing import Any

from mmp_env.events import Event
from mmp_env.model.plan import Plan
from mmp_env.model.plan_fit import check_fit
from mmp_env.model.problem import Problem
from mmp_env.view.rerun import timelines
from mmp_env.view.rerun.blueprint import Contents, of_search
from mmp_env.view.rerun.candidates import send_candidates
from mmp_env.view.rerun.expansions import send_expansions, send_progress
from mmp_env.view.rerun.geoms import CellGeoms, joined
from mmp_env.view.rerun.plan_view import send_plan
from mmp_env.view.rerun.repulsion_view import send_repulsions
from mmp_env.view.rerun.sdk import Recording, check, recording_target
from mmp_env.view.rerun.search_record import SearchRecord
from mmp_env.view.rerun.tree_graph import send_tree

MOST_NODES = 200
"""Number of expanded nodes whose paths, conflicts and spheres are recorded; the solution comes on top."""
MOST_REPULSIONS = 20
"""Number of repulsive modifications that are recorded step by step."""


class RerunWatcher:
    """Records a search for the rerun viewer; a watcher and a context manager.

    It keeps events while the planner runs, and writes the recording when the context ends, complete or not at all.

    Args:
        problem: the problem that is planned.
        to: a file `*.rrd`, or `spawn` to open the viewer.
        most_nodes: number of expanded nodes shown in detail; the tree and its curves are always complete.
        most_repulsions: number of repulsive modifications shown in detail.

    Raises:
        MmpError: if rerun is not installed, if `to` cannot be written, or if there is no display for the viewer.
    """

    wants_iterates = True
    """Request to planners to emit every iterate of a repulsive modification."""

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
        self._record = SearchRecord(problem=problem, most_nodes=most_nodes, most_repulsions=most_repulsions)
        self._plan: Plan | None = None
        self._closed = False

    def __call__(self, event: Event) -> None:
        self._record(event)

    def __enter__(self) -> RerunWatcher:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def show_plan(self, plan: Plan | None) -> None:
        """Adds a plan of the same cell to the recording, in place of an earlier one; None changes nothing.

        Raises `MmpError` for a plan that lacks an arm, is malformed, or is longer than `LONGEST_S`.
        """
        if plan is not None:
            plan.check_complete()
            check_fit(plan, plan.problem.cell)
            timelines.check_duration(plan.makespan_s)
        self._plan = plan if plan is not None else self._plan

    def close(self) -> None:
        """Writes the recording. Later calls do nothing."""
        if self._closed:
            return
        self._closed = True
        record, problem = self._record, self.problem
        contents = Contents(
            expansions=record.count,
            nodes=len(record.tree.nodes),
            repulsions=bool(record.repulsions),
            plan=self._plan is not None,
        )
        name = problem.name or problem.cell.name
        with recording_target(self._to) as to:
            recording = Recording(to, f"{contents.kind} of {problem.cell.name}", name)
            geoms = self._write(recording.stream)
            timelines.send_timeline_hints(recording.stream, contents.tabs)
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
        send_candidates(stream, problem if self._plan is None else self._plan.problem, geoms.model)
        if self._plan is not None:
            send_plan(stream, self._plan, geoms)
        return geoms
