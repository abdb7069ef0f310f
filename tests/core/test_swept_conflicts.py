"""Swept conflicts of two motions against dense samples of both, at all pairs of times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference import toys

from mmp_env import core
from mmp_env.model.arm import Obstacle

DISTANCE_M = 0.01
LOOSE_M = 0.06
"""Clearance beyond which no two steps of these motions are called a conflict."""


def _path(rng, arm, count):
    begin = toys.random_configurations(rng, arm, 1)[0]
    end = np.clip(begin + rng.uniform(-0.6, 0.6, arm.dof), arm.robot.lower, arm.robot.upper)
    return begin + (end - begin) * np.linspace(0.0, 1.0, count)[:, None]


def _clearance(cell, qa, qb):
    """Returns the least clearance of the moving spheres of two arms."""
    collision = cell.collision
    (ca, ra), (cb, rb) = collision.spheres("arm0", qa), collision.spheres("arm1", qb)
    ka, kb = ~collision.is_base("arm0"), ~collision.is_base("arm1")
    apart = np.linalg.norm(ca[:, None, ka, None] - cb[None, :, None, kb], axis=-1)
    return float((apart - ra[ka][:, None] - rb[kb]).min())


@pytest.mark.parametrize("robots", [("ur5e", "ur5e"), ("panda", "piper")])
def test_steps_without_conflict_are_clear_at_any_two_times(robots):
    rng = np.random.default_rng(5)
    decided = {True: 0, False: 0}
    for _ in range(25):
        cell = toys.random_cell(rng, list(robots), "28")
        counts = rng.integers(1, 20, 2)
        a, b = (_path(rng, arm, int(count)) for arm, count in zip(cell.arms, counts, strict=True))
        motions = [cell.collision.motion(f"arm{k}", rows) for k, rows in enumerate((a, b))]
        found = core.swept_conflicts(*motions, DISTANCE_M)
        assert found.shape == (max(len(a) - 1, 1), max(len(b) - 1, 1))
        for i in range(0, found.shape[0], 3):
            for j in range(0, found.shape[1], 3):
                shares = np.linspace(0.0, 1.0, 4)[:, None]
                qa = a[i] + shares * (a[min(i + 1, len(a) - 1)] - a[i])
                qb = b[j] + shares * (b[min(j + 1, len(b) - 1)] - b[j])
                least = _clearance(cell, qa, qb)
                if least < DISTANCE_M:
                    assert found[i, j]
                    decided[True] += 1
                elif least > LOOSE_M:
                    assert not found[i, j]
                    decided[False] += 1
    assert min(decided.values()) >= 20


def test_motions_of_one_arm_are_refused():
    cell = toys.random_cell(np.random.default_rng(0), ["ur5e", "ur5e"], "28")
    own = cell.collision.motion("arm0", cell.arms[0].robot.home[None])
    with pytest.raises(ValueError, match="two arms"):
        core.swept_conflicts(own, own, 0.01)


def test_motions_may_be_of_two_cells():
    cell = toys.random_cell(np.random.default_rng(0), ["ur5e", "ur5e"], "28")
    ball = Obstacle(name="ball", shape="sphere", position=np.zeros(3), quaternion=np.eye(4)[0], radius=5.0)
    full = replace(cell, arms=(replace(cell.arms[0], held=ball), cell.arms[1]))
    q = [arm.robot.tucked[None] for arm in cell.arms]
    other = cell.collision.motion("arm1", q[1])
    assert core.swept_conflicts(full.collision.motion("arm0", q[0]), other, 0.01).all()
