"""Red spheres of a recording are those too near to another arm, an obstacle, a base or their own arm."""

from dataclasses import replace

import numpy as np
import pytest
from reference import clearance as reference_clearance
from reference.distance import to_obstacle
from reference.kinematics import part_names
from support import two_arms

from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.held import HELD
from mmp_env.model.margins import Margins
from mmp_env.view.rerun.sphere_clouds import self_pairs, touching_obstacles_or_self, touching_spheres

COUNT = 80
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
TURNED = np.array([0.8, 0.6, 0.0, 0.0])


def solids():
    place = {"quaternion": TURNED}
    return (
        Obstacle(name="box", shape="box", position=np.array([0.4, 0.3, 0.4]), size=np.array([0.3, 0.2, 0.4]), **place),
        Obstacle(name="ball", shape="sphere", position=np.array([-0.4, 0.4, 0.5]), radius=0.15, **place),
        Obstacle(name="post", shape="cylinder", position=np.array([0.0, -0.5, 0.3]), radius=0.1, length=0.5, **place),
        Obstacle(name="bar", shape="capsule", position=np.array([-0.4, -0.4, 0.6]), radius=0.05, length=0.6, **place),
    )


def cluttered(**more):
    """Returns a cell of two Pandas that reach each other's bases, among obstacles of every kind."""
    arms = (
        place_arm("left", "panda", [-0.2, 0, 0], UPRIGHT, **more),
        place_arm("right", "panda", [0.2, 0, 0], UPRIGHT, **more),
    )
    return Cell(name="cluttered", arms=arms, obstacles=solids())


def random_rows(cell, count, seed):
    rng = np.random.default_rng(seed)
    return {arm.name: rng.uniform(arm.robot.lower, arm.robot.upper, (count, arm.dof)) for arm in cell.arms}


def cloud(cell, arm, q):
    """Returns the reference implementation's cloud, its spheres in the order of the core."""
    names = part_names(arm)
    centers, radii = cell.collision.spheres(arm.name, q[None])
    parts = np.array([names.index(link) for link in cell.collision.sphere_links(arm.name)])
    return reference_clearance.Cloud(parts=parts, centers=centers[0], radii=radii)


@pytest.mark.parametrize("margin", [0.0, 0.01])
def test_spheres_are_red_if_a_pairwise_test_finds_them_too_near(margin):
    cell = cluttered(tool="franka-hand")
    q = random_rows(cell, COUNT, 1)
    found = touching_spheres(cell, q, Margins(arms=margin, obstacles=margin, self=margin))
    kinds = set()
    for k in range(COUNT):
        clouds = {arm.name: cloud(cell, arm, q[arm.name][k]) for arm in cell.arms}
        for name, other in (("left", "right"), ("right", "left")):
            own, theirs = clouds[name], clouds[other]
            both = reference_clearance.gaps(own, theirs)
            both[np.ix_(own.parts == 0, theirs.parts == 0)] = np.inf
            solid = np.min([to_obstacle(own.centers, o) for o in cell.obstacles], axis=0) - own.radii
            tested = np.zeros((own.parts.max() + 1,) * 2, bool)
            for i, j in reference_clearance.self_pairs(cell, cell.arm(name)):
                tested[i, j] = tested[j, i] = True
            own_gaps = np.where(tested[np.ix_(own.parts, own.parts)], reference_clearance.gaps(own, own), np.inf)
            nearest = {
                "arm": both[:, theirs.parts > 0].min(axis=1),
                "base": both[:, theirs.parts == 0].min(axis=1),
                "obstacle": np.where(own.parts > 0, solid, np.inf),
                "self": own_gaps.min(axis=1),
            }
            kinds |= {kind for kind, gap in nearest.items() if (gap < margin).any()}
            least = np.min(list(nearest.values()), axis=0)
            sure = np.abs(least - margin) > 1e-5
            red = found[name][k] if name in found else np.zeros(len(least), bool)
            np.testing.assert_array_equal(red[sure], (least < margin)[sure])
    assert kinds == {"arm", "base", "obstacle", "self"}


def test_an_arm_alone_has_red_spheres_exactly_where_the_core_finds_it_in_contact():
    cell = Cell(name="alone", arms=cluttered().arms[:1], obstacles=solids())
    (q,) = random_rows(cell, 300, 2).values()
    red = touching_obstacles_or_self(cell, "left", q, Margins(arms=0.002, obstacles=0.002, self=0.002)).any(axis=1)
    clear = cell.collision.static_clearance("left", q)
    sure = np.abs(clear - 0.002) > 1e-5
    np.testing.assert_array_equal(red[sure], (clear < 0.002)[sure])
    assert 0 < red.sum() < 300


def test_a_held_object_is_not_in_contact_with_the_tool_that_holds_it():
    held = Obstacle(
        name="block", shape="box", position=np.array([0.0, 0.0, 0.1]), quaternion=UPRIGHT, size=np.full(3, 0.06)
    )
    arm = replace(place_arm("left", "panda", [0, 0, 0], UPRIGHT, tool="franka-hand"), held=held)
    cell = Cell(name="holding", arms=(arm,))
    links = np.array(cell.collision.sphere_links("left"))
    pairs = {frozenset(pair) for pair in links[self_pairs(cell, "left")].tolist()}
    assert frozenset((HELD, "franka-hand")) not in pairs
    assert frozenset((HELD, cell.arm("left").robot.link_names[1])) in pairs


def test_arms_that_are_clear_of_everything_are_left_out():
    problem = two_arms.passing()
    assert touching_spheres(problem.cell, {name: q[None] for name, q in problem.start.items()}, problem.margins) == {}
