"""The force field of the core against the reference, and one iteration of ModifyMotion against its formula."""

from itertools import pairwise

import numpy as np
import pytest
from reference import repulsion, toys

from mmp_env import core

ROBOTS = [("ur5e", "ur5e"), ("panda", "piper"), ("piper", "fr5", "panda")]
K_REP, D0_M = 0.05, 0.10
FIELD = core.RepulsionSettings(k_rep=K_REP, d0=D0_M)


def near_paths(rng, robots, spheres="28", lengths=(9, 4, 11), gap_m=0.03):
    """Returns a cell and a path per arm. The paths begin with links of arm0 about `gap_m` from arm1."""
    cell = toys.random_cell(rng, robots, spheres, obstacles=False)
    starts = [toys.random_configurations(rng, arm, 1000) for arm in cell.arms]
    gap = cell.collision.pair_clearance("arm0", starts[0], "arm1", starts[1])
    near = np.flatnonzero(np.abs(gap - gap_m) < gap_m / 3)
    # A state in which only the base of arm0 is near does not count, because forces do not move the base.
    nearest = next(k for k in near if repulsion.state_force(cell, "arm0", starts[0][k], {"arm1": starts[1][k]}).any())
    paths = {}
    for arm, start, steps in zip(cell.arms, starts, lengths, strict=False):
        moves = rng.uniform(-0.03, 0.03, (steps, arm.dof))
        path = np.vstack([start[nearest], start[nearest] + np.cumsum(moves, axis=0)])
        paths[arm.name] = np.clip(path, arm.robot.lower, arm.robot.upper).astype(np.float32).astype(float)
    return cell, paths


def motions_of(cell, paths):
    first, *others = [cell.collision.motion(arm, path) for arm, path in paths.items()]
    return first, others


@pytest.mark.parametrize("distance", ["surface", "centre"])
@pytest.mark.parametrize("spheres", ["28", "fine"])
@pytest.mark.parametrize("robots", ROBOTS, ids="-".join)
def test_the_force_field_agrees_with_the_reference(robots, spheres, distance):
    rng = np.random.default_rng(61)
    for _ in range(2):
        cell, paths = near_paths(rng, robots, spheres)
        motion, others = motions_of(cell, paths)
        # Centres of two arms in contact are still far apart, so the field between centres needs a longer range.
        d0 = D0_M if distance == "surface" else 0.2
        settings = core.RepulsionSettings(k_rep=K_REP, d0=d0, centre_distance=distance == "centre")
        found = core.repulsive_force(cell.collision.core, motion, others, settings)
        expected = repulsion.path_forces(cell, "arm0", paths, k_rep=K_REP, d0=d0, distance=distance)
        assert expected.any()
        # The force grows with the cube of 1/d: an error of 1e-6 m at 1 cm is a relative error of 3e-4.
        np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())


def test_without_a_floor_the_force_grows_to_contact():
    rng = np.random.default_rng(67)
    cell, paths = near_paths(rng, ("ur5e", "ur5e"), gap_m=0.005)
    still = {"arm0": paths["arm0"][[0, 0, 0]], "arm1": paths["arm1"][[0, 0, 0]]}
    motion, others = motions_of(cell, still)
    found, with_floor = (
        core.repulsive_force(cell.collision.core, motion, others, core.RepulsionSettings(floor=floor))
        for floor in (0.0, 0.01)
    )
    expected = repulsion.path_forces(cell, "arm0", still, floor=0.0)
    # An error of 1e-6 m at 3 mm is a relative error of 1e-3.
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=2e-3 * np.abs(expected).max())
    assert np.abs(found).max() > 2 * np.abs(with_floor).max()


@pytest.mark.parametrize("distance", ["surface", "centre"])
def test_the_force_is_minus_the_gradient_of_the_potential(distance):
    """By finite differences of the potential, which share nothing with Jacobians and forces."""
    rng = np.random.default_rng(66)
    d0 = D0_M if distance == "surface" else 0.2
    cell, paths = near_paths(rng, ("ur5e", "panda"))
    paths = {name: np.repeat(path[:1], 3, axis=0) for name, path in paths.items()}
    motion, others = motions_of(cell, paths)
    settings = core.RepulsionSettings(k_rep=K_REP, d0=d0, centre_distance=distance == "centre")
    found = core.repulsive_force(cell.collision.core, motion, others, settings)[1]
    q, other_q, h = paths["arm0"][0], {"arm1": paths["arm1"][0]}, 1e-6
    gradient = [
        np.subtract(
            *(
                repulsion.state_potential(cell, "arm0", q + sign * h * e, other_q, d0=d0, distance=distance)
                for sign in (1, -1)
            )
        )
        / (2 * h)
        for e in np.eye(len(q))
    ]
    assert np.abs(found).max() > 0.01
    np.testing.assert_allclose(found, -np.array(gradient), rtol=2e-3, atol=2e-3 * np.abs(found).max())


