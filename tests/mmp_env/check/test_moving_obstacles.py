"""Obstacles with a speed: the certificate and the checker keep the margin wherever they may be."""

from dataclasses import replace

import numpy as np
import pytest
from support.two_arms import facing_cell, reaching

from mmp_env import check_plan, core, load_cell, make_problem
from mmp_env.errors import MmpError
from mmp_env.files.plan_check import plan_to_check
from mmp_env.model.arm import Obstacle
from mmp_env.model.certificate import certify
from mmp_env.model.plan import Plan

TIMES = np.linspace(0.0, 2.0, 21)


def ball(distance, speed):
    """Returns a ball beside the left arm's base, at a height that its hand does not reach in these plans."""
    return Obstacle(
        name="ball",
        shape="sphere",
        position=np.array([-0.7, -0.6 - distance, 0.4]),
        quaternion=np.array([1.0, 0, 0, 0]),
        radius=0.1,
        speed=speed,
    )


def turning_plan(obstacle, *, moves=True):
    """Returns a plan in which the left arm turns a little, or stands, and the right arm turns."""
    cell = facing_cell()
    start = {"left": reaching(0.5), "right": reaching(-0.5)}
    pans = np.linspace(0.0, 0.3, len(TIMES))
    rows = {name: np.repeat(q[None], len(TIMES), axis=0) for name, q in start.items()}
    for name in ("left", "right") if moves else ("right",):
        rows[name][:, 0] += pans
    goal = {name: q[-1] for name, q in rows.items()}
    problem = make_problem(cell, start, goal)
    return Plan(problem=replace(problem, cell=replace(cell, obstacles=(obstacle,))), times=TIMES, positions=rows)


def room_of(plan):
    """Returns the least clearance [m] of the left arm from the ball where it was seen, by dense samples."""
    rows = np.column_stack([np.interp(np.linspace(0, 2, 2001), TIMES, column) for column in plan.positions["left"].T])
    centers, radii = plan.problem.cell.collision.spheres("left", rows)
    keep = ~plan.problem.cell.collision.is_base("left")
    at = plan.problem.cell.obstacles[0].position
    return float((np.linalg.norm(centers[:, keep] - at, axis=2) - radii[keep] - 0.1).min())


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_speed_decides(share):
    room = room_of(turning_plan(ball(0.6, 0.0)))
    assert room > 0.1
    plan = turning_plan(ball(0.6, share * (room - 0.002) / TIMES[-1]))
    assert certify(plan, core.Clock(10.0)).valid == (share < 1)
    report = check_plan(plan)
    assert report.valid == (share < 1)
    if share > 1:
        assert [violation.rule for violation in report.violations] == ["arm-obstacle"]
        assert "left/" in str(report.violations[0])
    else:
        least = report.proved_m["obstacles"]
        assert least is not None
        assert 0.002 <= least <= 0.002 + 0.1 * room + 1e-6


def test_an_arm_that_stands_may_be_met_by_an_obstacle_that_moves():
    plan = turning_plan(ball(0.6, 5.0), moves=False)
    far = replace(plan.problem.cell.obstacles[0], position=np.array([-20.0, 0.0, 0.4]))
    plan = replace(plan, problem=replace(plan.problem, cell=replace(plan.problem.cell, obstacles=(far,))))
    assert certify(plan, core.Clock(10.0)).valid
    assert check_plan(plan).valid


def test_the_speed_is_in_files_and_refused_by_planners_and_for_meshes(tmp_path):
    cell = replace(facing_cell(), obstacles=(ball(0.6, 0.3),))
    document = plan_to_check(turning_plan(ball(0.6, 0.3)))
    assert document["problem"]["cell"]["obstacles"][0]["speed"] == 0.3
    with pytest.raises(MmpError, match="obstacle 'ball' moves; OnlinePlanner plans among obstacles that move"):
        make_problem(cell, {"left": "home", "right": "home"}, {"left": "home", "right": "home"})
    with pytest.raises(MmpError, match="obstacle 'ball' is a mesh"):
        replace(cell, obstacles=(replace(cell.obstacles[0], shape="mesh", radius=None, pieces=(np.eye(4)[:, :3],)),))
    file = tmp_path / "cell.yaml"
    file.write_text(
        "arms: [{name: a, robot: ur5e, position: [0, 0, 0]}]\n"
        "obstacles: [{name: b, shape: sphere, radius: 0.1, position: [1, 1, 1], speed: -1}]\n"
    )
    with pytest.raises(MmpError, match="speed"):
        load_cell(file)


@pytest.mark.parametrize("speed", [-0.1, float("nan"), "fast", [1.0]])
def test_the_checker_refuses_a_wrong_speed(speed):
    document = plan_to_check(turning_plan(ball(0.6, 0.3)))
    document["problem"]["cell"]["obstacles"][0]["speed"] = speed
    report = check_plan(document)
    assert not report.valid
    assert "speed" in str(report.violations[0])
