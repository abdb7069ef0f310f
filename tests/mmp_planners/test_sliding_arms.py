"""Two arms on rails that face each other: every planner, the checker, retiming, execution and export."""

import numpy as np
import pytest
from support.rail_arms import small_rail_mjcf

from mmp_env import check_plan, make_problem
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.export.motion import motion_of
from mmp_env.files.cell_file import cell_from_dict
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.importing.robot_folder import ImportOptions, add_robot
from mmp_env.retime import retime
from mmp_env.sim.execution import execute_plan
from mmp_env.sim.simulation import Simulation
from mmp_planners import make, names
from mmp_tasks.inverse_kinematics import DIRECTION_TOLERANCE_RAD, POSITION_TOLERANCE_M, kinematics


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Returns a folder with the robot `rail`."""
    folder = tmp_path_factory.mktemp("rails")
    (folder / "rail.xml").write_text(small_rail_mjcf())
    add_robot(folder / "rail.xml", folder, ImportOptions(name="rail"), cache=None, progress=lambda line: None)
    return folder


def rails(folder, spheres="28"):
    """Returns a cell of two arms whose rails are 0.7 m apart. Outstretched arms overlap if they pass."""
    sides = {"left": (-0.35, 0.0), "right": (0.35, np.pi)}
    arms = [{"name": n, "robot": "./rail", "position": [x, 0, 0], "yaw": yaw} for n, (x, yaw) in sides.items()]
    return cell_from_dict({"name": "rails", "arms": arms, "spheres": spheres}, str(folder / "cell.json"))


def passing(folder, spheres="28"):
    """Returns a problem in which both arms travel their rails, past each other."""
    start, goal = np.array([-0.4, 0.0, 0.0]), np.array([0.4, 0.0, 0.3])
    return make_problem(rails(folder, spheres), {"left": start, "right": start}, {"left": goal, "right": goal})


@pytest.mark.parametrize("name", names())
def test_every_planner_takes_arms_on_rails_past_each_other(folder, name):
    start, goal = (
        {"left": [-0.4, 0.0, 0.0], "right": [-0.2, 0.3, 0.0]},
        {"left": [0.4, 0.0, 0.3], "right": [0.1, 0.3, 0.3]},
    )
    problem = make_problem(rails(folder), start, goal)
    result = make(name).plan(problem, seed=1, time_limit=60.0)
    report = check_plan(result.plan)
    assert report.valid, report
    assert result.plan.cost_rad >= problem.cost_lower_bound_rad - 1e-9


@pytest.fixture(scope="module", params=["28", "exact"])
def plan(folder, request):
    """Returns a plan of `auto`."""
    return make("auto", rounds=2).plan(passing(folder, request.param), seed=1, time_limit=60.0).plan


def test_a_metre_of_a_slide_counts_as_a_radian(folder):
    assert passing(folder).cost_lower_bound_rad == pytest.approx(2 * (0.8 + 0.3))


def test_a_retimed_plan_is_executed_to_its_goal(plan):
    smooth = retime(plan)
    assert check_plan(smooth).valid
    simulation = Simulation(smooth.problem.cell)
    report = execute_plan(simulation, smooth)
    assert report.reached
    assert not report.contacts
    assert report.max_tracking_error_rad < 0.005
    assert f"tracking error at most {report.max_tracking_error_rad:.4f} rad or m," in str(report)
    assert motion_of([smooth], "{arm}/{joint}").joined("positions").shape == (len(smooth.times), 6)


def test_the_checker_finds_the_contact_of_arms_that_slide_through_each_other(plan):
    document = plan_to_dict(plan)
    problem = plan.problem
    straight = {name: [problem.start[name].tolist(), problem.goal[name].tolist()] for name in problem.start}
    report = check_plan(document | {"positions": straight, "times": [0.0, 4.0]})
    assert {"arm-arm"} <= {violation.rule for violation in report.violations}


def test_the_checker_names_a_slide_beyond_its_limits_in_metres(plan):
    document = plan_to_dict(plan)
    positions = {name: np.array(rows) for name, rows in document["positions"].items()}
    positions["left"][len(positions["left"]) // 2, 0] = 0.7
    report = check_plan(document | {"positions": positions})
    (found,) = [violation for violation in report.violations if violation.rule == "limits"]
    assert "arm 'left', joint 1, is at 0.7 m; allowed: -0.5 to 0.5" in found.message
    assert report.min_clearance_m is None


def test_a_start_beyond_the_rail_is_refused_in_metres(folder):
    stays = {name: np.zeros(3) for name in ("left", "right")}
    with pytest.raises(InvalidInstanceError, match=r"joint 1 \(rail\), is 0.6000 m; allowed: -0.5000 to 0.5000"):
        make_problem(rails(folder), stays | {"left": np.array([0.6, 0, 0])}, stays)


def test_inverse_kinematics_slides_along_the_rail(folder):
    robot = rails(folder).arms[0].robot
    solver = kinematics(robot, None)
    rng, solved = np.random.default_rng(0), 0
    for q in rng.uniform(robot.lower * 0.8, robot.upper * 0.8, (8, robot.dof)):
        pose = solver.tool_pose(q)
        for guess in solver.initial_guesses(pose[:3, 3], pose[:3, 2])[:5]:
            found = solver.solve(guess, pose[:3, 3], pose[:3, 2])
            if found is not None:
                reached = solver.tool_pose(found)
                assert np.linalg.norm(reached[:3, 3] - pose[:3, 3]) < 2 * POSITION_TOLERANCE_M
                assert reached[:3, 2] @ pose[:3, 2] > np.cos(2 * DIRECTION_TOLERANCE_RAD)
                solved += 1
                break
    assert solved >= 6


def test_export_says_by_how_many_metres_a_slide_jumps(folder, plan):
    with pytest.raises(MmpError, match=r"arm 'left' begins 0\.8 m from where it ended"):
        motion_of([plan, plan], "{arm}/{joint}")