def test_the_ends_of_a_path_feel_nothing():
    rng = np.random.default_rng(62)
    cell, paths = near_paths(rng, ("ur5e", "ur5e"))
    motion, others = motions_of(cell, paths)
    forces = core.repulsive_force(cell.collision.core, motion, others, FIELD)
    assert forces.shape == paths["arm0"].shape
    assert not forces[[0, -1]].any()
    assert forces[1:-1].any()


def test_a_path_without_inner_steps_feels_nothing():
    cell, paths = near_paths(np.random.default_rng(63), ("ur5e", "ur5e"))
    _, others = motions_of(cell, paths)
    for rows in (1, 2):
        motion = cell.collision.motion("arm0", paths["arm0"][:rows])
        assert not core.repulsive_force(cell.collision.core, motion, others, FIELD).any()


ANY_STATIC = core.Levels(-1.0, -1.0)
"""Margins that no self-contact violates."""


def modify(cell, paths, constraints=(), levels=ANY_STATIC, **options):
    defaults = {"alpha": 1e-7, "k_rep": K_REP, "d0": D0_M, "max_iterations": 1, "comfort": -1.0}
    motion, others = motions_of(cell, paths)
    return core.modify_motion(
        cell.collision.core,
        motion,
        others=others,
        constraints=list(constraints),
        max_step_rad=np.full(cell.arms[0].dof, 1.0),
        levels=levels,
        constraint_margin=0.001,
        settings=core.RepulsionSettings(**(defaults | options)),
        clock=core.Clock(60.0),
        trace=True,
    )


def limited(cell, path):
    return np.clip(path, cell.arms[0].robot.lower, cell.arms[0].robot.upper)


def test_an_iteration_moves_along_the_force_and_is_capped():
    rng = np.random.default_rng(64)
    cell, paths = near_paths(rng, ("ur5e", "panda"))
    force = repulsion.path_forces(cell, "arm0", paths)
    alpha = 0.1 / np.abs(force).max()
    found = modify(cell, paths, alpha=alpha)
    moved_path = found.positions
    step = np.clip(alpha * force, -0.05, 0.05)
    assert (np.abs(step) == 0.05).any()
    np.testing.assert_allclose(moved_path, limited(cell, paths["arm0"] + step), rtol=0, atol=2e-4)
    assert (found.moved, found.iterations, found.input_breaks_constraint, len(found.trace)) == (True, 1, False, 1)
    np.testing.assert_array_equal(found.trace[0], moved_path)
    np.testing.assert_array_equal(moved_path[[0, -1]], paths["arm0"][[0, -1]])


def test_without_a_cap_an_iteration_moves_by_the_whole_force():
    cell, paths = near_paths(np.random.default_rng(64), ("ur5e", "panda"))
    force = repulsion.path_forces(cell, "arm0", paths)
    alpha = 0.1 / np.abs(force).max()
    found = modify(cell, paths, alpha=alpha, max_step=0.0)
    np.testing.assert_allclose(found.positions, limited(cell, paths["arm0"] + alpha * force), rtol=0, atol=2e-4)


def test_long_steps_end_the_descent_unless_any_length_is_allowed():
    cell, paths = near_paths(np.random.default_rng(64), ("ur5e", "panda"))
    assert np.abs(np.diff(paths["arm0"], axis=0)).max() > 0.01
    assert [modify(cell, paths, stretch=stretch).iterations for stretch in (0.01, 0.0)] == [0, 1]


