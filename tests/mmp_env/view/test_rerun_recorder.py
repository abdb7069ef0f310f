"""Episodes of an environment in a recording, against the values of the environment."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support import two_arms
from support.recordings import Rows, array, blueprints

from mmp_env import MmpError, Monitor
from mmp_env.view.rerun import RerunRecorder
from mmp_planners import make

pytestmark = pytest.mark.filterwarnings("ignore::mmp_env.errors.UnretimedPlanWarning")

STEPS = 7


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    """Rows of two episodes, and for each row the joints, the action, the reward and the contacts."""
    path, steps = tmp_path_factory.mktemp("rerun") / "episodes.rrd", []
    env = RerunRecorder(gymnasium.make("MultiArmCell-2", control_mode="delta", terminate_on_contact=False), path)
    env.action_space.seed(1)
    for seed in range(2):
        _, info = env.reset(seed=seed)
        steps.append((env.unwrapped.data.qpos.copy(), None, 0.0, info))
        for _ in range(STEPS):
            action = env.action_space.sample()
            _, reward, _, _, info = env.step(action)
            steps.append((env.unwrapped.data.qpos.copy(), action, reward, info))
    cell = env.unwrapped.cell
    env.close()
    return Rows(path), steps, cell, path


def test_every_step_has_the_spheres_of_the_core(episodes):
    rows, steps, cell, _ = episodes
    for k, arm in enumerate(cell.arm_names):
        found = rows.at(f"/episodes/spheres/{arm}", "Points3D:positions", "step")
        q = np.array([row[0] for row in steps])[:, 6 * k : 6 * k + 6]
        assert sorted(found) == list(range(2 * (STEPS + 1)))
        np.testing.assert_allclose(
            array([found[step] for step in sorted(found)]), cell.collision.spheres(arm, q)[0], atol=1e-5
        )


def test_actions_rewards_and_distances_are_those_of_the_environment(episodes):
    rows, steps, cell, _ = episodes
    rewards = rows.at("/episodes/reward", "Scalars:scalars", "step")
    distances = rows.at("/episodes/distance", "Scalars:scalars", "step")
    assert [rewards[step][0] for step in range(len(steps))] == pytest.approx([row[2] for row in steps])
    assert [distances[step][0] for step in range(len(steps))] == pytest.approx(
        [row[3]["distance_rad"] for row in steps]
    )
    for k, arm in enumerate(cell.arm_names):
        actions = rows.at(f"/episodes/actions/{arm}", "Scalars:scalars", "step")
        for step, (_, action, _, _) in enumerate(steps):
            assert (step in actions) == (action is not None)
            if action is not None:
                np.testing.assert_allclose(actions[step], action[6 * k : 6 * k + 6], atol=1e-6)


def test_the_return_restarts_with_each_episode(episodes):
    rows, steps, _, _ = episodes
    found = rows.at("/episodes/return", "Scalars:scalars", "step")
    assert found[0] == found[STEPS + 1] == [0.0]
    assert found[STEPS][0] == pytest.approx(sum(row[2] for row in steps[: STEPS + 1]))


def test_a_recording_of_episodes_has_its_own_layout(episodes):
    rows, _, _, path = episodes
    assert blueprints(path) == 1
    assert rows.timelines == {"step"}
    assert "/cell/arm0/forearm" in rows.entities


def test_contacts_are_listed_as_text_and_spheres_in_contact_are_red(tmp_path):
    q = two_arms.reaching(0.0)
    env = RerunRecorder(gymnasium.make("MultiArmCell", cell=two_arms.facing_cell(1.0)), tmp_path / "touch.rrd")
    start = {arm: two_arms.reaching(0.8) for arm in ("left", "right")}
    env.reset(seed=0, options={"start": start, "goal": start})
    contacts = []
    for _ in range(40):
        here = env.unwrapped.data.qpos
        low, high = (np.concatenate([getattr(arm.robot, side) for arm in env.unwrapped.cell.arms]) for side in ENDS)
        target = 2 * (np.tile(q, 2) - low) / (high - low) - 1
        assert here.shape == target.shape
        _, _, terminated, _, info = env.step(target.astype(np.float32))
        contacts += info["contacts"]
        if terminated:
            break
    env.close()
    assert contacts, "the hands meet halfway"
    rows = Rows(tmp_path / "touch.rrd")
    words = [text[0] for text in rows.at("/episodes/contacts", "TextLog:text", "step").values()]
    assert all(f"{contact.body_a} and {contact.body_b}" in " ".join(words) for contact in contacts[-1:])
    colors = rows.at("/episodes/spheres/left", "Points3D:colors", "step")
    assert 0xEB0028FF in colors[max(colors)]
    assert 0xEB0028FF not in colors[0]


ENDS = ("lower", "upper")


def test_an_execution_is_recorded_with_the_recorder_and_not_with_the_environment_alone(tmp_path):
    env = RerunRecorder(gymnasium.make("MultiArmCell-2"), tmp_path / "plan.rrd")
    env.reset(seed=3)
    plan = make("auto").plan(env.unwrapped.problem, seed=0).plan
    report = env.execute(plan)
    cell = env.unwrapped.cell
    env.close()
    found = Rows(tmp_path / "plan.rrd").at("/episodes/spheres/arm1", "Points3D:positions", "step")
    assert len(found) == 1 + 1 + (len(report.times) - 1) // 20 + ((len(report.times) - 1) % 20 > 0)
    end = cell.collision.spheres("arm1", report.positions["arm1"][-1:])[0][0]
    np.testing.assert_allclose(array(found[max(found)]), end, atol=1e-5)


def test_an_environment_without_arms_is_refused(tmp_path):
    with pytest.raises(MmpError, match="MultiArmCell"):
        RerunRecorder(gymnasium.make("CartPole-v1"), tmp_path / "pole.rrd")


def test_closing_twice_and_stepping_after_a_close_do_no_harm(tmp_path):
    env = RerunRecorder(gymnasium.make("MultiArmCell-2"), tmp_path / "twice.rrd")
    env.reset(seed=0)
    env.close()
    env.close()
    assert Rows(tmp_path / "twice.rrd").at("/episodes/reward", "Scalars:scalars", "step") == {0: [0.0]}


def test_objects_that_a_reset_brings_are_recorded_from_then_on(tmp_path):
    path = tmp_path / "pick.rrd"
    env = RerunRecorder(gymnasium.make("MultiArmCell-2", task="pick"), path)
    points, joints = [], []
    for seed in range(2):
        env.reset(seed=seed)
        cell = env.unwrapped.cell
        points.append([solid.position for solid in cell.obstacles if solid.name.startswith("object-")])
        joints.append(env.unwrapped.data.qpos.copy())
    env.close()
    rows = Rows(path)
    centers = rows.at("/stage/boxes", "Boxes3D:centers", "step")
    assert sorted(centers) == [0, 1]
    for step, expected in enumerate(points):
        assert len(expected) == 2
        here = array(centers[step])
        assert all(np.abs(here - point).max(axis=1).min() < 1e-6 for point in expected)
    found = rows.at("/episodes/spheres/arm0", "Points3D:positions", "step")
    for step, q in enumerate(joints):
        np.testing.assert_allclose(array(found[step]), cell.collision.spheres("arm0", q[None, :6])[0][0], atol=1e-5)
    assert len(rows.at("/episodes/spheres/arm0", "Points3D:radii", "step")[1]) == len(found[1])


def test_an_execution_with_a_monitor_is_handed_on_to_the_environment(tmp_path):
    env = RerunRecorder(gymnasium.make("MultiArmCell-2"), tmp_path / "plan.rrd")
    env.reset(seed=3)
    plan = make("auto").plan(env.unwrapped.problem, seed=0).plan
    with pytest.raises(MmpError, match="a monitor needs a plan that has velocities"):
        env.execute(plan, monitor=Monitor())
    env.close()


def test_a_disk_that_is_full_ends_the_recording_in_a_sentence(tmp_path, monkeypatch):
    env = RerunRecorder(gymnasium.make("MultiArmCell-2"), tmp_path / "run.rrd")
    file = env._recording._file
    with file._sink, Path("/dev/full").open("wb", buffering=0) as full:
        monkeypatch.setattr(file, "_sink", full)
        env.reset(seed=0)
        with pytest.raises(MmpError, match=r"run.rrd cannot be written: No space left on device"):
            env.close()
