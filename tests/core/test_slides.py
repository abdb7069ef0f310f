"""Arms whose joints slide: kinematics, bounds on motion, proofs and forces against the reference implementation."""

import numpy as np
import pytest
from reference import clearance, kinematics, motion, repulsion, toys

from mmp_env import core
from mmp_planners.arm_bounds import lipschitz

CHAINS = [[kind == "S" for kind in kinds] for kinds in ("SHH", "HSH", "HHS", "SSH", "SHSHS")]
every_chain = pytest.mark.parametrize("slides", CHAINS, ids=lambda chain: "".join("S" if s else "H" for s in chain))


def two_sliders(rng, slides):
    """Returns a cell of two random arms with these joints, close enough to touch."""
    return toys.toy_cell(*(toys.sliding_arm(f"arm{k}", rng, slides, [0.25 * k, 0, 0]) for k in range(2)))


@every_chain
def test_spheres_and_tool_points_agree_with_the_reference(slides):
    rng = np.random.default_rng(1)
    cell = toys.toy_cell(toys.sliding_arm("arm", rng, slides))
    arm = cell.arms[0]
    q = toys.random_configurations(rng, arm, 21)
    centers, _ = cell.collision.spheres("arm", q)
    for found, row in zip(centers, q, strict=True):
        expected = clearance.cloud(cell, arm, row).centers
        apart = np.linalg.norm(found[:, None] - expected[None], axis=2)
        assert max(apart.min(axis=1).max(), apart.min(axis=0).max()) < 1e-9
    tools = [kinematics.tool_point(arm, row) for row in q]
    np.testing.assert_allclose(cell.collision.tool_points("arm", q), tools, rtol=0, atol=1e-9)


@every_chain
def test_a_point_moves_by_the_jacobian(slides):
    rng = np.random.default_rng(2)
    arm = toys.sliding_arm("arm", rng, slides)
    q, local = toys.random_configurations(rng, arm, 1)[0], rng.uniform(-0.2, 0.2, 3)
    found = kinematics.point_jacobian(arm, q, arm.dof, local)
    np.testing.assert_allclose(found, kinematics.point_jacobian_by_differences(arm, q, arm.dof, local), atol=1e-8)


def beside(cell, rng, steps, size, beyond=0.0):
    """Returns a path for each arm that starts where they are 0 to 4 cm apart, `beyond` their limits at most."""
    starts = [toys.random_configurations(rng, arm, 3000) for arm in cell.arms]
    near = int(np.argmin(np.abs(cell.collision.pair_clearance("arm0", starts[0], "arm1", starts[1]) - 0.02)))
    paths = []
    for arm, start in zip(cell.arms, starts, strict=True):
        path = start[near] + np.cumsum(np.vstack([np.zeros(arm.dof), rng.uniform(-size, size, (steps, arm.dof))]), 0)
        paths.append(np.clip(path, arm.robot.lower - beyond, arm.robot.upper + beyond) + beyond)
    return paths


@every_chain
@pytest.mark.parametrize("beyond", [0.0, 1.5], ids=["within limits", "beyond limits"])
def test_no_sample_of_a_certified_motion_is_closer_than_proved(slides, beyond):
    """The levers of the core hold within the limits of slides; beyond them the excess is added."""
    rng = np.random.default_rng(3)
    certified = 0
    for _ in range(4):
        cell = two_sliders(rng, slides)
        paths = beside(cell, rng, steps=2, size=0.5, beyond=beyond)
        proof = core.certify(cell.collision.core, paths, core.Levels(0.001, 0.001), 1e-3, core.Clock(60.0))
        if not proof.valid:
            continue
        certified += 1
        for k in range(2):
            sampled = zip(*(motion.along(path[k], path[k + 1], 20) for path in paths), strict=True)
            pairs = [clearance.pair_clearance(cell, "arm0", a, "arm1", b) for a, b in sampled]
            assert min(pairs) >= proof.clearance - 1e-9
    assert certified


@every_chain
def test_contacts_between_two_steps_are_found(slides):
    rng = np.random.default_rng(4)
    touched = 0
    for _ in range(6):
        cell = two_sliders(rng, slides)
        a, b = beside(cell, rng, steps=3, size=0.6)
        queries, margin = cell.collision, 0.002
        motions = [queries.motion("arm0", a), queries.motion("arm1", b)]
        found = queries.conflict_instants(motions, [(0, 1)], core.Levels(margin, margin / 2))[0]
        for k in range(3):
            pairs = zip(motion.along(a[k], a[k + 1], 15), motion.along(b[k], b[k + 1], 15), strict=True)
            if min(clearance.moving_clearance(cell, "arm0", x, "arm1", y) for x, y in pairs) < margin / 2 - 1e-5:
                assert ((found >= k) & (found <= k + 1)).any()
                touched += 1
    assert touched


@every_chain
def test_a_free_edge_has_no_sample_in_contact(slides):
    rng = np.random.default_rng(5)
    arm = toys.sliding_arm("arm", rng, slides)
    q_from = toys.random_configurations(rng, arm, 24)
    ball = toys.solid("sphere", kinematics.tool_point(arm, q_from[0]), radius=0.1)
    cell = toys.toy_cell(arm, obstacles=[ball])
    q_to = np.clip(q_from + rng.uniform(-1.0, 1.0, q_from.shape), arm.robot.lower, arm.robot.upper)
    free = cell.collision.edge_free("arm", q_from, q_to, margin=0.002)
    sampled = [motion.edge_clearance(cell, "arm", *ends, samples=10) for ends in zip(q_from, q_to, strict=True)]
    for is_free, least in zip(free, sampled, strict=True):
        assert not is_free or least >= 0.002 - 1e-5
    assert free.any()
    assert not free.all()


@every_chain
def test_the_force_field_pushes_slides_along_their_axes(slides):
    rng = np.random.default_rng(6)
    cell = two_sliders(rng, slides)
    rows = beside(cell, rng, steps=6, size=0.02)
    paths = {f"arm{k}": path.astype(np.float32).astype(float) for k, path in enumerate(rows)}
    first, other = (cell.collision.motion(name, path) for name, path in paths.items())
    settings = core.RepulsionSettings(k_rep=0.05, d0=0.3)
    found = core.repulsive_force(cell.collision.core, first, [other], settings)
    expected = repulsion.path_forces(cell, "arm0", paths, k_rep=0.05, d0=0.3)
    assert expected.any()
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())


@every_chain
def test_no_sphere_moves_more_than_the_lipschitz_bound(slides):
    rng = np.random.default_rng(7)
    cell = toys.toy_cell(toys.sliding_arm("arm", rng, slides))
    arm = cell.arms[0]
    for q, to in zip(*(toys.random_configurations(rng, arm, 100) for _ in range(2)), strict=True):
        moved = clearance.cloud(cell, arm, to).centers - clearance.cloud(cell, arm, q).centers
        assert np.linalg.norm(moved, axis=1).max() <= lipschitz(arm, "28") * np.abs(to - q).max() + 1e-12


def test_a_slide_alone_is_certified_between_its_limits():
    rng = np.random.default_rng(8)
    arm = toys.sliding_arm("arm", rng, (True,))
    cell = toys.toy_cell(arm)
    path = np.linspace(arm.robot.lower, arm.robot.upper, 2)
    proof = core.certify(cell.collision.core, [path], core.Levels(0.0, 0.0), 1e-3, core.Clock(60.0))
    assert proof.valid
