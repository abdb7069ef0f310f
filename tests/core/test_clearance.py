"""Clearances of the core against the reference implementation: 1e-5 m in single precision, 1e-9 m in double."""

import numpy as np
import pytest
from reference import clearance, toys

from mmp_env.errors import MmpError
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.robot import SPHERE_SETS
from mmp_env.model.transforms import quaternion_from_yaw

CELLS = [("ur5e", "ur5e"), ("panda", "panda"), ("fr5", "fr5"), ("piper", "piper"), ("panda", "ur5e", "piper")]
BOUND_M = {False: 1e-5, True: 1e-9}
COUNT = 21  # not a multiple of any number of vector lanes


def with_cells(test):
    return pytest.mark.parametrize("spheres", SPHERE_SETS)(pytest.mark.parametrize("robots", CELLS, ids="-".join)(test))


def drawn(robots, spheres, seed):
    """Returns a cell and COUNT configurations of each of its arms, many of them in contact."""
    rng = np.random.default_rng(seed)
    cell = toys.random_cell(rng, robots, spheres)
    return cell, {arm.name: toys.random_configurations(rng, arm, COUNT) for arm in cell.arms}


@with_cells
def test_static_clearance_agrees_with_the_reference(robots, spheres):
    cell, q = drawn(robots, spheres, 31)
    for arm in cell.arm_names:
        expected = np.array([clearance.static_clearance(cell, arm, row) for row in q[arm]])
        for precise, bound in BOUND_M.items():
            found = cell.collision.static_clearance(arm, q[arm], precise=precise)
            np.testing.assert_allclose(found, expected, rtol=0, atol=bound)


@with_cells
def test_pair_clearance_agrees_with_the_reference(robots, spheres):
    cell, q = drawn(robots, spheres, 32)
    expected = np.array(
        [clearance.pair_clearance(cell, "arm0", a, "arm1", b) for a, b in zip(q["arm0"], q["arm1"], strict=True)]
    )
    assert (expected < 0).any()
    assert (expected > 0).any()
    for precise, bound in BOUND_M.items():
        found = cell.collision.pair_clearance("arm0", q["arm0"], "arm1", q["arm1"], precise=precise)
        np.testing.assert_allclose(found, expected, rtol=0, atol=bound)
        swapped = cell.collision.pair_clearance("arm1", q["arm1"], "arm0", q["arm0"], precise=precise)
        np.testing.assert_allclose(swapped, expected, rtol=0, atol=bound)


@with_cells
def test_the_clearance_of_whole_states_agrees_with_the_reference(robots, spheres):
    cell, q = drawn(robots, spheres, 33)
    states = [{arm: q[arm][k] for arm in q} for k in range(COUNT)]
    expected = [clearance.clearance(cell, state) for state in states]
    np.testing.assert_allclose(cell.collision.clearance(q), expected, rtol=0, atol=BOUND_M[False])


@with_cells
def test_the_least_clearance_over_everything_agrees_with_the_reference(robots, spheres):
    cell, q = drawn(robots, spheres, 34)
    for k in range(8):
        state = {arm: q[arm][k] for arm in q}
        found, what = cell.collision.least_clearance(state)
        assert found == pytest.approx(clearance.least_clearance(cell, state), abs=BOUND_M[True])
        assert "arm" in what


@with_cells
def test_validity_agrees_with_the_reference(robots, spheres):
    cell, q = drawn(robots, spheres, 35)
    for arm in cell.arms:
        rows = q[arm.name].copy()
        rows[::5, 1] = arm.robot.upper[1] + 1e-6
        expected = [clearance.static_clearance(cell, arm.name, row) for row in rows]
        sure = np.abs(expected) > BOUND_M[False]
        found = cell.collision.is_free(arm.name, rows)
        free = [clearance.is_free(cell, arm.name, row) for row in rows]
        np.testing.assert_array_equal(found[sure], np.array(free)[sure])
        assert not found[::5].any()


SOLIDS = {
    "box": {"size": [0.3, 0.5, 0.2]},
    "sphere": {"radius": 0.25},
    "cylinder": {"radius": 0.2, "length": 0.5},
    "capsule": {"radius": 0.15, "length": 0.4},
}


@pytest.mark.parametrize("shape", SOLIDS)
def test_the_distance_from_each_kind_of_solid_is_exact_inside_and_outside(shape):
    """A toy arm moves one small sphere around the solid and into it."""
    rng = np.random.default_rng(36)
    axes = np.array([[0.0, 0, 1], [0, 1, 0]])
    arm = toys.toy_arm("a", [0, 0, 0], axes=axes)
    for _ in range(5):
        place = rng.uniform([0.5, -0.5, -0.5], [1.8, 0.5, 0.5])
        cell = toys.toy_cell(arm, obstacles=[toys.solid(shape, place, toys.random_rotation(rng), **SOLIDS[shape])])
        towards = np.array([np.arctan2(place[1], place[0]), 0])
        q = towards + rng.uniform([-0.6, -1.5], [0.6, 1.5], (COUNT, 2))
        expected = [clearance.static_clearance(cell, "a", row) for row in q]
        for precise, bound in BOUND_M.items():
            found = cell.collision.static_clearance("a", q, precise=precise)
            np.testing.assert_allclose(found, expected, rtol=0, atol=bound)


def test_bases_too_close_to_each_other_are_no_contact():
    """Bases never move, so the core tests moving links only."""
    away = [quaternion_from_yaw(yaw) for yaw in (0.0, np.pi)]
    arms = tuple(place_arm(f"arm{k}", "ur5e", [0.04 * k, 0, 0], away[k]) for k in (0, 1))
    cell = Cell(name="close", arms=arms)
    q = toys.random_configurations(np.random.default_rng(37), arms[0], 5)
    bases = [clearance.cloud(cell, arm, q[0]).base for arm in arms]
    assert clearance.least_gap(*bases) < -0.1
    expected = [clearance.pair_clearance(cell, "arm0", a, "arm1", b) for a, b in zip(q, q[::-1], strict=True)]
    found = cell.collision.pair_clearance("arm0", q, "arm1", q[::-1], precise=True)
    np.testing.assert_allclose(found, expected, rtol=0, atol=BOUND_M[True])


def test_an_arm_with_nothing_to_touch_is_far_from_everything():
    ignored = {key: frozenset({(0, 1), (0, 2), (1, 2)}) for key in SPHERE_SETS}
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0], self_ignore=ignored))
    for precise in BOUND_M:
        assert (cell.collision.static_clearance("a", np.zeros((3, 2)), precise=precise) >= 100).all()


def test_no_configuration_has_no_clearance():
    cell, _ = drawn(("ur5e", "ur5e"), "28", 38)
    none = np.zeros((0, 6))
    assert cell.collision.static_clearance("arm0", none).shape == (0,)
    assert cell.collision.pair_clearance("arm0", none, "arm1", none).shape == (0,)
    assert cell.collision.clearance({"arm0": none, "arm1": none}).shape == (0,)


def test_rows_that_do_not_match_are_named():
    cell, q = drawn(("ur5e", "ur5e"), "28", 39)
    with pytest.raises(MmpError, match="pair_clearance"):
        cell.collision.pair_clearance("arm0", q["arm0"], "arm1", q["arm1"][:3])
    with pytest.raises(MmpError, match="pair_clearance"):
        cell.collision.pair_clearance("arm0", q["arm0"], "arm0", q["arm0"])
    with pytest.raises(MmpError, match="same number of rows"):
        cell.collision.clearance({"arm0": q["arm0"], "arm1": q["arm1"][:3]})
