"""Closed forms, refinement, self-motions and turns of the core against obvious ways to the same results."""

import itertools

import numpy as np
import pytest
from reference.inverse_kinematics import tool_frame

from mmp_env import core, place_arm
from mmp_env.ik.chain import chain_of
from mmp_env.ik.closed_form import with_locked

TURN = 2 * np.pi


def drawn(name, seed):
    arm = place_arm("arm", name, [0, 0, 0], [1, 0, 0, 0])
    rng = np.random.default_rng(seed)
    return arm, chain_of(arm.robot, arm.tool), rng.uniform(arm.robot.draw_lower, arm.robot.draw_upper), rng


def apart(q, other):
    """Returns the largest difference of hinges but for turns [rad]."""
    return np.abs((q - other + np.pi) % TURN - np.pi).max(axis=-1)


@pytest.mark.parametrize(("name", "spherical"), [("ur5e", False), ("fr5", False), ("piper", True)])
def test_a_closed_form_has_the_configuration_of_each_pose(name, spherical):
    for seed in range(20):
        arm, chain, q, _ = drawn(name, seed)
        pose = tool_frame(arm, q)
        samples, tools = with_locked(chain, (), np.zeros((1, 0)))
        last = np.eye(4)
        last[:3, :3] = tools[0].T
        found, rows = core.solve_six_hinges(*samples, (pose @ last)[None], spherical, 0.05)
        assert (rows == 0).all()
        assert apart(found, q).min() < 1e-4


@pytest.mark.parametrize("rows", [3, 5, 6])
def test_refined_configurations_have_their_tools_at_the_poses(rows):
    for name in ("fr5", "panda"):
        arm, chain, q, rng = drawn(name, 3)
        pose = tool_frame(arm, q)
        starts = q + rng.uniform(-0.1, 0.1, (8, arm.dof))
        poses = np.tile(pose, (8, 1, 1))
        found, indices = core.refine_tool_pose(
            **chain.numbers, rows=rows, q=starts, poses=poses, steps=12, farthest=10.0
        )
        assert indices[:, 0].tolist() == list(range(8))
        for each in found:
            frame = tool_frame(arm, each)
            np.testing.assert_allclose(frame[:3, 3], pose[:3, 3], atol=1e-9)
            if rows > 3:
                np.testing.assert_allclose(frame[:3, 2], pose[:3, 2], atol=1e-9)
            if rows > 5:
                np.testing.assert_allclose(frame, pose, atol=1e-9)


def test_a_configuration_too_far_from_its_pose_is_not_refined():
    arm, chain, q, _ = drawn("fr5", 0)
    pose = tool_frame(arm, q)[None]
    asked = {"rows": 6, "q": q[None] + 0.5, "poses": pose, "steps": 40}
    assert len(core.refine_tool_pose(**chain.numbers, **asked, farthest=0.01)[0]) == 0


def test_self_motions_have_no_gaps_and_keep_the_tool_in_place():
    arm, chain, q, _ = drawn("panda", 1)
    pose, step = tool_frame(arm, q), 0.1
    found = core.self_motions(
        **chain.numbers, rows=6, q=q[None], pose=pose, lower=arm.robot.lower, upper=arm.robot.upper, step=step
    )
    assert len(found) > 10
    for each in found:
        np.testing.assert_allclose(tool_frame(arm, each), pose, atol=1e-9)
    found = found + TURN * np.ceil((arm.robot.lower - found) / TURN)
    assert (found <= arm.robot.upper).all()
    again = core.self_motions(
        **chain.numbers, rows=6, q=found[-1:], pose=pose, lower=arm.robot.lower, upper=arm.robot.upper, step=step / 8
    )
    assert max(np.linalg.norm((found - each + np.pi) % TURN - np.pi, axis=1).min() for each in again) < step


@pytest.mark.parametrize("limit", [1, 7, 100, 10_000])
def test_turns_are_those_of_all_products(limit):
    rng = np.random.default_rng(limit)
    lower, upper = np.array([-7.0, -0.5, -10.0, -1.0]), np.array([7.0, 9.0, 10.0, 1.0])
    hinges, near = np.array([True, True, True, False]), rng.uniform(lower, upper)
    q = np.round(np.where(hinges, rng.uniform(lower, lower + TURN, (5, 4)), rng.uniform(lower, upper, (5, 4))), 9)
    q = q[(q <= upper).all(axis=1)]
    found, owners = core.with_turns(q, lower, upper, hinges, near, limit)
    expected = []
    for owner, row in enumerate(q):
        choices = [
            [x] if not hinge else [x + TURN * k for k in range(5) if x + TURN * k <= high]
            for x, hinge, high in zip(row, hinges, upper, strict=True)
        ]
        expected += [(np.abs(np.array(each) - near).sum(), owner, each) for each in itertools.product(*choices)]
    expected = sorted(expected, key=lambda each: (round(each[0], 6), each[2]))[:limit]
    np.testing.assert_allclose(found, [each for *_, each in expected], atol=1e-8)
    assert owners[:, 0].tolist() == [owner for _, owner, _ in expected]


def test_variants_agree_to_the_last_bit():
    results = []
    for variant in map(core.load_variant, core.usable_variants()):
        arm, chain, q, _ = drawn("panda", 2)
        pose = tool_frame(arm, q)
        curves = variant.self_motions(
            **chain.numbers, rows=6, q=q[None], pose=pose, lower=arm.robot.lower, upper=arm.robot.upper, step=0.1
        )
        piper, chain, q, _ = drawn("piper", 2)
        samples, _ = with_locked(chain, (), np.zeros((1, 0)))
        results.append([curves, *variant.solve_six_hinges(*samples, tool_frame(piper, q)[None], True, 0.05)])
    for each in results[1:]:
        for mine, others in zip(each, results[0], strict=True):
            np.testing.assert_array_equal(mine, others)
