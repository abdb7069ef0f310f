"""Wrong values for each kind of argument of the native core."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from support.core_objects import (
    BALL,
    CELL,
    FIRST,
    MOTION,
    OTHER,
    OTHER_CELL,
    POSES,
    ROWS,
    SIX_AXES,
    SIX_OFFSETS,
    STEPS,
    one_arm,
    two_arms,
    unmade,
)

from mmp_env import core

NOT_NUMBERS = [None, "x"]
NOT_FINITE = [math.nan, math.inf, -math.inf]
ENDLESS = [*NOT_FINITE, 1e300, -1e300]
NOT_COUNTS = [2**40, 1.5, *NOT_NUMBERS]
FAR = np.array([0.1, 2e4])


def vectors(length: int) -> list[Any]:
    """Returns values that are no configuration of `length` joints."""
    bad = [np.full(length, x) for x in ENDLESS]
    return [np.zeros(0), np.zeros(length - 1), np.zeros(length + 1), np.zeros((1, length)), *bad, *NOT_NUMBERS]


def shapes_like(valid: np.ndarray) -> list[Any]:
    """Returns values that are no array of finite lengths of the shape of a valid one."""
    wrong = [np.zeros(valid.shape[:-1]), np.zeros((*valid.shape[:-1], valid.shape[-1] + 1)), np.zeros((0, 0))]
    return [*wrong, *(np.full(valid.shape, x) for x in ENDLESS), *NOT_NUMBERS]


def numbers_of(length: int) -> list[Any]:
    """Returns values that are not `length` finite numbers."""
    return [*vectors(length), np.array(["x"] * length), np.zeros(length, dtype=complex)]


NOT_ROWS = [np.zeros((3, 1)), np.zeros((3, 3)), np.zeros(2), np.zeros((1, 3, 2)), *NOT_NUMBERS]
NOT_ROWS += [np.vstack([ROWS, bad]) for bad in (FAR, np.full(2, math.nan), np.full(2, math.inf))]
NO_ROWS = np.zeros((0, 2))
NOT_STEPS = [np.array([0.1, x]) for x in (0.0, -0.1, 1e-300, 1e-12)]


def lists_of(valid: Any, wrong: list[Any]) -> list[Any]:
    """Returns values that are no list of one valid value for each of two arms."""
    return [None, 3, [], [valid], [valid, valid, valid], *([valid, bad] for bad in wrong)]


def items(valid: Any, wrong: list[Any]) -> list[Any]:
    """Returns values that are no sequence of objects of the right kind."""
    return [None, 3, *([valid, bad] for bad in (None, 3, "x", unmade(type(valid)), *wrong))]


FOREIGN = core.Motion(OTHER_CELL, 1, ROWS)
WRONG: dict[str, list[Any]] = {
    "cell": [None, 3, unmade(core.Cell), two_arms(frozen=False)],
    "arm": [-1, 2, 2**31 - 1, -(2**31), *NOT_COUNTS],
    "clock": [None, 1.0, unmade(core.Clock)],
    "levels": [None, 0.002, unmade(core.Levels)],
    "required": [None, 0.002, unmade(core.Levels), core.Levels(0.0, -0.001)],
    "search": [None, 3, unmade(core.SingleArm)],
    "single-arm settings": [None, 3, unmade(core.SingleArmSettings)],
    "repulsion settings": [None, 3, unmade(core.RepulsionSettings)],
    "composite settings": [None, 3, unmade(core.CompositeSettings)],
    "shortcut settings": [None, 3, unmade(core.ShortcutSettings)],
    "motion": [None, 3, unmade(core.Motion), core.Motion(OTHER_CELL, 0, ROWS)],
    "motions": items(OTHER, [FOREIGN, BALL]),
    "others": items(OTHER, [FOREIGN, BALL, MOTION]),
    "constraints": items(BALL, [OTHER, core.Constraint.ball(np.zeros(3), 0.1, 0.0, 1.0)]),
    "number": [*ENDLESS, *NOT_NUMBERS],
    "positive": [*ENDLESS, 0.0, -1.0, *NOT_NUMBERS],
    "not negative": [*ENDLESS, -1.0, *NOT_NUMBERS],
    "share": [*ENDLESS, -0.1, 1.1, *NOT_NUMBERS],
    "sampling": [*ENDLESS, 0.0, -1.0, 1e-300, 1e-9, *NOT_NUMBERS],
    "seconds": [math.nan, *NOT_NUMBERS],
    "limit": [math.nan, *NOT_NUMBERS],
    "positive share": [math.nan, -math.inf, 0.0, -1.0, *NOT_NUMBERS],
    "window start": [math.nan, 2.0, *NOT_NUMBERS],
    "window end": [math.nan, -1.0, *NOT_NUMBERS],
    "whole step": [math.nan, 0.5, *NOT_NUMBERS],
    "count": [-1, 2**31 - 1, *NOT_COUNTS],
    "seed": [-1, 2**64, 1.5, *NOT_NUMBERS],
    "flag": [2, None, "x"],
    "link": [0, -1, -(2**31), *NOT_COUNTS],
    "shape": [-1, 4, 2**31 - 1, *NOT_COUNTS],
    "q": vectors(2),
    "all joints": vectors(4),
    "rows of all joints": [np.zeros((0, 4)), np.zeros((1, 2)), np.full((2, 4), math.nan), np.ones(4), *NOT_NUMBERS],
    "steps": [*vectors(2), *NOT_STEPS],
    "point": vectors(3),
    "rows": NOT_ROWS,
    "rows of a line": [*NOT_ROWS, NO_ROWS, ROWS[:1]],
    "some rows": [*NOT_ROWS, NO_ROWS],
    "rows of each": lists_of(ROWS, [*NOT_ROWS, ROWS[:2]]),
    "rows of each goal": [None, 3, [], [ROWS], [ROWS, ROWS, ROWS], *([ROWS, bad] for bad in NOT_ROWS)],
    "some rows of each": [*lists_of(ROWS, [*NOT_ROWS, ROWS[:2]]), [NO_ROWS, NO_ROWS]],
    "path of each": lists_of(ROWS, [*NOT_ROWS, NO_ROWS]),
    "steps of each": lists_of(STEPS, [*vectors(2), *NOT_STEPS]),
    "q of each": lists_of(FIRST, vectors(2)),
    "groups": lists_of(0, [*NOT_COUNTS]),
    "arms": [[0], [1], [1, 0], [0, 0], [], [0, 2], [-1, 0], [0, 2**31 - 1], 3, [None], [0.5], [2**40]],
    "path ids": lists_of(0, [7, -1, *NOT_COUNTS]),
    "any path ids": [None, 3, [None], [2**40]],
    "pairs": [np.array([p], dtype=np.int32) for p in ([0, 2], [-1, 0], [0, 2**31 - 1], [0, 0], [1])]
    + [np.array([0, 1], dtype=np.int32), *NOT_NUMBERS],
    "fixed": [np.zeros((0, 12)), np.zeros((17, 12)), np.zeros((2, 11)), np.zeros(12), *NOT_NUMBERS]
    + [np.full((2, 12), x) for x in ENDLESS],
    "pose": numbers_of(12),
    "limits": [*vectors(2)[:4], np.full(2, math.nan), *NOT_NUMBERS],
    "link_frames": [
        np.array(frames, dtype=np.int32)
        for frames in ([], [0], [0, 1, 3], [0, 1, -1], [0, 1, 2**31 - 1], [1, 1, 2], [0, 0, 2], [0, 2, 1], [0] * 19)
    ]
    + [np.zeros((1, 3), dtype=np.int32), *NOT_NUMBERS],
    "spheres": [np.zeros((2, 4)), np.zeros((4, 4)), np.zeros((3, 3)), np.zeros(4), *NOT_NUMBERS]
    + [np.full((3, 4), x) for x in (*ENDLESS, -0.1)],
    "sphere_links": [
        np.array(links, dtype=np.int32)
        for links in ([], [0, 1], [0, 1, 2, 2], [0, 1, 3], [0, 1, -1], [0, 1, 2**31 - 1])
    ]
    + NOT_NUMBERS,
    "self_pairs": [
        np.array([pair], dtype=np.int32)
        for pair in ([0, 3], [-1, 2], [2, 10**6], [-(2**31), 2**31 - 1], [1, 1], [2, 0], [1])
    ]
    + NOT_NUMBERS,
    "axis": [*numbers_of(3), np.zeros(3), np.array([0.0, 0.0, 1.1])],
    "upright angle": [*ENDLESS, 0.0, -0.1, 1.6, *NOT_NUMBERS],
    "upright cell": [None, 3, unmade(core.Cell), one_arm(), CELL],
    "size": [*numbers_of(3), np.array([0.1, 0.1, -0.1])],
}


WRONG |= {
    "six axes": shapes_like(SIX_AXES),
    "six offsets": shapes_like(SIX_OFFSETS),
    "poses": shapes_like(POSES),
    "one pose": shapes_like(POSES[0]),
    "chain axes": [*shapes_like(np.eye(3)), np.zeros((0, 3)), np.zeros((17, 3))],
    "chain offsets": shapes_like(np.zeros((4, 3))),
    "matrix of three": shapes_like(np.eye(3)),
    "flags of three": [np.zeros(2, dtype=bool), *NOT_NUMBERS],
    "task rows": [-1, 4, 7, *NOT_COUNTS],
    "task rows of three": [-1, 4, 5, 7, *NOT_COUNTS],
    "rows of three": [np.zeros((1, 2)), np.zeros(3), *(np.full((1, 3), x) for x in ENDLESS), *NOT_NUMBERS],
    "limits of three": vectors(3),
    "limits of four": vectors(4),
    "curve step": [*ENDLESS, 0.0, 2.0, *NOT_NUMBERS],
    "turns": [*vectors(3), np.full(3, 9e3)],
    "positive count": [0, -1, *NOT_COUNTS],
}


WRONG_NUMBERS = [np.array(k, dtype=np.int32) for k in ([0, 1, 2], [0, 0, -1], [0, 1, 2**31 - 1])]
WRONG |= {
    "rows of points": shapes_like(np.zeros((4, 3))),
    "rows of centers": [np.zeros((3, 3)), *shapes_like(np.zeros((2, 3)))],
    "radii": vectors(2),
    "half-spaces": [np.zeros((0, 4)), *shapes_like(np.zeros((1, 4)))],
    "numbers of samples": [*WRONG_NUMBERS, np.zeros(2, dtype=np.int32), np.zeros((3, 1), dtype=np.int32), *NOT_NUMBERS],
    "numbers of candidates": [*WRONG_NUMBERS, np.zeros(4, dtype=np.int32), *NOT_NUMBERS],
    "chosen": [*WRONG_NUMBERS, np.zeros((1, 1), dtype=np.int32), *NOT_NUMBERS],
    "few": [-1, 0, 1, *NOT_COUNTS],
    "shares": [np.full(3, x) for x in (*ENDLESS, -0.1, 1.1)] + [np.zeros((1, 3)), *NOT_NUMBERS],
}


WRONG |= {
    "any motion": WRONG["motion"][:-1],
    "center": [np.zeros(0), np.zeros(17), *vectors(2)[3:]],
    "experience": NOT_ROWS[:4] + NOT_ROWS[5:],
    "path id": [7, -1, -(2**31), *NOT_COUNTS],
    "arm of one": [1, *WRONG["arm"]],
    "any link": [3, -1, -(2**31), *NOT_COUNTS],
    "moving link": [0, 3, -1, -(2**31), *NOT_COUNTS],
    "protrusion": [math.nan, math.inf, -0.1, 1e300, *NOT_NUMBERS],
    "poses of hulls": [np.zeros((3, 4, 11)), np.zeros((3, 3, 12)), np.zeros((3, 12)), *NOT_NUMBERS]
    + [np.full((1, 2, 12), x) for x in ENDLESS],
    "vertices": [np.zeros((0, 3)), np.zeros((5000, 3)), np.zeros((4, 2)), np.zeros(3), *NOT_NUMBERS]
    + [np.full((4, 3), x) for x in ENDLESS],
    "slides": [np.zeros(0, dtype=bool), np.zeros(17, dtype=bool), np.zeros((2, 1), dtype=bool), *NOT_NUMBERS],
    "planes": [np.zeros((0, 4)), np.zeros((6, 3)), np.zeros(4), *NOT_NUMBERS] + [np.full((6, 4), x) for x in ENDLESS],
}
