"""Strips of the states of an arm: moving, waiting, arrived."""

import numpy as np
import pytest
from support import two_arms
from support.recordings import Rows

from mmp_env.model.plan import Plan
from mmp_env.view.rerun import RerunWatcher
from mmp_env.view.rerun.joints import position_shares, velocity_shares
from mmp_env.view.rerun.motion_states import ARRIVED, MOVING, WAITING, state_changes

PROBLEM = two_arms.nothing_to_do()
LOOK = two_arms.reaching(0.8)


def plan_of(moves, times=None):
    """Returns a plan in which the left arm's first joint moves by `moves` [rad] from one second to the next."""
    path = LOOK + np.outer([0, *np.cumsum(moves)], np.eye(6)[0])
    times = np.arange(len(path), dtype=float) if times is None else np.array(times)
    return Plan(problem=PROBLEM, times=times, positions={"left": path, "right": np.tile(LOOK, (len(path), 1))})


@pytest.mark.parametrize(
    ("moves", "expected"),
    [
        ([0.1, 0.1], [(0.0, MOVING), (2.0, ARRIVED)]),
        ([0.0, 0.1, 0.0, 0.0], [(0.0, WAITING), (1.0, MOVING), (2.0, ARRIVED), (4.0, ARRIVED)]),
        ([0.1, 0.0, -0.1], [(0.0, MOVING), (1.0, WAITING), (2.0, MOVING), (3.0, ARRIVED)]),
        ([0.0], [(0.0, ARRIVED), (1.0, ARRIVED)]),
        ([], [(0.0, ARRIVED)]),
    ],
)
def test_states_begin_at_changes_of_motion(moves, expected):
    assert state_changes(plan_of(moves), "left") == expected


def test_the_strips_of_a_recording_show_the_states(tmp_path):
    plan = plan_of([0.1, 0.0, 0.1])
    with RerunWatcher(PROBLEM, tmp_path / "plan.rrd") as watcher:
        watcher.show_plan(plan)
    found = Rows(tmp_path / "plan.rrd").at("/moving/left", "StateChange:state", "plan time")
    assert {time: state[0] for time, state in found.items()} == dict(state_changes(plan, "left"))


def test_velocities_are_those_of_the_segments_in_shares_of_the_limit():
    times, shares = velocity_shares(plan_of([0.4, -0.8]), "left")
    assert times.tolist() == [0.0, 1.0, 1.0, 2.0]
    np.testing.assert_allclose(shares[:, 0], [0.5, 0.5, -1.0, -1.0])
    assert not shares[:, 1:].any()
    assert velocity_shares(plan_of([]), "left")[1].tolist() == [[0.0] * 6]


def test_positions_are_minus_one_and_one_at_the_limits():
    robot = PROBLEM.cell.arm("left").robot
    ends = np.array([robot.lower, (robot.lower + robot.upper) / 2, robot.upper])
    np.testing.assert_allclose(
        position_shares(robot.lower, robot.upper, ends), np.outer([-1, 0, 1], np.ones(6)), atol=1e-12
    )
