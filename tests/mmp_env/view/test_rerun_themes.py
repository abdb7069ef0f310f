"""Recordings in the viewer's dark and light theme, and the timeline that each tab names."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import two_arms
from support.recordings import Rows, blueprint_values
from support.straight_plans import elsewhere, everyone, straight

from mmp_env import events, find_cell
from mmp_env.view.rerun import RerunWatcher
from mmp_planners import make

PROBLEM = two_arms.passing(1.0)
BACKGROUNDS = ((13, 13, 13), (255, 255, 255))
"""Backgrounds of rerun 0.41: Gray.100 and Gray.1000 of its colour table."""
GRAPHICS, LABELS = 3.0, 4.2
"""Least contrast of lines and of labels. A colour has at most 4.4 on both black and white."""
TABS = {"search": "expansion", "repulsion": "repulsion", "plan": "plan time"}


@pytest.fixture(scope="module")
def search(tmp_path_factory) -> Path:
    """Returns a recording of a search that repels, and of its plan."""
    path = tmp_path_factory.mktemp("rerun") / "search.rrd"
    with RerunWatcher(PROBLEM, path) as watcher:
        watcher.show_plan(make("apf-ecbs").plan(PROBLEM, seed=0, watch=watcher).plan)
    return path


def luminance(color):
    """Returns the relative luminance as WCAG 2 defines it."""
    shares = np.array(color) / 255
    return float(
        np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4) @ (0.2126, 0.7152, 0.0722)
    )


def least_contrast(rgba):
    """Returns the smaller contrast ratio on the two backgrounds."""
    lights = [luminance(color) for color in (tuple(int(rgba).to_bytes(4, "big")[:3]), *BACKGROUNDS)]
    ratios = [(max(lights[0], other) + 0.05) / (min(lights[0], other) + 0.05) for other in lights[1:]]
    return min(ratios)


def test_every_colour_of_a_node_can_be_read_in_both_themes(tmp_path):
    path = tmp_path / "tree.rrd"
    with RerunWatcher(PROBLEM, path) as watcher:
        for node, conflicts in enumerate((200, 90, 40, 12, 4, 2, 1, 0, 0)):
            watcher(created(node, conflicts))
            if node:
                watcher(events.NodeExpanded(elapsed_s=0.0, node=node - 1, open_nodes=1, expanded_nodes=1, conflicts=1))
        watcher(events.SolutionFound(elapsed_s=0.0, node=7, cost_rad=1.0, clearance_m=0.01))
    rows = Rows(path).at("/tree", "GraphNodes:colors", "expansion")
    colors = {color for row in rows.values() for color in row}
    assert len(colors) > 10
    assert {hex(color): least_contrast(color) for color in colors if least_contrast(color) < LABELS} == {}


def test_the_tree_stands_on_the_theme_s_own_background_where_edges_are_in_the_theme_s_ink(search):
    names = blueprint_values(search).keys()
    assert "Background:color" in names, "the 3D views have a background"
    assert "GraphBackground:color" not in names


def test_curves_and_bars_of_all_arms_can_be_seen_in_both_themes(search, tmp_path):
    cell = find_cell("ring-8")
    plan = straight(cell, everyone(cell, "tucked"), elsewhere(cell))
    with RerunWatcher(plan.problem, tmp_path / "plan.rrd") as watcher:
        watcher.show_plan(plan)
    for rows in (Rows(search), Rows(tmp_path / "plan.rrd")):
        found = {
            (entity, color)
            for component in ("SeriesLines:colors", "StateConfiguration:colors")
            for entity, colors in rows.statics(component).items()
            for color in colors
        }
        assert len(found) > 8
        assert {(entity, hex(color)) for entity, color in found if least_contrast(color) < GRAPHICS} == set()


def test_each_tab_says_which_timeline_to_choose(search):
    rows = Rows(search)
    for tab, own in TABS.items():
        for chosen in TABS.values():
            ((text,),) = rows.at(f"/timeline_hint/{tab}", "TextDocument:text", chosen).values()
            assert f"`{own}`" in text
            assert ("Choose" in text) == (own != chosen)
    origins = blueprint_values(search)["ViewBlueprint:space_origin"]
    assert {f"/timeline_hint/{tab}" for tab in TABS} <= set(origins)


def test_a_recording_with_one_tab_has_nothing_to_choose(tmp_path):
    with RerunWatcher(PROBLEM, tmp_path / "tree.rrd") as watcher:
        watcher(created(0, 1))
    assert not [entity for entity in Rows(tmp_path / "tree.rrd").entities if "hint" in entity]


def created(node, conflicts):
    paths = {arm: np.array([q, PROBLEM.goal[arm]]) for arm, q in PROBLEM.start.items()}
    first = events.NodeCreated(
        elapsed_s=0.0,
        node=0,
        parent=None,
        arm=None,
        constraint=None,
        paths=paths,
        cost_rad=1.0,
        lower_bound_rad=1.0,
        conflicts=conflicts,
        conflicting_pairs=1,
    )
    if node == 0:
        return first
    return replace(first, node=node, parent=node - 1, arm="left", constraint="left avoids right", fast_track=node == 8)
