"""A valid call of every function of the native core, and wrong values for each kind of argument.

The program `core_calls.py NAME` makes every wrong call of one function. It prints a JSON line with the arguments
before each call, and one with the exception's name and text after it. A crash ends the lines early.
"""

from __future__ import annotations

import json
import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
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


BALLS = {
    "points": (np.arange(12.0).reshape(4, 3), "rows of points"),
    "centers": (np.zeros((2, 3)), "rows of centers"),
    "radii": (np.array([1.0, 2.0]), "radii"),
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


@dataclass(frozen=True, kw_only=True)
class Call:
    """A function to call. `arguments`: name -> (a valid value, the kind of argument, which names wrong values)."""

    of: Callable[..., Any]
    arguments: dict[str, tuple[Any, str]]

    @property
    def valid(self) -> dict[str, Any]:
        return {name: value for name, (value, _) in self.arguments.items()}


def call(of: Callable[..., Any], **arguments: tuple[Any, str]) -> Call:
    return Call(of=of, arguments=arguments)


def in_cell(of: Callable[..., Any], **arguments: tuple[Any, str]) -> Call:
    return call(of, cell=(CELL, "cell"), **arguments)


LEVELS = {"levels": (MARGINS, "levels")}
WINDOW = {"start": (0.0, "window start"), "end": (1.0, "window end")}
ARM = {"arm": (0, "arm")}
SEED = {"seed": (1, "seed")}
TIMED = {"clock": (CLOCK, "clock")}
OF_CELL = {
    "add_arm": {name: (value, name) for name, value in arm_at(0.0).items()}
    | {"tool": (arm_at(0.0)["tool"], "pose")}
    | {name: (arm_at(0.0)[name], "limits") for name in ("lower", "upper")},
    "add_obstacle": {name: (value, name) for name, value in obstacle().items()},
    "add_hull": {
        "arm": (0, "arm of one"),
        "link": (2, "any link"),
        "vertices": (hull()["vertices"], "vertices"),
        "radius": (0.01, "not negative"),
        "protrusion": (0.2, "protrusion"),
    },
    "add_hull_obstacle": {
        "vertices": (hull_obstacle()["vertices"], "vertices"),
        "planes": (hull_obstacle()["planes"], "planes"),
        "radius": (0.0, "not negative"),
    },
}
TWO_ROWS = ([ROWS, ROWS], "some rows of each")
TWO_GOALS = ([ROWS[-1:], ROWS[-1:]], "rows of each goal")
TWO_STEPS = ([STEPS, STEPS], "steps of each")

CALLS = {
    "SingleArmSettings.__init__": call(
        core.SingleArmSettings,
        max_iterations=(10, "count"),
        improve_iterations=(0, "count"),
        shortcuts=(1, "count"),
        goal_bias=(0.1, "share"),
        neighbours=(6, "count"),
    ),
    "RepulsionSettings.__init__": call(
        core.RepulsionSettings,
        k_rep=(1.0, "not negative"),
        d0=(0.1, "positive"),
        centre_distance=(False, "flag"),
        alpha=(0.01, "number"),
        max_iterations=(3, "count"),
        normalised=(False, "flag"),
        normalised_step=(0.1, "not negative"),
        max_step=(0.1, "not negative"),
        comfort=(0.1, "number"),
    ),
    "CompositeSettings.__init__": call(core.CompositeSettings, range=(2.0, "sampling"), step=(0.05, "sampling")),
    "ShortcutSettings.__init__": call(
        core.ShortcutSettings, attempts=(10, "count"), min_saving=(0.01, "positive share")
    ),
    "cpu_level": call(core.cpu_level),
    "Clock.__init__": call(core.Clock, seconds=(1.0, "seconds")),
    "Clock.cancel": call(lambda: core.Clock(1.0).cancel()),
    "Clock.reserve": call(core.Clock(1.0).reserve, seconds=(1.0, "seconds")),
    "Levels.__init__": call(
        core.Levels,
        margin=(0.002, "number"),
        proof=(0.0015, "number"),
        obstacles=(0.0, "number"),
        own=(0.0, "number"),
        upright=(0.0, "number"),
    ),
    "Cell.__init__": call(core.Cell),
    "Cell.add_arm": call(lambda **given: core.Cell().add_arm(**given), **OF_CELL["add_arm"]),
    "Cell.add_obstacle": call(lambda **given: core.Cell().add_obstacle(**given), **OF_CELL["add_obstacle"]),
    "Cell.add_hull": call(lambda **given: one_arm().add_hull(**given), **OF_CELL["add_hull"]),
    "Cell.add_hull_obstacle": call(
        lambda **given: one_arm().add_hull_obstacle(**given), **OF_CELL["add_hull_obstacle"]
    ),
    "Cell.let_touch": call(
        lambda **given: two_arms(frozen=False).let_touch(**given),
        obstacle=(0, "arm of one"),
        arm=(0, "arm"),
        link=(1, "moving link"),
    ),
    "Cell.freeze": call(lambda: two_arms(frozen=False).freeze()),
    "spheres": in_cell(core.spheres, **ARM, q=(ROWS, "rows")),
    "sphere_table": in_cell(core.sphere_table, **ARM),
    "deepest_balls": call(core.deepest_balls, **BALLS),
    "points_in_balls": call(core.points_in_balls, **BALLS, depth=(np.zeros(4), "limits of four")),
    "plane_depths": call(
        core.plane_depths, points=BALLS["points"], planes=(np.array([[0.0, 0.0, 1.0, 0.5]]), "half-spaces")
    ),
    "small_cover": call(
        core.small_cover,
        samples=(np.array([0, 1, 1], dtype=np.int32), "numbers of samples"),
        candidates=(np.array([0, 0, 1], dtype=np.int32), "numbers of candidates"),
        sample_count=(2, "few"),
        candidate_count=(2, "few"),
        chosen=(np.array([1], dtype=np.int32), "chosen"),
        draws=(np.array([0.2, 0.7, 1.0]), "shares"),
    ),
    "solve_six_hinges": call(
        core.solve_six_hinges,
        axes=(SIX_AXES, "six axes"),
        offsets=(SIX_OFFSETS, "six offsets"),
        poses=(POSES, "poses"),
        spherical=(False, "flag"),
        miss=(0.05, "not negative"),
    ),
    "refine_tool_pose": call(
        core.refine_tool_pose,
        **THREE,
        rows=(3, "task rows"),
        q=(THREE_ROWS, "rows of three"),
        poses=(POSES, "poses"),
        steps=(10, "count"),
        farthest=(10.0, "not negative"),
    ),
    "self_motions": call(
        core.self_motions,
        axes=(np.eye(3)[[2, 1, 1, 1]].copy(), "matrix of three"),
        offsets=(np.array([[0, 0, 0.1], [0, 0, 0.1], [0, 0, 0.4], [0, 0, 0.4], [0, 0, 0.3]]), "chain offsets"),
        slides=(np.zeros(4, dtype=bool), "flags of three"),
        tool=(np.eye(3), "matrix of three"),
        rows=(3, "task rows of three"),
        q=(np.array([[0.1, 0.2, 0.3, 0.4]]), "rows of three"),
        pose=(POSES[0], "one pose"),
        lower=(np.full(4, -3.0), "limits of four"),
        upper=(np.full(4, 3.0), "limits of four"),
        step=(0.1, "curve step"),
    ),
    "with_turns": call(
        core.with_turns,
        q=(THREE_ROWS, "rows of three"),
        lower=(np.full(3, -6.0), "limits of three"),
        upper=(np.full(3, 6.0), "turns"),
        hinges=(np.ones(3, dtype=bool), "flags of three"),
        near=(np.zeros(3), "limits of three"),
        limit=(10, "positive count"),
    ),
    "hull_distances": call(
        core.hull_distances,
        a=(hull()["vertices"], "vertices"),
        b=(hull_obstacle()["vertices"], "vertices"),
        poses=(np.tile(np.eye(4)[:3].ravel(), (3, 4, 1)), "poses of hulls"),
        radius_a=(0.01, "not negative"),
        radius_b=(0.0, "not negative"),
    ),
    "tool_points": in_cell(core.tool_points, **ARM, q=(ROWS, "rows")),
    "static_clearance": in_cell(core.static_clearance, **ARM, q=(ROWS, "rows"), precise=(True, "flag")),
    "pair_clearance": in_cell(
        core.pair_clearance, a=(0, "arm"), qa=(ROWS, "rows"), b=(1, "arm"), qb=(ROWS, "rows"), precise=(True, "flag")
    ),
    "swept_clearance": in_cell(
        core.swept_clearance,
        **ARM,
        q=(ROWS, "rows of a line"),
        **{name: (value, name) for name, value in obstacle().items()},
        stray=(0.0, "not negative"),
    ),
    "cell_clearance": in_cell(core.cell_clearance, q=([ROWS, ROWS], "rows of each"), obstacles=(True, "flag")),
    "nearest_bodies": in_cell(core.nearest_bodies, q=([FIRST, FIRST], "q of each")),
    "keep_upright": call(
        lambda **given: core.keep_upright(one_arm(), **given),
        arm=(0, "arm of one"),
        axis=(np.array([0.0, 0.0, 1.0]), "axis"),
        within=(0.2, "upright angle"),
    ),
    "tool_axes": call(core.tool_axes, cell=(UPRIGHT_CELL, "upright cell"), arm=(0, "arm of one"), q=(ROWS, "rows")),
    "project_upright": call(
        core.project_upright, cell=(UPRIGHT_CELL, "upright cell"), arm=(0, "arm of one"), q=(ROWS, "rows")
    ),
    "edges_free": in_cell(core.edges_free, **ARM, q_from=(ROWS, "rows"), q_to=(ROWS, "rows"), **LEVELS),
    "certify": in_cell(core.certify, q=TWO_ROWS, required=(MARGINS, "required"), share=(0.5, "share"), **TIMED),
    "Motion.__init__": in_cell(core.Motion, **ARM, q=(ROWS, "some rows")),
    "Motion.may_be_near": call(MOTION.may_be_near, other=(OTHER, "any motion"), distance=(0.01, "number")),
    "conflict_instants": in_cell(
        core.conflict_instants,
        motions=([MOTION, OTHER], "motions"),
        pairs=(np.array([[0, 1]], dtype=np.int32), "pairs"),
        **LEVELS,
        bases=(True, "flag"),
    ),
    "swept_conflicts": call(
        core.swept_conflicts,
        first=(MOTION, "any motion"),
        second=(OTHER, "any motion"),
        distance=(0.01, "number"),
    ),
    "Constraint.ball": call(core.Constraint.ball, center=(FIRST, "center"), radius=(0.1, "not negative"), **WINDOW),
    "Constraint.standing": in_cell(core.Constraint.standing, **ARM, q=(FIRST, "q"), shrink=(0.0, "number"), **WINDOW),
    "Constraint.moving": call(
        core.Constraint.moving, motion=(MOTION, "any motion"), start=(0.0, "whole step"), end=(1.0, "whole step")
    ),
    "Constraint.sphere": call(
        core.Constraint.sphere,
        center=(np.zeros(3), "point"),
        radius=(0.1, "not negative"),
        first_link=(1, "link"),
        **WINDOW,
    ),
    "safe_intervals": in_cell(
        core.safe_intervals,
        **ARM,
        q=(FIRST, "q"),
        constraints=([BALL], "constraints"),
        **LEVELS,
        others=([OTHER], "others"),
    ),
    "SingleArm.__init__": in_cell(
        core.SingleArm,
        **ARM,
        start=(FIRST, "q"),
        goals=(ROWS[-1:], "some rows"),
        max_step=(STEPS, "steps"),
        **LEVELS,
        **SEED,
        eta=(0.8, "sampling"),
    ),
    "SingleArm.plan": call(
        lambda **given: search().plan(**given),
        constraints=([BALL], "constraints"),
        **SEED,
        **TIMED,
        settings=(core.SingleArmSettings(max_iterations=10), "single-arm settings"),
        others=([OTHER], "others"),
        experience=(ROWS, "experience"),
    ),
    "repulsive_force": in_cell(
        core.repulsive_force,
        motion=(MOTION, "motion"),
        others=([OTHER], "others"),
        settings=(core.RepulsionSettings(), "repulsion settings"),
    ),
    "modify_motion": in_cell(
        core.modify_motion,
        motion=(MOTION, "motion"),
        others=([OTHER], "others"),
        constraints=([BALL], "constraints"),
        max_step_rad=(STEPS, "steps"),
        **LEVELS,
        constraint_margin=(0.002, "number"),
        settings=(core.RepulsionSettings(max_iterations=3), "repulsion settings"),
        **TIMED,
        trace=(True, "flag"),
    ),
    "breaks_constraint": in_cell(
        core.breaks_constraint,
        motion=(MOTION, "motion"),
        constraints=([BALL], "constraints"),
        margin=(0.002, "number"),
    ),
    "CompositeSearch.__init__": in_cell(
        core.CompositeSearch,
        start=(np.zeros(4), "all joints"),
        goals=(np.ones((2, 4)), "rows of all joints"),
        samples=(MARGINS, "levels"),
        edges=(MARGINS, "levels"),
        **SEED,
        settings=(core.CompositeSettings(), "composite settings"),
    ),
    "CompositeSearch.grow": call(lambda **given: composite().grow(**given), iterations=(10, "count"), **TIMED),
    "GroupSearch.__init__": in_cell(
        core.GroupSearch,
        start=(np.zeros(4), "all joints"),
        goal=(np.ones(4), "all joints"),
        samples=(MARGINS, "levels"),
        edges=(MARGINS, "levels"),
        **SEED,
        settings=(core.CompositeSettings(), "composite settings"),
        most=(2, "positive count"),
    ),
    "GroupSearch.grow": call(lambda **given: groups().grow(**given), iterations=(10, "count"), **TIMED),
    "shortcut": in_cell(
        core.shortcut,
        q=TWO_ROWS,
        max_step=TWO_STEPS,
        goals=TWO_GOALS,
        **LEVELS,
        groups=([0, 0], "groups"),
        settings=(core.ShortcutSettings(attempts=10), "shortcut settings"),
        **SEED,
        **TIMED,
    ),
    "replan": in_cell(
        core.replan, q=TWO_ROWS, max_step=TWO_STEPS, goals=TWO_GOALS, **LEVELS, attempts=(3, "count"), **SEED, **TIMED
    ),
    "remove_waits": in_cell(core.remove_waits, q=TWO_ROWS, max_velocity=TWO_STEPS, distance=(0.01, "number"), **TIMED),
    "PathRecombination.__init__": in_cell(core.PathRecombination, max_step=TWO_STEPS, **LEVELS),
    "PathRecombination.add": call(lambda **given: pool().add(**given), q=([ROWS, ROWS], "path of each")),
    "PathRecombination.has": call(lambda **given: pool().has(**given), path_ids=([0, 1], "any path ids")),
    "PathRecombination.shortest": call(lambda: pool().shortest()),
    "PathRecombination.path": call(lambda **given: pool().path(**given), **ARM, path_id=(0, "path id")),
    "PathRecombination.infeasible_pairs": call(
        lambda **given: pool().infeasible_pairs(**given), path_ids=([0, 1], "path ids"), **TIMED
    ),
    "PathRecombination.recombine": call(lambda **given: pool().recombine(**given), limit=(100.0, "limit"), **TIMED),
    "search_tree": call(
        lambda **given: core.search_tree(**given),
        arm=(search(), "search"),
        others=([OTHER], "others"),
        **SEED,
        **TIMED,
        iterations=(10, "count"),
    ),
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


def outcome(of: Callable[[], Any]) -> str:
    """Returns `returned`, or the exception's name and text."""
    try:
        of()
    except Exception as exception:
        return f"{type(exception).__name__}: {exception}".splitlines()[0]
    return "returned"


def of_unmade_object(name: str, chosen: Call) -> list[tuple[str, Callable[[], Any]]]:
    """Returns calls of a method, or of the properties, of an object that was never initialised."""
    owner, _, method = name.rpartition(".")
    if not owner or owner == "Constraint":
        return []
    kind = getattr(core, owner)
    if method != "__init__":
        return [("self", partial(getattr(kind, method), unmade(kind), **chosen.valid))]
    return [
        (key, partial(getattr, unmade(kind), key)) for key, value in vars(kind).items() if isinstance(value, property)
    ]


def main() -> None:
    """Prints the outcome of the valid call, and of each call with one wrong argument."""
    warnings.simplefilter("ignore")  # nanobind warns about objects that were never initialised
    chosen = CALLS[sys.argv[1]]
    tries = [("valid", lambda: chosen.of(**chosen.valid))]
    for name, (_, kind) in chosen.arguments.items():
        for value in WRONG[kind]:
            tries.append((f"{name} = {value!r}", partial(chosen.of, **(chosen.valid | {name: value}))))
    tries += of_unmade_object(sys.argv[1], chosen)
    for what, of in tries:
        print(json.dumps({"try": what}), flush=True)
        print(json.dumps({"outcome": outcome(of)}), flush=True)


if __name__ == "__main__":
    main()
