"""Conflict intervals between the paths of a node, with the point of contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.model.collision import KEEP_MARGIN_FACTOR, SEARCH_MARGIN_FACTOR
from mmp_env.model.conflict import unbroken_runs
from mmp_env.model.problem import Problem
from mmp_env.view.rerun.sphere_clouds import sphere_cloud, sphere_gaps


@dataclass(frozen=True, kw_only=True, eq=False)
class ConflictInterval:
    """Two arms, too close to each other from step `first` to `last`, and closest at `step`, around `point` [m]."""

    arm_a: str
    arm_b: str
    first: float
    last: float
    step: float
    point: Float[np.ndarray, "3"]
    depth_m: float


class ConflictFinder:
    """Finds the conflict intervals of nodes. It computes the motion of a path that many nodes share once."""

    def __init__(self, problem: Problem) -> None:
        self._problem, self._model = problem, problem.cell.collision
        self._motions: dict[int, tuple[np.ndarray, core.Motion]] = {}

    def __call__(self, paths: Mapping[str, Float[np.ndarray, "k dof"]]) -> list[ConflictInterval]:
        """Returns the conflict intervals between `paths`, arm -> [k, dof] [rad], earliest first."""
        names = list(paths)
        motions = [self._motion(name, paths[name]) for name in names]
        pairs = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names))]
        found = self._model.conflict_instants(
            motions, pairs, self._problem.levels(SEARCH_MARGIN_FACTOR, KEEP_MARGIN_FACTOR)
        )
        out = [
            self._interval(names[i], names[j], paths, run)
            for (i, j), instants in zip(pairs, found, strict=True)
            for run in unbroken_runs(instants)
        ]
        return sorted(out, key=lambda interval: (interval.first, interval.arm_a, interval.arm_b))

    def _motion(self, name: str, path: Float[np.ndarray, "k dof"]) -> core.Motion:
        if id(path) not in self._motions:  # keeping the path keeps its id unique
            self._motions[id(path)] = path, self._model.motion(name, path)
        return self._motions[id(path)][1]

    def _interval(
        self, a: str, b: str, paths: Mapping[str, Float[np.ndarray, "k dof"]], run: Float[np.ndarray, "c"]
    ) -> ConflictInterval:
        one, other = (sphere_cloud(self._problem.cell, x, configurations_at(paths[x], run)) for x in (a, b))
        gaps = sphere_gaps(one, other)
        deepest, i, j = (int(k) for k in np.unravel_index(int(np.argmin(gaps)), gaps.shape))
        gap, start, end = float(gaps[deepest, i, j]), one.centers[deepest, i], other.centers[deepest, j]
        length = max(float(np.linalg.norm(end - start)), 1e-9)
        point = start + (end - start) * (one.radii[i] + gap / 2) / length
        return ConflictInterval(
            arm_a=a,
            arm_b=b,
            first=float(run[0]),
            last=float(run[-1]),
            step=float(run[deepest]),
            point=point,
            depth_m=-gap,
        )


def configurations_at(path: Float[np.ndarray, "k dof"], steps: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n dof"]:
    """Returns the configurations of an arm at times counted in steps; after the last row the arm stays there."""
    steps = np.minimum(steps, len(path) - 1)
    before = np.minimum(steps.astype(int), max(len(path) - 2, 0))
    after = np.minimum(before + 1, len(path) - 1)
    return path[before] + (steps - before)[:, None] * (path[after] - path[before])
