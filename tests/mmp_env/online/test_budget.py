"""A call of `replan` looks at the clock between short steps, and goes on in the next call where the last one ended."""

import gc

import numpy as np
from support.two_arms import facing_cell, reaching

from mmp_env import OnlinePlanner, make_problem
from mmp_env.model.arm import Obstacle
from mmp_env.model.plan import Plan
from mmp_env.online.bodies import MovingBody
from mmp_env.online.budget import Budget, NoCollection
from mmp_env.online.deadlines import Deadlines
from mmp_env.online.motion import OnlineMotion
from mmp_env.online.planning import PathPlanner, Wanted
from mmp_env.retime import RetimeOptions
from mmp_env.retime.retiming import retime_unproved
from mmp_env.retime.steps import finished

START = {"left": reaching(1.2), "right": reaching(1.2)}
GOAL = {"left": reaching(0.4), "right": reaching(0.4)}
ENOUGH_S = 100.0


class Looks(Budget):
    """A budget that has plenty of time for a number of looks at the clock, and then none."""

    def __init__(self, count):
        super().__init__(ENOUGH_S)
        self.count = count

    @property
    def left_s(self):
        self.count -= 1
        return ENOUGH_S if self.count >= 0 else 0.0


def problem():
    return make_problem(facing_cell(), START, GOAL)


def path_planner():
    margins = problem().margins
    return PathPlanner("auto", 0, problem().max_velocity, margins, RetimeOptions(rate=50.0))


def line_plan(max_velocity=0.8):
    rows = {name: np.stack([START[name], GOAL[name]]) for name in START}
    asked = make_problem(facing_cell(), START, GOAL, max_velocity=max_velocity)
    return Plan(problem=asked, times=np.array([0.0, 1.0]), positions=rows)


def test_a_path_is_timed_over_several_calls_as_in_one():
    wanted, cell = Wanted(goal=GOAL), facing_cell()
    whole, _ = path_planner().motion(cell, START, wanted, (), Budget(ENOUGH_S))
    paths, reasons = path_planner(), []
    for _ in range(100):
        motion, reason = paths.motion(cell, START, wanted, (), Looks(6))
        reasons.append(reason)
        if motion is not None:
            break
    assert len(reasons) > 3
    assert set(reasons[:-1]) == {"no time to retime the plan"}
    for name, q in whole.plan.positions.items():
        np.testing.assert_array_equal(motion.plan.positions[name], q)


def test_work_for_other_goals_or_from_another_start_is_left():
    cell, paths = facing_cell(), path_planner()
    assert paths.motion(cell, START, Wanted(goal=GOAL), (), Looks(6))[0] is None
    other = Wanted(goal={**GOAL, "left": reaching(1.0)})
    motion, _ = paths.motion(cell, START, other, (), Budget(ENOUGH_S))
    np.testing.assert_array_equal(motion.plan.positions["left"][-1], reaching(1.0))


def test_a_motion_that_was_kept_is_given_back_for_its_goals_alone():
    cell, paths, wanted = facing_cell(), path_planner(), Wanted(goal=GOAL)
    motion, _ = paths.motion(cell, START, wanted, (), Budget(ENOUGH_S))
    paths.keep(motion)
    assert paths.motion(cell, START, wanted, (), Looks(0))[0] is motion
    paths.keep(motion)
    assert paths.motion(cell, START, Wanted(goal=dict(GOAL)), (), Looks(0)) == (None, "no time to plan")


def test_no_step_of_retiming_does_most_of_the_work():
    steps = retime_unproved(line_plan(), RetimeOptions(rate=50.0))
    assert sum(1 for _ in iter(lambda: next(steps, True), True)) > 10


def test_what_is_not_looked_at_in_time_counts_as_danger():
    motion = OnlineMotion(finished(retime_unproved(line_plan(max_velocity=0.4), RetimeOptions(rate=50.0))), GOAL)
    far = Obstacle(
        name="far",
        shape="sphere",
        position=np.array([50.0, 0.0, 0.0]),
        quaternion=np.array([1.0, 0.0, 0.0, 0.0]),
        radius=0.1,
    )
    guard = Deadlines(motion, {"far": MovingBody(solid=far, speed=0.1, seen_s=0.0)}, 0.002)
    timing = motion.timing_from(0, None)
    assert len(timing.phases) > 128
    assert guard.first_danger(timing, Looks(0)) == 128
    assert guard.first_danger(timing, Looks(100)) is None


def test_no_garbage_is_collected_within_a_call(monkeypatch):
    online, enabled = OnlinePlanner(facing_cell(), START), []
    for name in ("_go_on", "_step"):
        method = getattr(OnlinePlanner, name)
        watched = lambda *args, method=method: enabled.append(gc.isenabled()) or method(*args)  # noqa: E731
        monkeypatch.setattr(OnlinePlanner, name, watched)
    online.replan(GOAL, within=0.1)
    assert enabled == [False, False]
    assert gc.isenabled()


def test_a_collector_that_is_off_stays_off():
    gc.disable()
    try:
        with NoCollection():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
