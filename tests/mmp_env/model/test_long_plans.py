"""Plans of an enormous duration: every use is refused with a sentence before it allocates memory."""

import contextlib

import numpy as np
import pytest
from support import tiny_plans

from mmp_env.errors import MmpError
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.model.plan_fit import LONGEST_EXECUTION_S
from mmp_env.opengl import offscreen_backend
from mmp_env.retime import retime
from mmp_env.sim.execution import execute_plan
from mmp_env.sim.simulation import Simulation
from mmp_env.view.films import frame_times, save_film

LONG = [7.6e6, 1e10, 1e300, 8e307]


def lasting(makespan_s, **problem):
    data = tiny_plans.two_apart()
    data["times"] = np.linspace(0.0, makespan_s, len(data["times"])).tolist()
    data["problem"] |= problem
    return plan_from_dict(data)


@pytest.fixture(scope="module")
def simulation():
    return Simulation(lasting(1.0).problem.cell)


@pytest.mark.parametrize("makespan_s", [LONGEST_EXECUTION_S * 1.001, *LONG])
def test_a_long_plan_is_not_executed(simulation, makespan_s):
    with pytest.raises(MmpError, match=r"the plan takes .* s; a plan that is executed takes 1200 s at most"):
        execute_plan(simulation, lasting(makespan_s))


@pytest.mark.parametrize("makespan_s", LONG)
def test_a_long_film_is_refused_before_any_frame(makespan_s, tmp_path):
    with contextlib.suppress(MmpError):
        offscreen_backend()
        with pytest.raises(MmpError, match=r"the film would take .* s; at 10 frames a second it can take 9000 s"):
            save_film(lasting(makespan_s), tmp_path / "film.gif")
    with pytest.raises(MmpError, match="the film would take"):
        frame_times(makespan_s, 25.0)
    assert list(tmp_path.iterdir()) == []


def test_a_film_of_the_longest_execution_has_all_its_frames():
    assert len(frame_times(LONGEST_EXECUTION_S, 60.0)) == LONGEST_EXECUTION_S * 60 + 1


@pytest.mark.parametrize("makespan_s", LONG)
def test_limits_that_make_a_motion_too_long_are_refused(makespan_s, recwarn):
    said = "its limits are too low for its length and rate" if makespan_s < 1e9 else "max_velocity .* must be 1e-09"
    with pytest.raises(MmpError, match=said):
        retime(lasting(makespan_s, max_velocity=1 / makespan_s))
    assert not recwarn.list


@pytest.mark.parametrize("makespan_s", LONG[1:])
def test_a_recording_is_no_longer_than_its_timeline(makespan_s, tmp_path):
    pytest.importorskip("rerun")
    from mmp_env.view.rerun import RerunWatcher
    from mmp_env.view.rerun.single_arm import record_single_arm

    plan = lasting(makespan_s)
    watcher = RerunWatcher(plan.problem, tmp_path / "plan.rrd")
    with pytest.raises(MmpError, match=r"the plan takes .* s; a recording holds 1e\+09 s at most"):
        watcher.show_plan(plan)
    with pytest.raises(MmpError, match="more than 100000 steps of"):
        record_single_arm(plan, "left", tmp_path / "arm.rrd")
    assert list(tmp_path.iterdir()) == []
