"""Small cells of planar arms, and objects of the native core that its functions take."""

from __future__ import annotations

from typing import Any

import numpy as np

from mmp_env import core

LINK_M = 1.0
STEPS = np.array([0.2, 0.2])
ROWS = np.array([[0.0, 0.5], [0.1, 0.6], [0.2, 0.7], [0.3, 0.8]])
FIRST, LAST = ROWS[0].copy(), ROWS[-1].copy()


def arm_at(x: float) -> dict[str, np.ndarray]:
    """Returns arguments of `add_arm`: a planar arm of two links of 1 m, with spheres at base, elbow and tip."""
    base, elbow = np.eye(4), np.eye(4)
    base[0, 3], elbow[0, 3] = x, LINK_M
    return {
        "fixed": np.array([base[:3].ravel(), elbow[:3].ravel()]),
        "tool": elbow[:3].ravel(),
        "slides": np.zeros(2, dtype=bool),
        "lower": np.full(2, -np.pi),
        "upper": np.full(2, np.pi),
        "link_frames": np.array([0, 1, 2], dtype=np.int32),
        "spheres": np.array([[x, 0, 0, 0.1], [LINK_M, 0, 0, 0.1], [LINK_M, 0, 0, 0.1]]),
        "sphere_links": np.array([0, 1, 2], dtype=np.int32),
        "self_pairs": np.array([[0, 2]], dtype=np.int32),
    }


def obstacle() -> dict[str, Any]:
    """Returns arguments of `add_obstacle`: a box out of reach."""
    pose = np.eye(4)
    pose[2, 3] = 5.0
    return {"shape": 0, "pose": pose[:3].ravel(), "size": np.full(3, 0.1)}


def hull() -> dict[str, Any]:
    """Returns what `add_hull` takes: a tetrahedron in the sphere at the tip."""
    return {
        "arm": 0,
        "link": 2,
        "vertices": np.array([[LINK_M, 0, 0], [LINK_M, 0.05, 0], [LINK_M, 0, 0.05], [LINK_M + 0.05, 0, 0]]),
        "radius": 0.01,
        "protrusion": 0.2,
    }


def hull_obstacle() -> dict[str, Any]:
    """Returns what `add_hull_obstacle` takes: a cube out of reach."""
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (4.9, 5.1)])
    planes = np.array([[*n, (corners @ n).max()] for n in (*np.eye(3), *-np.eye(3))])
    return {"vertices": corners, "planes": planes, "radius": 0.0}


def one_arm() -> core.Cell:
    """Returns a cell that is not frozen."""
    cell = core.Cell()
    cell.add_arm(**arm_at(0.0))
    return cell


def two_arms(frozen: bool = True) -> core.Cell:
    """Returns a cell of two arms out of each other's reach, and the box."""
    cell = core.Cell()
    cell.add_arm(**arm_at(0.0))
    cell.add_arm(**arm_at(5.0))
    cell.add_obstacle(**obstacle())
    if frozen:
        cell.freeze()
    return cell


def upright_arm() -> core.Cell:
    """Returns a cell of one arm with a bound on the axis of its tool."""
    cell = one_arm()
    core.keep_upright(cell, 0, np.array([0.0, 0.6, 0.8]), 1.0)
    cell.freeze()
    return cell


CELL, OTHER_CELL = two_arms(), two_arms()
UPRIGHT_CELL = upright_arm()
MOTION, OTHER = core.Motion(CELL, 0, ROWS), core.Motion(CELL, 1, ROWS)
BALL = core.Constraint.ball(FIRST, 0.1, 0.0, 1.0)
CLOCK = core.Clock(60.0)
MARGINS = core.Levels(0.002, 0.0015)


def search() -> core.SingleArm:
    return core.SingleArm(CELL, 0, start=FIRST, goals=LAST[None], max_step=STEPS, levels=MARGINS, seed=1)


def composite() -> core.CompositeSearch:
    start, goal = (np.concatenate([q, q]) for q in (FIRST, LAST))
    return core.CompositeSearch(CELL, start=start, goals=goal[None], samples=MARGINS, edges=MARGINS, seed=1)


def groups() -> core.GroupSearch:
    start, goal = (np.concatenate([q, q]) for q in (FIRST, LAST))
    return core.GroupSearch(CELL, start=start, goal=goal, samples=MARGINS, edges=MARGINS, seed=1)


def pool() -> core.PathRecombination:
    paths = core.PathRecombination(CELL, [STEPS, STEPS], MARGINS)
    paths.add([ROWS, ROWS])
    return paths


def unmade(kind: type) -> Any:
    """Returns an object that was never initialised. Any Python program can make one."""
    return kind.__new__(kind)


SIX_AXES = np.array([[[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0]]], dtype=float)
SIX_OFFSETS = np.array([[[0, 0, 0.1], [0, 0.1, 0], [0, 0, 0.4], [0, 0, 0.4], [0, 0.1, 0], [0, 0, 0.1], [0, 0, 0.1]]])
POSES = np.tile(np.eye(4), (1, 1, 1))
POSES[0, :3, 3] = [0.3, 0.2, 0.4]
THREE = {
    "axes": (np.eye(3)[[2, 1, 1]].copy(), "chain axes"),
    "offsets": (np.array([[0, 0, 0.1], [0, 0, 0.1], [0, 0, 0.4], [0, 0, 0.4]]), "chain offsets"),
    "slides": (np.zeros(3, dtype=bool), "flags of three"),
    "tool": (np.eye(3), "matrix of three"),
}
THREE_ROWS = np.array([[0.1, 0.2, 0.3]])

BALLS = {
    "points": (np.arange(12.0).reshape(4, 3), "rows of points"),
    "centers": (np.zeros((2, 3)), "rows of centers"),
    "radii": (np.array([1.0, 2.0]), "radii"),
}
