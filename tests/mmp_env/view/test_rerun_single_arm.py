"""The tree of the single-arm search in a recording, against the core and the rules of a space-time tree."""

import numpy as np
import pytest
from support import two_arms
from support.recordings import Rows, array

from mmp_env import MmpError, UnknownNameError
from mmp_env.view.rerun import record_single_arm
from mmp_env.view.rerun.single_arm import edges
from mmp_planners import make

PROBLEM = two_arms.passing(1.0)
PLAN = make("auto").plan(PROBLEM, seed=0).plan
MODEL = PROBLEM.cell.collision
DT_S = 0.1


@pytest.fixture(scope="module")
def search(tmp_path_factory):
    path = tmp_path_factory.mktemp("rerun") / "tree.rrd"
    return record_single_arm(PLAN, "left", path, seed=1, iterations=60), Rows(path)


def test_the_tree_begins_at_the_start_and_nothing_arrives_before_its_parent(search):
    grown, _ = search
    assert len(grown.q) > 10
    np.testing.assert_allclose(grown.q[0], PROBLEM.start["left"], atol=1e-6)
    assert (grown.arrivals[0], grown.parents[0]) == (0, -1)
    later = np.arange(1, len(grown.q))
    assert (grown.parents[later] >= 0).all()
    assert MODEL.is_free("left", grown.q).all()
    assert (
        grown.arrivals[later] >= grown.arrivals[grown.parents[later]]
    ).mean() > 0.9  # descendants learn of earlier arrivals late


def test_edges_take_no_less_than_the_time_at_full_speed(search):
    grown, _ = search
    for vertex in range(1, len(grown.q)):
        moved = np.abs(grown.q[vertex] - grown.q[grown.parents[vertex]])
        steps = np.ceil((moved / (PROBLEM.max_velocity["left"] * DT_S)).max() - 1e-4)
        assert grown.arrivals[vertex] >= steps


def test_every_vertex_is_shown_when_it_is_reached(search):
    grown, rows = search
    strips, shown = edges(PROBLEM, "left", grown), 0
    np.testing.assert_allclose(strips[:, -1], MODEL.tool_points("left", grown.q), atol=1e-9)
    for step in np.unique(grown.arrivals).tolist():
        (moment,) = rows.at(f"/single_arm/tree/points/{step}", "Points3D:positions", "plan time").items()
        assert moment[0] == pytest.approx(step * DT_S)
        np.testing.assert_allclose(array(moment[1]), strips[grown.arrivals == step, -1], atol=1e-6)
        lines = rows.at(f"/single_arm/tree/edges/{step}", "LineStrips3D:strips", "plan time")
        shown += len(lines[moment[0]])
    assert shown == len(grown.q)


def test_the_path_keeps_clear_of_the_other_arm_as_it_moves(search):
    grown, rows = search
    assert grown.path is not None
    np.testing.assert_allclose(grown.path[[0, -1]], [PROBLEM.start["left"], PROBLEM.goal["left"]], atol=1e-6)
    clouds = {
        arm: rows.at(f"/single_arm/spheres/{arm}", "Points3D:positions", "plan time") for arm in ("left", "right")
    }
    colors = rows.at("/single_arm/spheres/left", "Points3D:colors", "plan time")
    assert not any(0xEB0028FF in row for row in colors.values())
    expected = MODEL.spheres("left", grown.path)[0]
    times = sorted(clouds["left"])[: len(grown.path)]
    np.testing.assert_allclose(array([clouds["left"][time] for time in times]), expected, atol=1e-5)
    assert sorted(clouds["right"]) == sorted(clouds["left"])


def test_the_same_seed_gives_the_same_tree(search, tmp_path):
    again = record_single_arm(PLAN, "left", tmp_path / "again.rrd", seed=1, iterations=60)
    np.testing.assert_array_equal(again.q, search[0].q)
    np.testing.assert_array_equal(again.parents, search[0].parents)


def test_an_unknown_arm_is_refused(tmp_path):
    with pytest.raises(UnknownNameError, match="left"):
        record_single_arm(PLAN, "lift", tmp_path / "tree.rrd")


@pytest.mark.parametrize("dt_s", [0.0, -0.1, np.inf, np.nan])
def test_an_impossible_time_step_is_refused(dt_s, tmp_path):
    with pytest.raises(MmpError, match="dt_s is"):
        record_single_arm(PLAN, "left", tmp_path / "tree.rrd", dt_s=dt_s)
    assert not list(tmp_path.iterdir())
