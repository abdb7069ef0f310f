"""The tasks of the demonstrations: the contract of all, and the rules of each."""

import builtins
import dataclasses

import numpy as np
import pytest

import mmp_planners
import mmp_tasks
from mmp_env import check_plan, draw_instance, draw_problem, find_cell, place_arm
from mmp_env.check.episode import check_episode
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import cell_to_dict
from mmp_env.files.episode_file import Episode, episode_to_dict
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell
from mmp_env.model.held import covering_spheres
from mmp_env.model.lines import line_cell
from mmp_env.problems.making import make_problem
from mmp_env.sim.episode_execution import execute_episode
from mmp_tasks.grasping import OBJECT_M, tip
from mmp_tasks.inverse_kinematics import kinematics
from mmp_tasks.sequence import stages
from mmp_tasks.table import Table

CARRYING = ("place", "packing")
FURNISHING = ("pick", *CARRYING)
ALL = ("crossing", "parallel", *FURNISHING)
CELLS = ("mixed-4", "ring-2", "ring-4-panda")


def state_of(problem, which):
    return {name: q.tolist() for name, q in getattr(problem, which).items()}


def tool_points(problem, which):
    state = getattr(problem, which)
    return {name: problem.cell.collision.tool_points(name, [q])[0] for name, q in state.items()}


@pytest.mark.parametrize("task", ALL)
@pytest.mark.parametrize("cell", CELLS)
def test_a_drawn_instance_is_a_valid_problem(task, cell):
    problem = draw_problem(find_cell(cell), task, 1)
    assert problem.margin == 0.002  # the whole margin remains
    assert problem.cell.arm_names == find_cell(cell).arm_names


@pytest.mark.parametrize(("task", "cell"), [("pick", "ring-8"), ("packing", "ring-6")])
def test_big_rings_have_room_too(task, cell):
    assert draw_problem(find_cell(cell), task, 0).margin == 0.002


@pytest.mark.parametrize("task", ["crossing", "parallel", "pick", "place"])
@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_tasks_work_in_lines_whose_arms_do_not_reach_the_middle(task, robot):
    problem = draw_problem(line_cell(16, robot), task, 2)
    assert problem.margin == 0.002


def test_an_arm_of_a_line_works_towards_its_neighbours():
    cell = line_cell(16)
    table = Table(cell)
    for k, arm in enumerate(cell.arms):
        forward = table.forward(arm)
        assert forward @ arm.T_world_base[:2, 0] > (0.9 if 4 <= k < 12 else 0.4)


def test_packing_says_which_arm_does_not_reach_the_box_and_what_stands_there():
    assert draw_problem(line_cell(8), "packing", 1).margin == 0.002
    for cell, said in (
        (line_cell(16), r"one box in the middle .* 2\.16 m from arm 'arm0' .* beyond its reach .* such as a ring"),
        (find_cell("shelf-8-panda"), "where obstacle 'board0' stands; it needs a cell"),
    ):
        with pytest.raises(MmpError, match=said):
            draw_problem(cell, "packing", 0)


@pytest.mark.parametrize("task", ALL)
def test_a_seed_gives_the_same_instance_again_and_another_seed_another(task):
    one, again, other = (draw_problem(find_cell("mixed-4"), task, seed) for seed in (3, 3, 4))
    assert cell_to_dict(one.cell) == cell_to_dict(again.cell)
    for which in ("start", "goal"):
        assert state_of(one, which) == state_of(again, which)
    assert state_of(one, "goal") != state_of(other, "goal")


@pytest.mark.parametrize("task", ALL)
def test_every_task_is_registered_and_a_nonsense_option_is_named(task):
    assert {"clearance", "static_clearance", "tries", "draws"} == set(mmp_tasks.describe(task).options)
    with pytest.raises(MmpError, match=f"clearance of task '{task}' is -1"):
        mmp_tasks.make(task, clearance=-1)
    with pytest.raises(MmpError, match=f"draws of task '{task}' is 0"):
        mmp_tasks.make(task, draws=0)


@pytest.mark.parametrize("task", [name for name in ALL if name != "packing"])
def test_a_cell_without_an_instance_is_an_error_that_names_task_cell_and_arm(task):
    filled = Obstacle(
        name="block",
        shape="box",
        position=np.array([0, 0, 0.35]),
        quaternion=np.array([1.0, 0, 0, 0]),
        size=np.array([0.7, 0.7, 0.7]),
    )
    ring = find_cell("ring-4")
    cell = Cell(name="filled", arms=ring.arms, obstacles=(*ring.obstacles, filled))
    with pytest.raises(
        MmpError, match=rf"task '{task}' found no instance for cell 'filled' in 2 draws: .* arm 'arm\d'"
    ):
        mmp_tasks.make(task, draws=2).sample(cell, np.random.default_rng(0))


@pytest.mark.parametrize("task", ALL)
def test_an_arm_alone_has_every_task_too(task):
    alone = Cell(name="alone", arms=(place_arm("arm", "piper", [0.3, 0.1, 0.7], [1, 0, 0, 0]),))
    problem = draw_problem(alone, task, 0)
    assert problem.start["arm"].tolist() != problem.goal["arm"].tolist()


