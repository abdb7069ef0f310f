"""The control modes of the environment, its reward, and how an episode ends."""

import sys

import gymnasium
import numpy as np
import pytest

from mmp_env.errors import MmpError
from mmp_env.gym.control import CONTROL_MODES, CONTROL_RATE_HZ
from mmp_env.gym.reward import CONTACT_PENALTY, PROGRESS_WEIGHT, SUCCESS_BONUS
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import SPHERE_SETS
from mmp_env.robot_folders import robot_names
from mmp_env.sim.clearance_audit import PROTRUSION_M
from mmp_env.sim.execution import REACHED_RAD
from mmp_env.sim.simulation import Simulation

FACING_STEEPLY, FACING_LEVEL = (np.array([np.pi, lift, 0.0, 0.0, 0.0, 0.0]) for lift in (-1.3, -0.2))
"""Configuration of a UR5e stretched out towards the centre of its ring."""
UNFOLDED, FOLDED = (np.array([0.0, -1.3, elbow, -1.57, 1.57, 0.0]) for elbow in (2.2, 3.0))
"""Configurations of a UR5e: turned away from the others, and with its wrist in its upper arm."""


def make(name="MultiArmCell-2", **options):
    return gymnasium.make(name, **options)


def tucked(cell):
    return {arm.name: np.array(arm.robot.tucked) for arm in cell.arms}


def towards(env, q):
    """Returns the action of mode `position` that names the configuration `q` [n]."""
    limits = env.unwrapped.observation_space["goal_positions"]
    return (2 * (q - limits.low) / (limits.high - limits.low) - 1).astype(np.float32)


def test_a_position_is_approached_at_the_largest_velocity_and_then_held():
    env = make(control_mode="position", max_velocity=0.5)
    env.reset(options={"start": tucked(env.unwrapped.cell), "goal": tucked(env.unwrapped.cell)})
    start = env.unwrapped.data.qpos.copy()
    target = start + 0.2 * np.array([1, -1] * 6)
    action = towards(env, target)
    path = np.array([env.step(action)[0]["joint_positions"] for _ in range(10)])
    steps = np.abs(np.diff(np.vstack([start, path]), axis=0))
    assert steps.max() <= 1.05 * 0.5 / CONTROL_RATE_HZ
    np.testing.assert_allclose(path[2], start + 3 * 0.5 / CONTROL_RATE_HZ * np.sign(target - start), atol=2e-3)
    np.testing.assert_allclose(path[-1], target, atol=1e-3)


@pytest.mark.parametrize("mode", ["velocity", "delta"])
def test_velocities_and_changes_are_followed_from_where_the_arms_are(mode):
    env = make(control_mode=mode, max_velocity=0.5)
    env.reset(options={"start": tucked(env.unwrapped.cell), "goal": tucked(env.unwrapped.cell)})
    start = env.unwrapped.data.qpos.copy()
    action = np.array([0.4, -0.2] * 6, np.float32)
    for _ in range(5):
        moving = env.step(action)[0]
    np.testing.assert_allclose(moving["joint_velocities"], 0.5 * action, atol=5e-3)
    np.testing.assert_allclose(moving["joint_positions"], start + 5 / CONTROL_RATE_HZ * 0.5 * action, atol=5e-3)
    for _ in range(3):
        stopped = env.step(np.zeros(12, np.float32))[0]
    np.testing.assert_allclose(stopped["joint_velocities"], 0, atol=1e-3)


@pytest.mark.parametrize("mode", sorted(CONTROL_MODES))
def test_no_mode_drives_beyond_the_joint_limits(mode):
    env = make(control_mode=mode, robot="panda", terminate_on_contact=False, max_velocity=2.0)
    env.reset(options={"start": tucked(env.unwrapped.cell), "goal": tucked(env.unwrapped.cell)})
    space = env.unwrapped.observation_space["goal_positions"]
    for sign in (1, -1):
        for _ in range(40):
            env.step(np.full(14, 3 * sign, np.float32))
            command = env.unwrapped.data.act
            lead = 2.0 / CONTROL_RATE_HZ
            assert (command <= space.high + lead).all()
            assert (command >= space.low - lead).all()


def test_the_control_rate_can_be_chosen_among_those_that_divide_the_physics_rate():
    env = make(control_rate_hz=50, control_mode="velocity")
    env.reset(seed=0)
    env.step(np.zeros(12, np.float32))
    assert env.unwrapped.data.time == pytest.approx(0.02)
    assert env.metadata["render_fps"] == 50
    for rate in (0, 3, 1000):
        with pytest.raises(MmpError, match="control_rate_hz"):
            make(control_rate_hz=rate)


