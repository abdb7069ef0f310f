"""Events of an environment: a cart that moves, and goals that change."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support.unchecked import unchecked

from mmp_env import OnlinePlanner
from mmp_env.errors import MmpError
from mmp_env.retime import retime
from mmp_env.sim.cart import CART
from mmp_planners import make as make_planner

EVENTS = ["cart", "goals", ["cart", "goals"], {"cart": {"edge": 0.3, "speed": 1.0, "stops": 0}, "goals": {}}]
FAST = {"cart": {"speed": 1.0}, "goals": {"every_s": 0.5}}


def make(name="MultiArmCell-2", **options):
    return gymnasium.make(name, **options).unwrapped


def still(env):
    """Returns the action that holds the arms where they are."""
    return env.action_towards(env.data.qpos)


def history(env, steps):
    """Returns what is observed, rewarded and told while the arms hold still."""
    out = [env.reset(seed=4)]
    out += [env.step(still(env)) for _ in range(steps)]
    return out


@pytest.mark.parametrize("events", EVENTS)
def test_gymnasiums_checker_passes_without_a_warning(events):
    check_env(make(events=events))


def test_an_episode_is_repeated_from_its_seed():
    env = make(events=FAST)
    first = history(env, 30)
    for again in (history(env, 30), history(make(events=FAST), 30)):
        for (observation, *rest), (other, *other_rest) in zip(first, again, strict=True):
            assert rest == other_rest
            for name, value in observation.items():
                np.testing.assert_array_equal(value, other[name], name)
    assert not np.array_equal(env.reset(seed=5)[0]["cart_position"], history(env, 30)[-1][0]["cart_position"])


def test_events_change_no_instance():
    plain, env = make(), make(events=FAST)
    for seed in (3, None, None):
        start, _ = plain.reset(seed=seed)
        observation, _ = env.reset(seed=seed)
        for name in ("joint_positions", "goal_positions"):
            np.testing.assert_array_equal(observation[name], start[name])
        env.step(still(env))


def test_the_cart_moves_with_its_velocity_and_not_faster_than_its_speed():
    env = make(events=FAST, control_rate_hz=100)
    places, velocities = zip(
        *((seen["cart_position"], seen["cart_velocity"]) for seen, *_ in history(env, 200)), strict=True
    )
    np.testing.assert_allclose(np.diff(places, axis=0), 0.01 * np.array(velocities)[1:], atol=1e-12)
    speeds = np.linalg.norm(velocities, axis=1)
    assert speeds.max() == pytest.approx(1.0)
    assert env.cart.speed == 1.0
    np.testing.assert_array_equal(env.cart.position, places[-1])


def test_the_observed_place_and_clearance_are_those_of_the_simulation():
    env = make(events={"cart": {"stops": 0, "speed": 1.0}}, terminate_on_contact=False)
    plain = make()
    plain.reset(seed=4)
    seen = [observation for observation, *_ in history(env, 60)]
    np.testing.assert_array_equal(env.data.body("obstacle/cart").xpos, seen[-1]["cart_position"])
    without = plain.reset(seed=4)[0]["clearance"][0]
    assert seen[0]["clearance"] == pytest.approx(without)
    assert min(observation["clearance"][0] for observation in seen) < without - 0.01


def first_touch(stops, seed):
    """Returns the first contact within 60 s in which the arms hold still, and the least clearance [m] of the cart."""
    env = make(events={"cart": {"stops": stops, "speed": 1.0, "edge": 0.3}})
    env.reset(seed=seed)
    least = np.inf
    for _ in range(600):
        *_, over, _, info = env.step(still(env))
        least = min(least, env._simulation.cart_clearance())
        if over:
            return info["contacts"][0], least
    return None, least


def test_a_cart_that_does_not_stop_touches_an_arm_and_ends_the_episode():
    contact, _ = first_touch(0, 1)
    assert contact.body_b == "obstacle/cart"
    assert contact.body_a.startswith("arm")
    assert contact.depth_m > 0


def test_a_cart_stops_in_front_of_arms_that_stand():
    contact, least = first_touch(0.2, 1)
    assert contact is None
    assert least >= 0.2


def test_goals_change_in_time_and_the_episode_goes_on():
    env = make(events=FAST)
    goals = [observation["goal_positions"] for observation, *_ in history(env, 12)]
    changes = [k for k in range(1, 13) if not np.array_equal(goals[k], goals[k - 1])]
    assert changes == [5, 10]
    np.testing.assert_array_equal(np.concatenate(list(env.goal.values())), goals[-1])


def test_goals_that_are_reached_are_rewarded_counted_and_replaced():
    env = make(events="goals")
    env.reset(seed=0)
    start = env.problem.start
    before, info = env.reset(seed=0, options={"start": start, "goal": start})
    assert info["goals_reached"] == 0
    observation, reward, terminated, _, info = env.step(still(env))
    assert (info["is_success"], info["goals_reached"], terminated) == (True, 1, False)
    assert reward == pytest.approx(10.0, abs=0.1)
    assert not np.array_equal(observation["goal_positions"], before["goal_positions"])
    _, reward, _, _, info = env.step(still(env))
    assert (info["is_success"], info["goals_reached"]) == (False, 1)
    assert reward == pytest.approx(0.0, abs=0.1)


def test_the_planner_of_a_changing_world_reaches_goals_without_contact():
    env = make(events=["cart", "goals"], control_rate_hz=50)
    observation, _ = env.reset(seed=3)
    online = OnlinePlanner(env.cell, env.problem.start, clock=lambda: env.data.time)
    online.add_obstacle(env.cart, speed=env.cart.speed)
    for k in range(1500):
        if k % 5 == 0:
            online.move_obstacle(CART, observation["cart_position"], speed=env.cart.speed)
            online.replan(env.goal, within=0.2)
        q = online.state(online.now + 0.02)
        observation, _, over, _, info = env.step(env.action_towards(np.concatenate(list(q.values()))))
        assert not info["contacts"]
        assert not over
    assert info["goals_reached"] >= 1


def test_a_plan_is_executed_while_the_cart_moves():
    env = make(events="cart")
    env.reset(seed=2)
    plan = retime(make_planner("auto").plan(env.problem, seed=2).plan)
    before = env.cart.position
    report = env.execute(plan)
    assert report.reached
    assert np.linalg.norm(env.cart.position - before) > 0.1


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ("car", "unknown event 'car'.*cart"),
        (["cart", 3], "events is .*; it must be names of events"),
        (5, "events is 5; it must be names of events"),
        ({"cart": {"size": 1}}, "unknown option of event 'cart' 'size'"),
        ({"cart": 0.3}, "event 'cart' is 0.3; it must be a dict of its options"),
        ({"cart": {"speed": 0}}, "speed of the cart is 0; it must be"),
        ({"cart": {"stops": -1}}, "stops of the cart is -1; it must be"),
        ({"cart": {"edge": float("nan")}}, "edge of the cart is nan; it must be"),
        ({"goals": {"every_s": "soon"}}, "every_s of the goals is .*; it must be"),
    ],
)
def test_a_wrong_event_is_refused_with_a_sentence(events, message):
    with unchecked(), pytest.raises(MmpError, match=message):
        make(events=events)


def test_new_goals_need_a_task_without_objects():
    with pytest.raises(MmpError, match="the event 'goals' needs a task without"):
        make(events="goals", task="packing").reset(seed=0)
    assert make(events="cart", task="packing").reset(seed=0)[0]["cart_position"].shape == (3,)


def test_an_environment_without_a_cart_says_so():
    with pytest.raises(MmpError, match="make it with events='cart'"):
        _ = make().cart
