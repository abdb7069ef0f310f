"""How configurations are found: ways to a place, arms that go together, and arms that give way."""

import os
import subprocess
import sys

import numpy as np
import pytest

from mmp_env import find_cell
from mmp_env.errors import MmpError
from mmp_tasks.drawing import DrawFailed
from mmp_tasks.ik_candidates import ToolTarget, Ways
from mmp_tasks.inverse_kinematics import NEAR_M, NEAR_RAD, kinematics
from mmp_tasks.room import Room
from mmp_tasks.stances import Posing, home
from mmp_tasks.table import Sector, Table

DOWN = np.array([0.0, 0.0, -1.0])


class Quick(Posing):
    called = "quick"


def room_of(cell, clearance=0.01):
    return Room(cell=cell, clearance=clearance, static_clearance=0.0025)


def between_the_bases(cell, height, share=0.5):
    first, second = (cell.arms[k].position for k in (0, 1))
    return ToolTarget(point=first + share * (second - first) + np.array([0.0, 0.0, height]))


@pytest.mark.parametrize("cell", ["ring-2", "ring-2-panda", "ring-2-fr5", "ring-2-piper"])
def test_solutions_have_the_tool_point_at_the_target_and_the_tool_pointing_down(cell):
    arm = find_cell(cell).arms[0]
    solver, point = kinematics(arm.robot, arm.tool), np.array([0.3, 0.05, 0.2])
    solved = [q for k in solver.beginnings(point, DOWN) if (q := solver.solved(k, point, DOWN)) is not None]
    assert len(solved) > 5
    for q in solved:
        T = solver.tool_pose(q)
        reached = T[:3, :3] @ (arm.tool.point if arm.tool else np.zeros(3)) + T[:3, 3]
        assert np.linalg.norm(reached - point) < NEAR_M + 1e-4
        assert np.arccos(np.clip(T[:3, 2] @ DOWN, -1, 1)) < NEAR_RAD + 1e-4


def test_what_is_out_of_reach_has_nowhere_to_begin():
    arm = find_cell("ring-2").arms[0]
    assert len(kinematics(arm.robot, arm.tool).beginnings(np.array([5.0, 0.0, 0.2]), DOWN)) == 0


def test_beginnings_are_near_the_target_and_face_it():
    arm = find_cell("ring-2").arms[0]
    solver, point = kinematics(arm.robot, arm.tool), np.array([-0.2, 0.4, 0.2])
    tools = np.array([solver.tool_pose(q)[:3, 3] for q in solver.beginnings(point, DOWN)])
    away = np.linalg.norm(tools - point, axis=1)
    assert 5 < len(away) <= 60
    assert away.max() < 0.2
    np.testing.assert_allclose(np.arctan2(tools[:, 1], tools[:, 0]), np.arctan2(0.4, -0.2), atol=1e-6)


def test_a_way_through_a_standing_arm_is_none():
    cell = find_cell("ring-2")
    here, other = cell.arms
    place = between_the_bases(cell, 0.25)
    free = Ways(here, place, room_of(cell), {})
    assert free.find(here.robot.home, 12, np.random.default_rng(0))
    blocked = Ways(other, place, room_of(cell), {})
    assert blocked.find(other.robot.home, 12, np.random.default_rng(0))
    blocked.solve(0)
    standing = {other.name: blocked.q[0]}
    assert not Ways(here, place, room_of(cell, clearance=0.15), standing).find(
        here.robot.home, 12, np.random.default_rng(0)
    )


def test_a_solved_way_keeps_the_clearances_and_no_more_are_found_than_asked_for():
    cell = find_cell("ring-2")
    room, arm = room_of(cell), cell.arms[0]
    ways = Ways(arm, between_the_bases(cell, 0.25), room, {})
    assert ways.find(arm.robot.home, 5, np.random.default_rng(0))
    assert len(ways.q) <= 5
    for k in range(len(ways.q)):
        ways.solve(k)
        assert ways.solved[k] != ways.refused[k]
        if ways.solved[k]:
            assert room.has(arm.name, ways.q[k], {})
    assert ways.solved.any()


def test_arms_over_the_same_spot_go_together_or_it_is_a_miss():
    cell, task = find_cell("ring-4"), Quick()
    apart = {arm.name: ToolTarget(point=0.5 * arm.position + np.array([0.0, 0.0, 0.25])) for arm in cell.arms}
    found = task.stance(cell, apart, np.random.default_rng(0), home(cell))
    assert task.require(cell, found, "over its spot") is found
    one = {name: ToolTarget(point=np.array([0.0, 0.0, 0.25])) for name in cell.arm_names}
    with pytest.raises(DrawFailed, match=r"arm 'arm\d' \(ur5e\)"):
        task.stance(cell, one, np.random.default_rng(0), home(cell))


def test_an_arm_that_misses_has_a_neighbour_give_way_a_few_times():
    cell, turns = find_cell("ring-4"), []

    def attempt(arm, made):
        turns.append(arm.name)
        if arm.name == "arm1" and "arm0" in made:
            raise DrawFailed.at(arm)
        return len(turns)

    made = Quick().in_turn(cell, np.random.default_rng(0), attempt)
    assert tuple(made) == cell.arm_names
    assert made["arm1"] < made["arm0"]

    def hopeless(arm, made):
        if arm.name == "arm3":
            raise DrawFailed.at(arm, " at last")
        return 0

    with pytest.raises(DrawFailed, match=r"arm 'arm3' .* at last"):
        Quick().in_turn(cell, np.random.default_rng(0), hopeless)


def test_the_first_draw_that_is_no_miss_counts_and_the_error_names_the_hardest():
    cell, numbers = find_cell("ring-2"), []

    def third(number):
        numbers.append(number)
        if number < 2:
            raise DrawFailed.at(cell.arms[number % 2])
        return "drawn"

    assert Quick().first(cell, third) == "drawn"
    assert numbers == [0, 1, 2]

    def never(number):
        raise DrawFailed.at(cell.arms[number % 3 > 0])

    with pytest.raises(MmpError, match=r"task 'quick' found no instance for cell 'ring-2' in 7 draws: 4 .* arm 'arm1'"):
        Quick(draws=7).first(cell, never)


def test_spots_are_in_the_sector_and_keep_off_bases_obstacles_and_each_other():
    cell = find_cell("mixed-4")
    table, rng, taken, arm = Table(cell), np.random.default_rng(0), [], cell.arms[0]
    for _ in range(3):
        spot = table.spot(arm, rng, taken, 0.17, 0.06, Sector())
        assert 0.32 < np.linalg.norm(spot - arm.position[:2]) / arm.robot.reach < 0.61
        assert np.linalg.norm(table.bases - spot, axis=1).min() >= 0.17 - 1e-3
        assert all(np.linalg.norm(spot - other) >= 0.17 - 1e-3 for other in taken)
        taken.append(spot)
    with pytest.raises(DrawFailed, match="no free place on the table"):
        table.spot(arm, rng, taken, 5.0, 0.06, Sector())


def test_a_user_who_imports_a_task_pays_neither_for_mink_nor_for_mujoco():
    code = (
        "import sys, mmp_tasks; mmp_tasks.make('packing'); print([m for m in ('mink', 'mujoco') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_another_process_with_another_hash_seed_draws_the_same():
    code = (
        "from mmp_env import draw_problem, find_cell; p = draw_problem(find_cell('ring-6'), 'place', 3);"
        "print([q.tolist() for q in p.goal.values()], [o.position.tolist() for o in p.cell.obstacles])"
    )
    drawn = {
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(drawn) == 1
