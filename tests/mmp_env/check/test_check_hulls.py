"""Plans of cells with exact geometry are checked by hulls of the checker's own."""

from dataclasses import replace

import numpy as np
import pytest

from mmp_env import check_plan, draw_instance, find_cell, make_problem, ring_cell
from mmp_env.check.fields import UnreadableError
from mmp_env.check.model import CellModel
from mmp_env.check.models import CheckedModel
from mmp_env.check.reading import read_cell
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_to_dict
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_planners import make


@pytest.fixture(scope="module")
def plan():
    cell = ring_cell(2, "panda", "exact")
    return make("rrt-connect").plan(make_problem(cell, *draw_instance(cell, seed=1)), seed=1, time_limit=60.0).plan


def test_a_plan_between_hulls_is_proved(plan):
    report = check_plan(plan)
    assert report.valid, report
    assert report.spheres == "exact"
    assert report.proved_m["arms"] >= plan.problem.margins.arms


def test_an_exact_check_is_of_the_hulls_too_because_they_are_what_collides_in_mujoco(plan):
    by_margins, by_geoms = (check_plan(plan, exact=exact) for exact in (False, True))
    assert by_geoms.valid, by_geoms
    assert by_geoms.found_clearance_m == pytest.approx(by_margins.found_clearance_m, abs=1e-5)
    assert by_geoms.where == by_margins.where


def test_a_plan_file_keeps_the_exact_geometry(plan):
    again = plan_from_dict(plan_to_dict(plan), "plan")
    assert again.problem.cell.spheres == "exact"
    assert check_plan(again).valid


def test_hulls_that_overlap_are_found(plan):
    document = plan_to_dict(plan)
    document["problem"]["cell"]["arms"][1]["position"] = (
        np.array(document["problem"]["cell"]["arms"][0]["position"]) + np.array([0.0, 0.3, 0.0])
    ).tolist()
    report = check_plan(document)
    assert not report.valid
    assert "arm-arm" in {violation.rule for violation in report.violations}


def test_the_checker_and_the_core_measure_the_same_clearance(plan):
    """At the instants of the plan the two differ by rounding only."""
    report = check_plan(plan)
    cell = plan.problem.cell
    rows = {arm: np.asarray(plan.positions[arm]) for arm in cell.arm_names}
    least = cell.collision.pair_clearance(*sum(((a, rows[a]) for a in cell.arm_names), ()), precise=True).min()
    least = min(least, *(cell.collision.static_clearance(a, rows[a], precise=True).min() for a in cell.arm_names))
    assert report.found_clearance_m <= least + 1e-6
    assert report.found_clearance_m >= report.min_clearance_m


def test_the_geoms_of_the_checker_are_the_hulls():
    cell = ring_cell(2, "panda", "exact")
    model = CellModel(read_cell(cell_to_dict(cell)), hulls=True)
    collides = (model.mujoco.geom_contype | model.mujoco.geom_conaffinity) != 0
    names = [model.mujoco.geom(k).name for k in np.flatnonzero(collides)]
    robots = [name for name in names if not name.startswith("obstacle/")]
    assert robots
    assert all(name.startswith("hull/arm") for name in robots)


def test_a_robot_without_hulls_cannot_be_exact():
    cell = ring_cell(2, "panda")
    bare = replace(
        cell.arms[0].robot, hulls=(), spheres={k: v for k, v in cell.arms[0].robot.spheres.items() if k != "exact"}
    )
    with pytest.raises(MmpError, match="robot 'panda' of arm 'arm0' has no hulls"):
        replace(cell, arms=(replace(cell.arms[0], robot=bare),), spheres="exact")
    assert find_cell("ring-2-panda").spheres == "28"


@pytest.mark.parametrize("piece", [([[1e308, 0, 0]], 0.1), ([[0, 0, -100.1]], 0.1), ([[0, 0, 0]], 101.0)])
def test_hulls_beyond_the_horizon_are_refused(piece):
    vertices, radius = piece
    hulls = {"link": [{"vertices": vertices, "radius": radius}]}
    model = CheckedModel(name="odd", data={"links": ["link"]}, spheres={}, hulls=hulls, mjcf="")
    with pytest.raises(UnreadableError, match="has a number beyond 100 m"):
        model.link_hulls()
