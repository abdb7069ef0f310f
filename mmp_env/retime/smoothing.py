"""The widths of blends, which tolerance, joint limits, other arms and obstacles narrow.

A blend is first wide enough to pass its corner at full speed. If the path then deviates too far, leaves joint limits or
comes too close to a body, the blends around that place are narrowed, finally to a stop at the corner. A path of stops
is the course itself, which is proved already.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from mmp_env import core
from mmp_env.model.cell import Cell
from mmp_env.model.problem import Problem
from mmp_env.retime.blends import BlendedPath
from mmp_env.retime.course import Course
from mmp_env.retime.limits import RateLimits, split
from mmp_env.retime.steps import Steps

CLEAR = 0.1
"""Share of the planning slack that a blended path keeps beyond the margin, a little more than its proof needs."""
_SPACING_S, _GAP_S = 0.01, 0.15
"""Spacing [s of phase] of tests in blends; largest gap between two blends of one run of tests."""
_MOST_LOOKS = 50_000
"""Largest number of tests on a path."""
_SLIGHT_RAD = 1e-4
"""Distance [rad] from its corner up to which the proof of the result alone tests a blend."""
_TURN_SHARE, _EDGE_SHARE = 0.75, 0.35
"""Shares of acceleration and jerk that a blend uses at full speed."""
_NARROWER, _NARROWEST = 0.4, 0.05
"""Factor of a step narrower; width, relative to the widest, below which a blend becomes a stop."""
_FITS, _INWARD = 6, 0.98
"""Number of steps that fit blends to the tolerance; share of the tolerance that they aim at."""
_TINY = 1e-12
_LEAST_S = 1e-4
"""Narrowest blend [s of phase]; a narrower one is as slow as a stop."""


def first_blends(course: Course, limits: RateLimits, tolerance: float) -> BlendedPath:
    """Returns blends for full speed at every corner, each within the course and within `tolerance` [rad] alone."""
    turn = np.abs(course.turns)
    width = (turn / (_TURN_SHARE * limits.acceleration)).max(axis=1, initial=0.0)
    width = np.maximum(width, np.sqrt((turn / (_EDGE_SHARE * limits.jerk)).max(axis=1, initial=0.0)))
    edge = (turn / (_EDGE_SHARE * limits.jerk)).max(axis=1, initial=0.0) / np.maximum(width, _TINY)
    path = BlendedPath(course=course, width=width, edge=np.minimum(edge, width))
    fits = np.minimum(_within_ends(path), _within_tolerance(path, tolerance))
    return path.narrower(np.where((fits < 1) & (fits * width < _LEAST_S), 0.0, np.minimum(fits, 1.0)))


def _within_ends(path: BlendedPath) -> Float[np.ndarray, "c"]:
    """Returns factors for `narrower` with which blends reach to the ends of the course: f w + sqrt(f) e = 2 room."""
    width, edge = np.maximum(path.width, _TINY), path.edge
    room = np.minimum(path.corners, path.course.end - path.corners)
    return ((np.sqrt(edge**2 + 8 * width * room) - edge) / (2 * width)) ** 2


def _within_tolerance(path: BlendedPath, tolerance: float) -> Float[np.ndarray, "c"]:
    """Returns factors with which blends miss their corners by `tolerance` [rad], with their edges or all edge."""
    width = np.maximum(path.width, _TINY)
    wanted = 8 * tolerance / np.maximum(np.abs(path.course.turns).max(axis=1), _TINY)
    return np.maximum(wanted - path.edge**2 / (3 * width), 0.75 * wanted) / width


def fitted(cell: Cell, path: BlendedPath, tolerance: float) -> Steps[BlendedPath]:
    """Narrows blends, in steps, until the path is within `tolerance` [rad] of its course and within joint limits.

    The first few times every blend narrows in proportion to the deviation around it, then step by step.
    """
    widest, fits = path.width, _FITS
    look = path.miss > min(_SLIGHT_RAD, tolerance / 10)  # slight ones never add up to the tolerance
    while look.any():
        phase = np.concatenate(_around(path, look))
        _, stray, beyond = _whereabouts(cell, path, phase)
        if fits > 0 and stray.max() > tolerance:
            first = np.searchsorted(phase, path.corners - path.reach)
            last = np.searchsorted(phase, path.corners + path.reach, side="right")
            most = [stray[a:b].max(initial=0.0) for a, b in zip(first, last, strict=True)]
            path = path.narrower(np.minimum(1.0, _INWARD * tolerance / np.maximum(most, _TINY)))
            fits -= 1
        else:
            look = covering(path, phase[(stray > tolerance) | beyond])
            path = narrowed(path, look, widest)
        yield
    return path


def smooth(problem: Problem, path: BlendedPath, tolerance: float) -> Steps[BlendedPath]:
    """Narrows blends, in steps, until a quick test finds the path clear."""
    widest = path.width
    look = path.miss > _SLIGHT_RAD
    while look.any():
        found = yield from troubles(problem, path, _around(path, look), tolerance)
        look = covering(path, found)
        path = narrowed(path, look, widest)
    return path


def covering(path: BlendedPath, phases: Float[np.ndarray, "m"]) -> Bool[np.ndarray, "c"]:
    """Returns the blends, without stops, that cover any of these phases."""
    there, reach = np.sort(phases), path.reach + _SPACING_S
    first, last = (
        np.searchsorted(there, path.corners - reach),
        np.searchsorted(there, path.corners + reach, side="right"),
    )
    return (last > first) & (path.width > 0)


def narrowed(path: BlendedPath, chosen: Bool[np.ndarray, "c"], widest: Float[np.ndarray, "c"]) -> BlendedPath:
    """Narrows the chosen blends by a step. One that is much narrower than `widest` becomes a stop."""
    factor = np.where(path.width * _NARROWER < np.maximum(_NARROWEST * widest, _LEAST_S), 0.0, _NARROWER)
    return path.narrower(np.where(chosen, factor, 1.0))


def deviation(path: BlendedPath, phase: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
    """Returns the distance [rad] of the path from its course, the largest of all joints."""
    return np.abs(path.off_course(phase)[0]).max(axis=1)


def troubles(
    problem: Problem, path: BlendedPath, runs: Sequence[Float[np.ndarray, "_"]], tolerance: float
) -> Steps[Float[np.ndarray, "m"]]:
    """Returns, in steps, the phases within these runs at which the path strays, leaves limits or is not clear."""
    phase = np.concatenate(runs)
    cell = problem.cell
    q, stray, beyond = _whereabouts(cell, path, phase)
    found = [phase[(stray > tolerance) | beyond]]
    pairs = np.array(list(itertools.combinations(range(len(cell.arms)), 2)), np.int32).reshape(-1, 2)
    by_arm, first = list(split(cell, q).values()), 0
    for run in runs:
        yield
        steps = _conflicts(problem, [rows[first : first + len(run)] for rows in by_arm], pairs)
        if len(steps):
            found.append(np.interp(steps, np.arange(len(run)), run))
        first += len(run)
    return np.concatenate(found)


def _whereabouts(
    cell: Cell, path: BlendedPath, phase: Float[np.ndarray, "t"]
) -> tuple[Float[np.ndarray, "t n"], Float[np.ndarray, "t"], Bool[np.ndarray, "t"]]:
    """Returns configurations [rad] at ascending phases, their distance [rad] from the course, and whether any joint
    is beyond its limits.
    """
    off = path.off_course(phase)[0]
    q = path.course.at(phase) + off
    lower, upper = (np.concatenate([getattr(arm.robot, key) for arm in cell.arms]) for key in ("lower", "upper"))
    return q, np.abs(off).max(axis=1), np.maximum(lower - q, q - upper).max(axis=1) > 0


def _conflicts(
    problem: Problem, rows: Sequence[Float[np.ndarray, "t _"]], pairs: Int[np.ndarray, "p 2"]
) -> Float[np.ndarray, "m"]:
    """Returns the rows, also between two, at which an arm is too close to a body."""
    compiled, clear = problem.cell.collision.core, problem.levels(CLEAR, CLEAR)
    motions = [core.Motion(compiled, k, part) for k, part in enumerate(rows)]
    found = list(core.conflict_instants(compiled, motions, pairs, clear))
    for k, part in enumerate(rows):
        free = core.edges_free(compiled, k, part[:-1], part[1:], clear)
        if not free.all():
            found.append(np.flatnonzero(~free) + 0.5)
    return np.concatenate([np.empty(0), *found])


def _around(path: BlendedPath, chosen: Bool[np.ndarray, "c"]) -> list[Float[np.ndarray, "_"]]:
    """Returns runs of phases that cover the chosen blends, one run for blends that are close to each other."""
    begin = (path.corners - path.reach)[chosen]
    end = (path.corners + path.reach)[chosen]
    order = np.argsort(begin)
    begin, end = begin[order], np.maximum.accumulate(end[order])
    cut = np.flatnonzero(begin[1:] > end[:-1] + _GAP_S)
    first, last = begin[np.append(0, cut + 1)], end[np.append(cut, -1)]
    breaks, spacing = path.breaks, max(_SPACING_S, path.course.end / _MOST_LOOKS)
    return [
        np.unique(np.concatenate([np.arange(a, b, spacing), breaks[(breaks > a) & (breaks < b)], [b]]))
        for a, b in zip(first, last, strict=True)
    ]