def test_without_mink_a_sentence_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def without(name, *args, **kwargs):
        if name == "mink":
            raise ImportError("No module named 'mink'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    kinematics.cache_clear()
    with pytest.raises(MmpError, match=r"finds configurations with mink.*pip install 'mink"):
        draw_problem(find_cell("ring-2"), "crossing", 0)


def test_start_and_goal_alone_are_refused_if_the_task_changes_the_cell():
    with pytest.raises(MmpError, match="'pick' puts objects into cell 'ring-2'; draw_problem"):
        draw_instance(find_cell("ring-2"), "pick", 0)
    assert len(draw_instance(find_cell("ring-2"), "crossing", 0)) == 2


@pytest.mark.parametrize("cell", ["mixed-4", "ring-6"])
def test_crossing_swaps_the_tool_points_of_two_arms_or_moves_one_across(cell):
    problem = draw_problem(find_cell(cell), "crossing", 0)
    start, goal = tool_points(problem, "start"), tool_points(problem, "goal")
    swapped = 0
    for name, end in goal.items():
        before = min(start, key=lambda other: np.linalg.norm(start[other] - end))
        if np.linalg.norm(start[before] - end) < 0.002:
            assert before != name
            np.testing.assert_allclose(goal[before], start[name], atol=0.002)
            swapped += 1
        assert np.linalg.norm(start[name] - end) >= 0.23
    assert swapped >= 2


@pytest.mark.parametrize("cell", ["mixed-4", "ring-4"])
def test_parallel_displaces_all_tool_points_alike(cell):
    problem = draw_problem(find_cell(cell), "parallel", 2)
    start, goal = tool_points(problem, "start"), tool_points(problem, "goal")
    moves = np.array([goal[name] - start[name] for name in start])
    np.testing.assert_allclose(moves, np.tile(moves[0], (len(moves), 1)), atol=0.002)
    assert 0.14 < np.linalg.norm(moves[0]) < 0.27


@pytest.mark.parametrize("cell", ["mixed-4", "ring-4-panda"])
def test_pick_goes_from_tucked_to_5_cm_above_an_object_each(cell):
    problem = draw_problem(find_cell(cell), "pick", 0)
    objects = {obstacle.name: obstacle for obstacle in problem.cell.obstacles}
    for arm in problem.cell.arms:
        assert problem.start[arm.name].tolist() == arm.robot.tucked.tolist()
        lying = objects[f"object-{arm.name}"]
        T = arm.T_world_base @ kinematics(arm.robot, arm.tool).tool_pose(problem.goal[arm.name])
        end = T[:3, 3] + tip(arm) * T[:3, 2]
        np.testing.assert_allclose(end, lying.position + np.array([0, 0, OBJECT_M[2] / 2 + 0.05]), atol=0.002)
        assert T[2, 2] == pytest.approx(-1, abs=1e-4)


def held_middles(problem, which):
    """Returns the position of each held object in the world [m]."""
    out = {}
    for arm in problem.cell.arms:
        T = arm.T_world_base @ kinematics(arm.robot, arm.tool).tool_pose(getattr(problem, which)[arm.name])
        out[arm.name] = T[:3, :3] @ arm.held.position + T[:3, 3]
    return out


def test_place_ends_over_a_tray_each():
    problem = draw_problem(find_cell("mixed-4"), "place", 0)
    obstacles = {obstacle.name: obstacle for obstacle in problem.cell.obstacles}
    for name, middle in held_middles(problem, "goal").items():
        tray = obstacles[f"tray-{name}"]
        np.testing.assert_allclose(middle[:2], tray.position[:2], atol=0.003)
        assert middle[2] - OBJECT_M[2] / 2 > 0.02 + 0.03


@pytest.mark.parametrize("cell", ["mixed-4", "ring-8"])
def test_packing_ends_with_every_object_between_the_walls_of_one_box(cell):
    problem = draw_problem(find_cell(cell), "packing", 0)
    walls = [o for o in problem.cell.obstacles if o.name.startswith("box-") and o.name != "box-bottom"]
    inner = np.array([abs(wall.position[:2]).max() for wall in walls]).min() - 0.005
    for arm in problem.cell.arms:
        middle = held_middles(problem, "goal")[arm.name]
        assert (np.abs(middle[:2]) < inner).all()
        assert 0.01 < middle[2] - OBJECT_M[2] / 2 < 0.05
        assert len(covering_spheres(arm.held)[1]) == 12


@pytest.mark.parametrize("task", FURNISHING)
def test_arms_that_hold_something_already_are_refused(task):
    cell = draw_problem(find_cell("ring-2"), "place", 0).cell
    with pytest.raises(MmpError, match=r"holds 'object-arm\d'; this task begins with empty tools"):
        mmp_tasks.make(task).sample(cell, np.random.default_rng(0))


@pytest.mark.parametrize("task", FURNISHING)
def test_a_panda_beside_the_mixed_arms_takes_part(task):
    mixed = find_cell("mixed-4")
    panda = place_arm("panda", "panda", [0.55, 0.6, 0.0], [0.4536, 0, 0, -0.8912])
    problem = draw_problem(dataclasses.replace(mixed, arms=(*mixed.arms, panda)), task, 0)
    assert problem.goal["panda"].shape == (7,)


@pytest.mark.parametrize("task", CARRYING)
def test_pick_deliver_and_home_are_one_valid_episode_that_touches_nothing(task):
    drawn = stages(find_cell("mixed-4"), np.random.default_rng(0), task)
    assert [stage.name for stage in drawn] == ["pick", task, "home"]
    planner, plans = mmp_planners.make("auto"), []
    for stage in drawn:
        start = {name: rows[-1] for name, rows in plans[-1].positions.items()} if plans else stage.start
        plans.append(planner.plan(make_problem(stage.cell, start, stage.goal), seed=0, time_limit=60).plan)
        assert check_plan(plans[-1]).valid
    episode = Episode(name=task, plans=tuple(plans))
    assert check_episode(episode_to_dict(episode)).valid
    execution = execute_episode(episode)
    assert execution.reached
    assert execution.contacts == 0


def test_a_task_that_delivers_nothing_makes_no_sequence():
    with pytest.raises(MmpError, match="'reach' delivers nothing"):
        stages(find_cell("ring-2"), np.random.default_rng(0), "reach")
