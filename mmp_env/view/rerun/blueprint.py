"""Layout of a recording in the viewer: a tab each for the search, the repulsion and the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.model.cell import Cell
from mmp_env.sim.scene_appearance import CAMERA
from mmp_env.view.rerun import (
    candidates,
    expansions,
    geoms,
    joints,
    motion_states,
    plan_view,
    repulsion_view,
    timelines,
    tree_graph,
)
from mmp_env.view.rerun.colors import BACKGROUND
from mmp_env.view.rerun.sdk import entity_part, require

SEARCH, REPULSION, PLAN = "Search", "Repulsion", "Plan"
"""Names of the tabs."""
_REPLAY_S = 12.0
"""Duration [s] of the replay of a search."""
_RERUN_FIELD_OF_VIEW, _NEARER, _LOWER = np.radians(55.0), 0.85, 0.1
_SLOWEST, _FASTEST = 2.0, 30.0
"""Bounds of the expansions per second."""


@dataclass(frozen=True, kw_only=True)
class Contents:
    """Contents of a recording: the number of expansions and nodes, and whether it has repulsions and a plan."""

    expansions: int
    nodes: int
    repulsions: bool
    plan: bool

    @property
    def tabs(self) -> dict[str, str]:
        """Returns tab name -> its timeline."""
        every = {
            SEARCH: (self.nodes > 0, timelines.EXPANSION),
            REPULSION: (self.repulsions, timelines.REPULSION),
            PLAN: (self.plan, timelines.PLAN_TIME),
        }
        return {name: timeline for name, (is_there, timeline) in every.items() if is_there}

    @property
    def search_first(self) -> bool:
        """Whether the viewer opens the search first."""
        return self.expansions > 0 or not self.plan

    @property
    def kind(self) -> str:
        """Returns the tabs in words, in opening order; recordings with the same tabs can share a layout."""
        there = [name.lower() for name in self.tabs] or ["start"]
        return " ".join(there if self.search_first else there[::-1])


def of_search(cell: Cell, model: Any, contents: Contents) -> Any:
    """Returns the blueprint of a search, a plan, or both.

    If the planner reported nothing and found nothing, the recording shows the start alone.
    """
    rrb = require().blueprint
    tabs = []
    if contents.nodes:
        tabs.append(_tab(SEARCH, _search_tab(model), contents))
    if contents.repulsions:
        tabs.append(_tab(REPULSION, _repulsion_tab(model), contents))
    if contents.plan:
        tabs.append(_tab(PLAN, _plan_tab(cell, model), contents))
    if not tabs:
        tabs.append(
            view_3d(
                model,
                [geoms.STAGE, geoms.CELL, candidates.CANDIDATES],
                "The start: the planner reported no search and no plan",
            )
        )
    timeline = timelines.EXPANSION if contents.search_first else timelines.PLAN_TIME
    rate = (contents.expansions + 2) / _REPLAY_S
    panel = rrb.TimePanel(
        timeline=timeline,
        state="collapsed",
        fps=float(np.clip(rate, _SLOWEST, _FASTEST)),
        play_state="playing",
        loop_mode="off" if contents.search_first else "all",
    )
    active = 0 if contents.search_first else len(tabs) - 1
    return rrb.Blueprint(rrb.Tabs(*tabs, active_tab=active), panel, collapse_panels=True)


def of_single_arm(arm: str, model: Any, root: str) -> Any:
    """Returns the blueprint of the search of one arm."""
    rrb = require().blueprint
    views = view_3d(model, [geoms.STAGE, root], f"Tool positions of {arm} in the search tree: bright early, dark late")
    panel = rrb.TimePanel(timeline=timelines.PLAN_TIME, state="collapsed", play_state="playing", loop_mode="all")
    return rrb.Blueprint(views, panel, collapse_panels=True)


def view_3d(model: Any, contents: Sequence[str], name: str) -> Any:
    """Returns a view of the cell from its camera, with a light background."""
    rrb = require().blueprint
    eye, target = eye_of(model)
    return rrb.Spatial3DView(
        origin="/",
        contents=[f"+ {path}/**" for path in contents],
        name=name,
        background=rrb.Background(color=BACKGROUND),
        line_grid=False,
        eye_controls=rrb.EyeControls3D(kind="orbital", position=eye, look_target=target, eye_up=[0, 0, 1]),
    )


def eye_of(model: Any) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Returns the position of the cell's camera and its target [m], closer because rerun has a wider field of view."""
    camera = model.camera(CAMERA)
    lower = np.array([0.0, 0.0, _LOWER * model.stat.extent])
    eye, target = np.array(camera.pos) - lower, np.array(model.stat.center) - lower
    wider = np.tan(np.radians(float(camera.fovy[0])) / 2) / np.tan(_RERUN_FIELD_OF_VIEW / 2)
    return target + _NEARER * wider * (eye - target), target


