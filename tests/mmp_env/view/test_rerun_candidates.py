"""Candidates of goals in a recording: which ones, where, and the mark of the chosen one."""

import mujoco
import numpy as np
import pytest
from support import two_arms
from support.recordings import Rows

from mmp_env import AnyOf, JointGoal, make_problem
from mmp_env.sim.scene import compile_scene
from mmp_env.view.rerun import RerunWatcher
from mmp_env.view.rerun.candidates import MOST_SHOWN, shown_candidates

PLAIN = two_arms.passing(1.0)
ARM, OTHER = PLAIN.cell.arm_names
LABELS = "Points3D:labels"


@pytest.fixture(scope="module")
def choice():
    """Returns a problem in which one arm has several candidates."""
    goals = [JointGoal(PLAIN.goal[ARM] + 0.004 * k) for k in range(MOST_SHOWN + 3)]
    return make_problem(PLAIN.cell, PLAIN.start, {ARM: AnyOf(goals), OTHER: PLAIN.goal[OTHER]})


def recorded(problem, path):
    pytest.importorskip("rerun")
    with RerunWatcher(problem, path):
        pass
    return Rows(path)


def ghosts(rows):
    return {tuple(path.split("/")[2:4]) for path in rows.entities if path.startswith("/candidates/")}


def test_the_nearest_candidates_and_the_chosen_one_are_ghosts_with_one_label(choice, tmp_path):
    last = len(choice.goals[ARM]) - 1
    assert last >= MOST_SHOWN
    rows = recorded(choice.choosing({ARM: choice.goals[ARM][last], OTHER: choice.goal[OTHER]}), tmp_path / "a.rrd")
    assert ghosts(rows) == {(ARM, str(k)) for k in [*range(MOST_SHOWN - 1), last]}
    assert rows.statics(LABELS) == {f"/candidates/{ARM}/{last}/label": [f"{ARM}: goal"]}


def test_ghosts_stand_where_mujoco_has_the_arm_at_the_candidate(choice, tmp_path):
    rows = recorded(choice, tmp_path / "a.rrd")
    model = compile_scene(choice.cell)
    data = mujoco.MjData(model)
    places = rows.statics("Transform3D:translation")
    for k in shown_candidates(choice, ARM)[0].tolist():
        data.qpos[:] = np.concatenate([choice.goals[ARM][k] if arm == ARM else PLAIN.goal[arm] for arm in (ARM, OTHER)])
        mujoco.mj_kinematics(model, data)
        root = f"/candidates/{ARM}/{k}/"
        links = {path.removeprefix(root): place for path, place in places.items() if path.startswith(root)}
        assert len(links) > 1
        for link, place in links.items():
            np.testing.assert_allclose(place[0], data.body(f"{ARM}/{link}").xpos, atol=1e-5)


def test_a_problem_without_a_choice_has_no_ghosts(tmp_path):
    assert not ghosts(recorded(PLAIN, tmp_path / "a.rrd"))
