"""The report of an execution: torques, distances of bodies, and phases."""

from dataclasses import replace

import numpy as np
import pytest
from support.straight_plans import FACING, LEVEL, elsewhere, everyone, straight

from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.rings import ring_cell
from mmp_env.retime import retime
from mmp_env.sim.execution import execute_plan
from mmp_env.sim.simulation import Simulation

pytestmark = pytest.mark.filterwarnings("ignore::mmp_env.errors.UnretimedPlanWarning")


def test_the_report_has_the_largest_torque_of_each_arm_with_its_rating():
    env = MultiArmCellEnv(cell=ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    report = env.execute(straight(env.cell, start, goal))
    assert tuple(report.loads) == env.cell.arm_names
    for name, load in report.loads.items():
        assert load.rated_nm == env.cell.arm(name).robot.effort[load.joint - 1]
        assert load.share == load.torque_nm / load.rated_nm > 0
    standing = env.execute(straight(env.cell, goal, goal))
    # Torques include gravity: a UR5e at rest holds its shoulder up, and a start at full speed needs much more torque.
    assert 5 < standing.loads["arm0"].torque_nm < 150
    assert report.loads["arm0"].share > 3 > 1 > standing.loads["arm0"].share


def test_the_report_of_placed_joints_tells_no_torque():
    env = MultiArmCellEnv(cell=ring_cell(2))
    report = env.execute(straight(env.cell, everyone(env.cell, "tucked"), elsewhere(env.cell)))
    assert "torque at most" in str(report)
    idle = {name: replace(load, torque_nm=0.0) for name, load in report.loads.items()}
    assert "torque" not in str(replace(report, loads=idle))


def test_a_retimed_plan_stays_within_the_rated_torques():
    env = MultiArmCellEnv(cell=ring_cell(2))
    start, goal = everyone(env.cell, "tucked"), elsewhere(env.cell)
    report = env.execute(retime(straight(env.cell, start, goal)))
    assert report.reached
    assert report.max_tracking_error_rad < 1e-3
    assert max(load.share for load in report.loads.values()) < 0.7


def test_bodies_that_keep_the_proved_clearance_are_not_reported():
    env = MultiArmCellEnv(cell=ring_cell(2))
    report = env.execute(straight(env.cell, everyone(env.cell, "tucked"), elsewhere(env.cell)))
    assert report.nearness.planned_m > 0
    assert report.nearness.closer_m == 0
    assert report.nearness.time_s is None


def test_bodies_closer_than_proved_are_reported_with_the_difference():
    """A force pushes the resting arm towards a wall beside it."""
    gap = 0.004
    arm = place_arm("arm", "ur5e", [0, 0, 0], [1, 0, 0, 0])
    start = {"arm": LEVEL}

    def cell(y):
        wall = Obstacle(
            name="wall",
            shape="box",
            position=np.array([0, y, 0.5]),
            quaternion=np.eye(4)[0],
            size=np.array([4, 0.1, 2]),
        )
        return Cell(name="wall", arms=(arm,), obstacles=(wall,), spheres="fine")

    free = float(cell(-1.0).collision.clearance({"arm": start["arm"][None]})[0])
    here = cell(free - gap - 1.0)
    simulation = Simulation(here)
    simulation.place(start["arm"])
    plan = straight(here, start, start, speed=0.1)

    def push():
        simulation.data.qfrc_applied[0] = 4000.0

    report = execute_plan(simulation, plan, push)
    lean = report.nearness
    assert 0 < lean.planned_m <= gap
    assert lean.closer_m > 0
    assert (lean.body_a.partition("/")[0], lean.body_b) == ("arm", "obstacle/wall")
    assert 0 < lean.time_s <= report.duration_s


def test_a_plan_without_a_proof_has_no_planned_clearance():
    env = MultiArmCellEnv(cell=ring_cell(2))
    ahead = {arm.name: LEVEL + FACING for arm in env.cell.arms}
    report = env.execute(straight(env.cell, everyone(env.cell, "tucked"), ahead))
    assert report.contacts
    assert report.nearness.planned_m is None


def test_phases_are_the_times_of_the_plan():
    env = MultiArmCellEnv(cell=ring_cell(2))
    plan = straight(env.cell, everyone(env.cell, "tucked"), elsewhere(env.cell))
    report = env.execute(plan)
    np.testing.assert_allclose(report.phases, np.minimum(report.times, plan.makespan_s))