def test_a_normalised_step_is_the_smoothed_force_scaled_to_its_largest_joint():
    rng = np.random.default_rng(65)
    cell, paths = near_paths(rng, ("panda", "ur5e"))
    force = repulsion.path_forces(cell, "arm0", paths)
    last = len(force) - 1
    smoothed = np.zeros_like(force)
    weight = np.exp(-(np.arange(-18, 19) ** 2) / (2 * 6**2))
    weight /= weight.sum()
    for k in range(1, last):
        for d in range(-18, 19):
            if 0 <= k + d <= last:
                smoothed[k] += weight[d + 18] * force[k + d]
    moved_path = modify(cell, paths, normalised=True, normalised_step=0.02).positions
    step = 0.02 * smoothed / np.abs(smoothed).max()
    np.testing.assert_allclose(moved_path, limited(cell, paths["arm0"] + step), rtol=0, atol=2e-4)


def test_iterations_follow_each_other():
    rng = np.random.default_rng(66)
    cell, paths = near_paths(rng, ("ur5e", "ur5e"))
    alpha = 0.01 / np.abs(repulsion.path_forces(cell, "arm0", paths)).max()
    iterates = modify(cell, paths, alpha=alpha, max_iterations=4).trace
    assert len(iterates) == 4
    for before, after in pairwise(iterates):
        alone = modify(cell, paths | {"arm0": before}, alpha=alpha).positions
        np.testing.assert_allclose(alone, after, rtol=0, atol=1e-6)  # iterates are rounded, what comes next is not


def test_steps_below_single_precision_add_up():
    rng = np.random.default_rng(66)
    cell, paths = near_paths(rng, ("ur5e", "ur5e"))
    alpha = 2e-8 / np.abs(repulsion.path_forces(cell, "arm0", paths)).max()  # single precision: 2.4e-7 at 2 to 4 rad
    few, many = (modify(cell, paths, alpha=alpha, max_iterations=n).positions - paths["arm0"] for n in (100, 1000))
    assert np.abs(few).max() == pytest.approx(100 * 2e-8, rel=0.3)
    assert np.abs(many).max() == pytest.approx(1000 * 2e-8, rel=0.05)


def test_an_iterate_that_breaks_a_constraint_is_not_returned():
    rng = np.random.default_rng(67)
    cell, paths = near_paths(rng, ("ur5e", "ur5e"))
    alpha = 0.02 / np.abs(repulsion.path_forces(cell, "arm0", paths)).max()
    iterates = modify(cell, paths, alpha=alpha, max_iterations=4).trace
    # A small ball about a configuration that only the second iteration reaches.
    k = int(np.argmax(np.abs(iterates[1] - iterates[0]).max(axis=1)))
    travelled = [np.abs(iterates[n][k] - iterates[1][k]).max() for n in (0, 2, 3)]
    ball = core.Constraint.ball(np.ascontiguousarray(iterates[1][k]), 0.4 * min(travelled), k - 1, k + 1)
    found = modify(cell, paths, [ball], alpha=alpha, max_iterations=2)
    assert (found.moved, found.iterations, found.input_breaks_constraint, len(found.trace)) == (True, 2, False, 2)
    np.testing.assert_array_equal(found.positions, iterates[0])
    found = modify(cell, paths, [ball], alpha=alpha, max_iterations=4)
    np.testing.assert_array_equal(found.positions, iterates[3])


def test_the_result_says_that_the_input_breaks_its_constraint():
    cell, paths = near_paths(np.random.default_rng(68), ("ur5e", "ur5e"))
    ball = core.Constraint.ball(np.ascontiguousarray(paths["arm0"][3]), 0.01, 2, 4)
    assert modify(cell, paths, [ball]).input_breaks_constraint


def test_a_static_contact_ends_the_descent():
    """The first iterate would touch a wall beside the path, so the path stays unchanged."""
    push, wall = toys.toy_arm("arm0", [0, 0, 0]), toys.solid("box", [1.0, -0.2, 0], size=[3.0, 0.1, 1.0])
    other = toys.toy_arm("arm1", [0, 0.25, 0])
    q = np.array([[0.02, 0.0], [0.0, 0.0], [0.02, 0.0]])
    for obstacles, moved in (((), True), ((wall,), False)):
        cell = toys.toy_cell(push, other, obstacles=obstacles)
        found = modify(cell, {"arm0": q, "arm1": np.zeros((1, 2))}, alpha=1e-3, levels=core.Levels(0.002, 0.001))
        assert found.moved == moved
        assert (found.positions[1, 0] < 0) == moved
