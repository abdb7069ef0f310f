"""Lower bounds of makespans: no tool is faster, no schedule shorter, and they count waits, orders and arms."""

from __future__ import annotations

import numpy as np
import pytest

from mmp_env.work.lower_bound import makespan_lower_bound, tool_speed
from tests.support.small_jobs import jobs, planned_schedule, with_lines


def test_no_tool_moves_faster_than_the_bound():
    cell, rng, step_s = jobs().cell, np.random.default_rng(0), 1e-6
    arm = cell.arms[0]
    speed = np.full(arm.dof, 0.8)
    q = rng.uniform(arm.robot.lower, arm.robot.upper, (500, arm.dof))
    moved = q + step_s * speed * rng.choice([-1.0, 1.0], q.shape)
    points = [cell.collision.tool_points(arm.name, rows) for rows in (q, moved)]
    measured = np.linalg.norm(points[1] - points[0], axis=1) / step_s
    assert 0.5 * tool_speed(arm, speed) < measured.max() < tool_speed(arm, speed)


@pytest.mark.parametrize("lines", [False, True])
def test_no_schedule_is_shorter(lines):
    schedule = planned_schedule(lines)
    assert 0.0 < schedule.lower_bound_s <= schedule.makespan_s


def test_it_counts_waits_by_arm_by_order_and_shared_equally():
    def bound(*waiting):
        data = [{"name": str(k), "steps": [{"wait": seconds}], **more} for k, (seconds, more) in enumerate(waiting)]
        work = jobs(with_lines(jobs=data))
        return makespan_lower_bound(work, {arm.name: np.full(arm.dof, 0.8) for arm in work.cell.arms})

    assert bound((3.0, {})) == 3.0
    assert bound((3.0, {}), (2.0, {"after": ["0"]})) == 5.0
    assert bound((3.0, {"arm": "arm0"}), (2.0, {"arm": "arm0"}), (1.0, {"arm": "arm1"})) == 5.0
    assert bound(*[(1.0, {})] * 12) == 3.0
