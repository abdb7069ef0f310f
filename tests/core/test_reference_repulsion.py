"""Reference repulsive force field: values by hand, and the field as the slope of a potential."""

import numpy as np
import pytest
from reference import clearance, repulsion, toys

STRAIGHT = np.zeros(2)


def parallel_arms(gap):
    """Returns two stretched arms side by side, with `gap` [m] between facing elbows and facing tips."""
    return toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [0, gap + 0.2, 0]))


def test_two_facing_pairs_of_spheres_turn_the_joints_by_hand_worked_torques():
    push = 0.05 * (1 / 0.05 - 1 / 0.10) / 0.05**2  # [N], along -y, on the elbow at 1 m and the tip at 2 m
    force = repulsion.state_force(parallel_arms(0.05), "a", STRAIGHT, {"b": STRAIGHT})
    np.testing.assert_allclose(force, [-push * (1 + 2), -push * 1])


def test_closer_than_a_centimetre_the_force_is_that_of_a_centimetre():
    expected = repulsion.state_force(parallel_arms(0.01), "a", STRAIGHT, {"b": STRAIGHT})
    for gap in (0.005, -0.02):
        found = repulsion.state_force(parallel_arms(gap), "a", STRAIGHT, {"b": STRAIGHT})
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_there_is_no_force_beyond_d0():
    assert not repulsion.state_force(parallel_arms(0.101), "a", STRAIGHT, {"b": STRAIGHT}).any()


def test_the_base_of_the_other_arm_pushes_and_the_own_base_feels_nothing():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [2, 0.25, 0]))
    away = np.array([np.pi / 2, 0])
    force = repulsion.state_force(cell, "a", STRAIGHT, {"b": away})
    push = 0.05 * (1 / 0.05 - 1 / 0.10) / 0.05**2
    np.testing.assert_allclose(force, [-push * 2, -push])
    assert not repulsion.state_force(cell, "b", away, {"a": np.array([-2.0, 0])}).any()


def test_with_centre_distances_the_radii_do_not_count():
    cell = parallel_arms(-0.14)  # centres 0.06 m apart
    push = 0.05 * (1 / 0.06 - 1 / 0.10) / 0.06**2
    force = repulsion.state_force(cell, "a", STRAIGHT, {"b": STRAIGHT}, distance="centre")
    np.testing.assert_allclose(force, [-push * 3, -push])


def test_the_ends_of_a_path_feel_nothing_and_a_finished_arm_still_pushes():
    cell = parallel_arms(0.05)
    paths = {"a": np.zeros((5, 2)), "b": np.array([[1.5, 0], [0.0, 0]])}
    forces = repulsion.path_forces(cell, "a", paths)
    assert not forces[[0, 4]].any()
    expected = repulsion.state_force(cell, "a", STRAIGHT, {"b": STRAIGHT})
    np.testing.assert_array_equal(forces[1:4], [expected] * 3)


def potential(cell, q, others, k_rep, d0, distance):
    """Returns the sum of k_rep / 2 (1/d - 1/d0)^2 over the pairs with d <= d0; its gradient is minus the force."""
    own = clearance.cloud(cell, cell.arm("arm0"), q).moving
    total = 0.0
    for name, other_q in others.items():
        other = clearance.cloud(cell, cell.arm(name), other_q)
        d = clearance.gaps(own, other)
        if distance == "centre":
            d = d + own.radii[:, None] + other.radii[None]
        assert d.min() > 2 * repulsion.FLOOR_M  # the floor has no potential
        total += (k_rep / 2 * (1 / d[d <= d0] - 1 / d0) ** 2).sum()
    return total


def near_states(cell, rng, count):
    """Returns states with a clearance of 2 to 8 cm: the field is strong there, and above its distance floor."""
    found = []
    while len(found) < count:
        state = {arm.name: toys.random_configurations(rng, arm, 1)[0] for arm in cell.arms}
        gap = min(
            clearance.pair_clearance(cell, "arm0", state["arm0"], other, state[other]) for other in list(state)[1:]
        )
        if 0.021 < gap < 0.08:
            found.append(state)
    return found


@pytest.mark.parametrize("robots", [("ur5e", "ur5e"), ("panda", "fr5"), ("piper", "panda", "piper")])
@pytest.mark.parametrize("distance", ["surface", "centre"])
def test_the_force_is_minus_the_slope_of_the_potential(robots, distance):
    rng = np.random.default_rng(11)
    cell = toys.random_cell(rng, robots, "28", obstacles=False)
    options = {"k_rep": 0.05, "d0": 0.10, "distance": distance}
    for state in near_states(cell, rng, 3):
        q, others = state["arm0"], {name: s for name, s in state.items() if name != "arm0"}
        force = repulsion.state_force(cell, "arm0", q, others, **options)
        for joint in range(len(q)):
            step = 1e-6 * np.eye(len(q))[joint]
            ahead, behind = (potential(cell, q + s, others, **options) for s in (step, -step))
            assert force[joint] == pytest.approx(-(ahead - behind) / 2e-6, rel=1e-4, abs=1e-4)