def _tab(name: str, content: Any, contents: Contents) -> Any:
    """Returns a tab; if there are several, a line above says which timeline it follows."""
    rrb = require().blueprint
    if len(contents.tabs) == 1:
        return rrb.Vertical(content, name=name)
    hint = rrb.TextDocumentView(origin=timelines.hint_path(name), name=f"Timeline of the tab {name}", titlebar=False)
    return rrb.Vertical(hint, content, row_shares=[1, 15], name=name)


def _search_tab(model: Any) -> Any:
    rrb = require().blueprint
    still = {"enabled": False}
    graph = rrb.GraphView(
        origin=tree_graph.TREE,
        name="Conflict tree: a node and its conflicts, the branch below it",
        force_link=rrb.archetypes.ForceLink(**still),
        force_many_body=rrb.archetypes.ForceManyBody(**still),
        force_position=rrb.archetypes.ForcePosition(**still),
        force_collision_radius=rrb.archetypes.ForceCollisionRadius(**still),
        force_center=rrb.archetypes.ForceCenter(**still),
    )
    progress = rrb.Tabs(
        rrb.TextDocumentView(origin=expansions.WORDS, name="The node"),
        rrb.TimeSeriesView(
            origin=expansions.SEARCH, contents=["$origin/cost", "$origin/lower_bound"], name="Cost and bound [rad]"
        ),
        rrb.TimeSeriesView(
            origin=expansions.SEARCH, contents=["$origin/conflicts", "$origin/open_nodes"], name="Conflicts, open nodes"
        ),
    )
    views = view_3d(
        model,
        [geoms.STAGE, expansions.PATHS, expansions.CONFLICTS, expansions.SPHERES],
        "The node: tool paths, conflicts, the arms in the one it is branched on",
    )
    right = rrb.Vertical(views, progress, row_shares=[3, 2])
    return rrb.Horizontal(graph, right, column_shares=[5, 4])


def _repulsion_tab(model: Any) -> Any:
    rrb = require().blueprint
    views = view_3d(model, [geoms.STAGE, repulsion_view.REPULSION], "Spheres, forces and tool paths")
    right = rrb.Vertical(
        rrb.TextDocumentView(origin=repulsion_view.WORDS, name="The iteration"),
        rrb.TimeSeriesView(origin=repulsion_view.CLEARANCE, name="Clearance of the path [m] over the iterations"),
    )
    return rrb.Horizontal(views, right, column_shares=[2, 1])


def _plan_tab(cell: Cell, model: Any) -> Any:
    rrb = require().blueprint
    views = rrb.Horizontal(
        view_3d(
            model,
            [geoms.STAGE, geoms.CELL, plan_view.PATHS, candidates.CANDIDATES],
            "The cell along the plan; ghosts: goals",
        ),
        view_3d(model, [geoms.STAGE, plan_view.SPHERES], "Spheres"),
    )
    per_arm = [
        rrb.Horizontal(
            rrb.TimeSeriesView(
                origin=f"{joints.JOINTS}/{entity_part(arm)}/{joints.POSITION}",
                name=f"{arm}: position / limit",
                plot_legend=rrb.PlotLegend(visible=False),
            ),
            rrb.TimeSeriesView(
                origin=f"{joints.JOINTS}/{entity_part(arm)}/{joints.VELOCITY}", name=f"{arm}: velocity / limit"
            ),
            name=arm,
        )
        for arm in cell.arm_names
    ]
    below = rrb.Horizontal(
        rrb.TimeSeriesView(
            origin=plan_view.CLEARANCE,
            name="Clearance from the other arms [m]; red: the margin",
            plot_legend=rrb.PlotLegend(visible=False),
        ),
        rrb.StateTimelineView(origin=motion_states.MOTION_STATES, name="Moving and waiting"),
        rrb.Tabs(*per_arm, name="Joints"),
        column_shares=[3, 3, 4],
    )
    return rrb.Vertical(views, below, row_shares=[3, 2])
