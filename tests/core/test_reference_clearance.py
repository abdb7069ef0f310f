"""The clearance reference on toy arms with spheres of 0.1 m at 0, 1 and 2 m, against values computed by hand."""

import numpy as np
import pytest
from reference import clearance, toys

STRAIGHT = np.zeros(2)
FOLDED = np.array([0.0, np.pi])


def test_two_stretched_arms_are_apart_by_the_distance_of_their_tips_less_two_radii():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [5, 0, 0], yaw=np.pi))
    assert clearance.pair_clearance(cell, "a", STRAIGHT, "b", STRAIGHT) == pytest.approx(5 - 4 - 0.2)


def test_overlap_is_negative_clearance():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4.15, 0, 0], yaw=np.pi))
    assert clearance.pair_clearance(cell, "a", STRAIGHT, "b", STRAIGHT) == pytest.approx(-0.05)


def test_moving_links_of_both_arms_are_tested_against_the_other_base():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [2.3, 0, 0]))
    away = np.array([np.pi / 2, 0])
    assert clearance.pair_clearance(cell, "a", STRAIGHT, "b", away) == pytest.approx(0.1)
    assert clearance.pair_clearance(cell, "b", away, "a", STRAIGHT) == pytest.approx(0.1)


def test_bases_are_not_tested_against_each_other():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [0.15, 0, 0]))
    up, down = np.array([np.pi / 2, 0]), np.array([-np.pi / 2, 0])
    expected = np.hypot(1, 0.15) - 0.2
    assert clearance.pair_clearance(cell, "a", up, "b", down) == pytest.approx(expected)


def test_bases_are_not_tested_against_obstacles():
    table = toys.solid("box", [0, 0, -0.1], size=[0.5, 0.5, 0.2])
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), obstacles=[table])
    assert clearance.obstacle_clearance(cell, "a", STRAIGHT) == pytest.approx(0.75 - 0.1)


def test_the_nearest_of_all_obstacles_counts():
    near, far = toys.solid("sphere", [2, 0.5, 0], radius=0.2), toys.solid("sphere", [2, 0, 3], radius=0.2, name="far")
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), obstacles=[far, near])
    assert clearance.obstacle_clearance(cell, "a", STRAIGHT) == pytest.approx(0.5 - 0.2 - 0.1)


def test_a_cell_without_obstacles_or_other_arms_leaves_the_arm_to_itself():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]))
    assert clearance.obstacle_clearance(cell, "a", STRAIGHT) == np.inf
    assert clearance.base_clearance(cell, "a", STRAIGHT) == np.inf
    assert clearance.static_clearance(cell, "a", STRAIGHT) == pytest.approx(2 - 0.2)


def test_an_arm_folded_back_touches_its_own_base():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]))
    assert clearance.self_clearance(cell, "a", FOLDED) == pytest.approx(-0.2)


def test_ignored_link_pairs_are_left_out_of_the_self_test():
    ignored = {"28": frozenset({(0, 1), (1, 2), (0, 2)}), "fine": frozenset()}
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0], self_ignore=ignored))
    assert clearance.self_clearance(cell, "a", FOLDED) == np.inf


def test_the_tool_is_a_part_of_its_own_with_its_own_list_of_ignored_links():
    arm = toys.toy_arm("a", [0, 0, 0], tool=toys.toy_tool())
    cell = toys.toy_cell(arm)
    assert clearance.self_pairs(cell, arm) == [(0, 2), (0, 3), (1, 3)]
    # Folded back, the tip is on the base and the tool 0.5 m behind it: base-tip -0.2, base-tool 0.3.
    assert clearance.self_clearance(cell, "a", FOLDED) == pytest.approx(-0.2)
    own = clearance.cloud(cell, arm, FOLDED)
    np.testing.assert_allclose(own.centers[own.parts == 3], [[-0.5, 0, 0]], atol=1e-12)


def test_the_tool_counts_against_everything_else():
    cell = toys.toy_cell(
        toys.toy_arm("a", [0, 0, 0], tool=toys.toy_tool()),
        toys.toy_arm("b", [5, 0, 0], yaw=np.pi),
        obstacles=[toys.solid("sphere", [2.5, 1, 0], radius=0.5)],
    )
    assert clearance.pair_clearance(cell, "a", STRAIGHT, "b", STRAIGHT) == pytest.approx(5 - 4.5 - 0.2)
    assert clearance.obstacle_clearance(cell, "a", STRAIGHT) == pytest.approx(1 - 0.5 - 0.1)


def test_a_free_configuration_beyond_its_limits_is_invalid():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]))
    assert clearance.is_free(cell, "a", np.array([np.pi, 0]))
    assert not clearance.is_free(cell, "a", np.array([np.pi + 1e-9, 0]))
    assert not clearance.is_free(cell, "a", FOLDED)


def test_the_clearance_of_a_state_leaves_self_contact_to_the_least_clearance():
    cell = toys.toy_cell(
        toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [9, 0, 0]), toys.toy_arm("c", [4, 0, 0], yaw=np.pi / 2)
    )
    state = {"a": STRAIGHT, "b": FOLDED, "c": STRAIGHT}
    assert clearance.clearance(cell, state) == pytest.approx(2 - 0.2)  # the tip of a, the base of c
    assert clearance.least_clearance(cell, state) == pytest.approx(-0.2)