def test_the_reward_is_progress_and_a_bonus_for_success_which_ends_the_episode():
    env = make(control_mode="position")
    cell = env.unwrapped.cell
    goal = {name: q + 0.1 for name, q in tucked(cell).items()}
    before, info = env.reset(options={"start": tucked(cell), "goal": goal})
    action = towards(env, before["goal_positions"])
    terminated = False
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(action)
        away = [np.abs(o["goal_positions"] - o["joint_positions"]).mean() for o in (before, observation)]
        bonus = SUCCESS_BONUS if info["is_success"] else 0.0
        assert reward == pytest.approx(PROGRESS_WEIGHT * (away[0] - away[1]) + bonus)
        assert info["is_success"] == terminated == (info["distance_rad"] <= REACHED_RAD)
        assert not truncated
        before = observation


@pytest.mark.parametrize("ends", [True, False])
def test_a_contact_costs_its_penalty_and_ends_the_episode_if_asked(ends):
    env = make(control_mode="position", terminate_on_contact=ends)
    cell = env.unwrapped.cell
    env.reset(options={"start": dict.fromkeys(cell.arm_names, FACING_STEEPLY), "goal": tucked(cell)})
    action = towards(env, np.tile(FACING_LEVEL, 2))
    contacts, steps = [], 0
    while not contacts:
        _, reward, terminated, _, info = env.step(action)
        contacts, steps = info["contacts"], steps + 1
        assert steps < 30
    assert [body.partition("/")[0] for body in (contacts[0].body_a, contacts[0].body_b)] == ["arm0", "arm1"]
    assert contacts[0].depth_m > 0
    assert (steps - 1) / CONTROL_RATE_HZ < contacts[0].time_s <= steps / CONTROL_RATE_HZ + 1e-9
    assert reward < -CONTACT_PENALTY / 2
    assert terminated == ends
    assert not info["is_success"]


def folding(**options):
    """Returns the last step of an episode in which `arm0` folds into itself, truncated after 20 steps."""
    env = make(control_mode="position", **options)
    still = tucked(env.unwrapped.cell)["arm1"]
    env.reset(options={"start": {"arm0": UNFOLDED, "arm1": still}, "goal": tucked(env.unwrapped.cell)})
    action = towards(env, np.concatenate([FOLDED, still]))
    for _ in range(20):
        step = env.step(action)
        if step[2]:
            break
    return step


def test_an_arm_that_touches_itself_is_a_contact_like_any_other():
    _, reward, terminated, _, info = folding()
    assert terminated
    assert reward < -CONTACT_PENALTY / 2
    assert {contact.body_a for contact in info["contacts"]} == {"arm0/upperarm"}
    assert {contact.body_b for contact in info["contacts"]} <= {"arm0/wrist1", "arm0/wrist2"}
    assert info["contacts"][0].depth_m > 0


def test_contacts_of_an_arm_with_itself_can_be_left_out():
    _, reward, terminated, _, info = folding(self_contacts=False)
    assert not terminated
    assert reward > -CONTACT_PENALTY / 2
    assert info["contacts"] == []


@pytest.mark.parametrize("spheres", SPHERE_SETS)
@pytest.mark.parametrize("robot", robot_names())
def test_an_arm_touches_itself_only_where_its_spheres_do(robot, spheres):
    arm = place_arm("a", robot, [0, 0, 0], [1, 0, 0, 0])
    cell = Cell(name="alone", arms=(arm,), spheres=spheres)
    simulation = Simulation(cell)
    rows = np.random.default_rng(0).uniform(arm.robot.lower, arm.robot.upper, (1500, arm.dof))
    touching = np.zeros(len(rows), bool)
    for k, q in enumerate(rows):
        simulation.place(q)
        touching[k] = bool(simulation.log.contacts)
    clear = cell.collision.static_clearance("a", rows) > 2 * PROTRUSION_M
    assert clear.sum() > 500
    assert not (touching & clear).any()
    assert touching.sum() > 20


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(11), r"shape \[11\]; expected \[12\]"),
        (np.full(12, np.nan), "holds nan"),
        (np.full(12, np.inf), "holds inf"),
        (np.ma.masked_all(12), r"the action is masked_array.*must be 12 numbers from -1 to 1"),
    ],
)
def test_a_wrong_action_is_an_error_that_says_what_is_wrong(action, message):
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(MmpError, match=message):
        env.step(action)


@pytest.mark.filterwarnings("error")
def test_numbers_far_beyond_the_bounds_are_clipped_without_a_warning():
    env, other = make().unwrapped, make().unwrapped
    env.reset(seed=0)
    other.reset(seed=0)
    far, ones = np.tile([1e300, -sys.float_info.max], 6), np.tile([1.0, -1.0], 6)
    np.testing.assert_array_equal(env.step(far)[0]["joint_positions"], other.step(ones)[0]["joint_positions"])


@pytest.mark.filterwarnings("error")
def test_a_masked_array_in_which_nothing_is_masked_is_an_action():
    env = make().unwrapped
    env.reset(seed=0)
    env.step(np.ma.masked_array(np.zeros(12)))
