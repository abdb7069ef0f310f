"""The search for configurations: candidates of one arm, compatible arms, and evicted neighbours."""

import os
import subprocess
import sys

import numpy as np
import pytest

from mmp_env import find_cell
from mmp_env.errors import MmpError
from mmp_tasks.configuration_search import ConfigurationSearch, home
from mmp_tasks.draw_options import DrawFailed, DrawOptions, draw_until_success
from mmp_tasks.ik_candidates import IkCandidates, ToolTarget
from mmp_tasks.inverse_kinematics import DIRECTION_TOLERANCE_RAD, POSITION_TOLERANCE_M, kinematics
from mmp_tasks.required_clearance import RequiredClearance
from mmp_tasks.table import Sector, Table

DOWN = np.array([0.0, 0.0, -1.0])


class Quick(DrawOptions):
    pass


def search_in(cell):
    return ConfigurationSearch(cell=cell, options=DrawOptions(), rng=np.random.default_rng(0))


def required_in(cell, clearance=0.01):
    return RequiredClearance(cell=cell, options=DrawOptions(clearance=clearance))


def between_the_bases(cell, height, share=0.5):
    first, second = (cell.arms[k].position for k in (0, 1))
    return ToolTarget(point=first + share * (second - first) + np.array([0.0, 0.0, height]))


@pytest.mark.parametrize("cell", ["ring-2", "ring-2-panda", "ring-2-fr5", "ring-2-piper"])
def test_solutions_have_the_tool_point_at_the_target_and_the_tool_pointing_down(cell):
    arm = find_cell(cell).arms[0]
    solver, point = kinematics(arm.robot, arm.tool), np.array([0.3, 0.05, 0.2])
    solved = [q for k in solver.initial_guesses(point, DOWN) if (q := solver.solve(k, point, DOWN)) is not None]
    assert len(solved) > 5
    for q in solved:
        T = solver.tool_pose(q)
        reached = T[:3, :3] @ (arm.tool.point if arm.tool else np.zeros(3)) + T[:3, 3]
        assert np.linalg.norm(reached - point) < POSITION_TOLERANCE_M + 1e-4
        assert np.arccos(np.clip(T[:3, 2] @ DOWN, -1, 1)) < DIRECTION_TOLERANCE_RAD + 1e-4


def test_a_target_out_of_reach_has_no_initial_guess():
    arm = find_cell("ring-2").arms[0]
    assert len(kinematics(arm.robot, arm.tool).initial_guesses(np.array([5.0, 0.0, 0.2]), DOWN)) == 0


def test_initial_guesses_are_near_the_target_and_face_it():
    arm = find_cell("ring-2").arms[0]
    solver, point = kinematics(arm.robot, arm.tool), np.array([-0.2, 0.4, 0.2])
    tools = np.array([solver.tool_pose(q)[:3, 3] for q in solver.initial_guesses(point, DOWN)])
    away = np.linalg.norm(tools - point, axis=1)
    assert 5 < len(away) <= 60
    assert away.max() < 0.2
    np.testing.assert_allclose(np.arctan2(tools[:, 1], tools[:, 0]), np.arctan2(0.4, -0.2), atol=1e-6)


def test_a_candidate_in_collision_with_a_placed_arm_is_left_out():
    cell = find_cell("ring-2")
    here, other = cell.arms
    place = between_the_bases(cell, 0.25)
    free = IkCandidates(here, place, required_in(cell), {})
    assert free.find(here.robot.home, 12, np.random.default_rng(0))
    blocked = IkCandidates(other, place, required_in(cell), {})
    assert blocked.find(other.robot.home, 12, np.random.default_rng(0))
    blocked.solve(0)
    standing = {other.name: blocked.q[0]}
    assert not IkCandidates(here, place, required_in(cell, clearance=0.15), standing).find(
        here.robot.home, 12, np.random.default_rng(0)
    )


def test_a_solved_candidate_keeps_the_clearances_and_find_respects_its_limit():
    cell = find_cell("ring-2")
    required, arm = required_in(cell), cell.arms[0]
    candidates = IkCandidates(arm, between_the_bases(cell, 0.25), required, {})
    assert candidates.find(arm.robot.home, 5, np.random.default_rng(0))
    assert len(candidates.q) <= 5
    for k in range(len(candidates.q)):
        candidates.solve(k)
        assert candidates.solved[k] != candidates.refused[k]
        if candidates.solved[k]:
            assert required.is_kept(arm.name, candidates.q[k], {})
    assert candidates.solved.any()


def test_arms_at_one_target_are_a_failed_draw():
    cell = find_cell("ring-4")
    search = search_in(cell)
    apart = {arm.name: ToolTarget(point=0.5 * arm.position + np.array([0.0, 0.0, 0.25])) for arm in cell.arms}
    found = search.find(apart, home(cell))
    assert search.require(found, "over its spot") is found
    one = {name: ToolTarget(point=np.array([0.0, 0.0, 0.25])) for name in cell.arm_names}
    with pytest.raises(DrawFailed, match=r"arm 'arm\d' \(ur5e\)"):
        search.find(one, home(cell))


def test_a_failing_arm_evicts_a_neighbour_a_few_times():
    cell, turns = find_cell("ring-4"), []

    def attempt(arm, made):
        turns.append(arm.name)
        if arm.name == "arm1" and "arm0" in made:
            raise DrawFailed.at(arm)
        return len(turns)

    made = search_in(cell).place_arms(attempt)
    assert tuple(made) == cell.arm_names
    assert made["arm1"] < made["arm0"]

    def hopeless(arm, made):
        if arm.name == "arm3":
            raise DrawFailed.at(arm, " at last")
        return 0

    with pytest.raises(DrawFailed, match=r"arm 'arm3' .* at last"):
        search_in(cell).place_arms(hopeless)


def test_draws_repeat_until_one_succeeds_and_the_error_names_the_hardest_arm():
    cell, numbers = find_cell("ring-2"), []

    def third(number):
        numbers.append(number)
        if number < 2:
            raise DrawFailed.at(cell.arms[number % 2])
        return "drawn"

    assert draw_until_success(Quick(), cell, third) == "drawn"
    assert numbers == [0, 1, 2]

    def never(number):
        raise DrawFailed.at(cell.arms[number % 3 > 0])

    with pytest.raises(MmpError, match=r"task 'quick' found no instance for cell 'ring-2' in 7 draws: 4 .* arm 'arm1'"):
        draw_until_success(Quick(draws=7), cell, never)


def test_free_spots_are_in_the_sector_and_clear_of_bases_obstacles_and_each_other():
    cell = find_cell("mixed-4")
    table, rng, taken, arm = Table(cell), np.random.default_rng(0), [], cell.arms[0]
    for _ in range(3):
        spot = table.free_spot(arm, rng, taken, 0.06, Sector())
        assert 0.32 < np.linalg.norm(spot - arm.position[:2]) / arm.robot.reach < 0.61
        assert np.linalg.norm(table.bases - spot, axis=1).min() >= 0.17 - 1e-3
        assert all(np.linalg.norm(spot - other) >= 0.17 - 1e-3 for other in taken)
        taken.append(spot)
    here = Sector(nearest=0.0, farthest=0.01)  # inside the base
    with pytest.raises(DrawFailed, match="no free spot on the table"):
        table.free_spot(arm, rng, taken, 0.06, here)


def test_making_a_task_imports_neither_mink_nor_mujoco():
    code = (
        "import sys, mmp_tasks; mmp_tasks.make('packing'); print([m for m in ('mink', 'mujoco') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_a_process_with_another_hash_seed_draws_the_same():
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
