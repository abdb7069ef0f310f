"""Fit of few spheres that cover a link and protrude little: a greedy set cover, then a proof, then its gaps closed.

Candidates are centres inside the link. A candidate's radius is its depth plus the allowed protrusion, so no chosen
sphere protrudes by more. Samples that few candidates cover count more. The gaps that the proof finds become samples of
the next fit. After some fits, further spheres close the gaps that are left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_env.importing.cover_proof import protrusion, prove_cover
from mmp_env.importing.link_samples import CoverSamples, one_in_each_cube
from mmp_env.importing.link_shape import LinkShape

GRID_M = 1e-5
"""Grid [m] of the numbers of a sphere. Radii are rounded up and the proof is of the rounded numbers."""
FINE_M = 0.005
"""Protrusion [m] that set `fine` has at most."""
_SLACK = 0.02
"""Share of the protrusion by which a sphere reaches past the samples that it covers, so that gaps between are small."""
_MOST_ROUNDS = 60
"""Largest number of rounds that close gaps."""
_MOST_OPEN = 0.25
"""Largest share of the surface that may be open after the candidates are chosen, if the proof ended early."""
_MOST_LEFT = 0.8
"""Largest ratio of the area of the gaps to that of the round before. Above it the fit ends if the proof ended early."""
_TOO_LARGE = "the surface is too large, or has too many details, for the proof; split the body or simplify its shape"
_STALE = 2
"""Number of rounds without a smaller cover after which no further candidates are tried."""
_MOST_GAPS, _MOST_SHARE = 1200, 0.25
"""Largest number of gaps that become samples in a round: that, or a share of the samples there are."""
_COARSE_M = 4e-4
_MOST_MISSED = 300
_BELOW = (0.1, 0.5, 0.9, 1.3)
"""Depths below a sample, in allowed protrusions, of candidates for it alone."""
_MOST_CANDIDATES = 3000
_TRIES = 6
"""Number of new candidates near each chosen sphere in a round."""
_COARSEST_M, _FINEST_COARSE_M, _FINER = 0.1, 0.008, 0.7
_BASE_BUDGET = 16


class CoverError(ArithmeticError):
    """The gaps of a cover could not be closed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cover:
    """Spheres of a link: `centers` [s, 3] and `radii` [s] [m], and their largest `protrusion` [m]."""

    centers: Float[np.ndarray, "s 3"]
    radii: Float[np.ndarray, "s"]
    protrusion: float


@dataclass(frozen=True, kw_only=True)
class FitEffort:
    """Effort of a fit: a factor of the number of samples, rounds of new candidates, and search steps in each round."""

    detail: float = 0.7
    rounds: int = 8
    steps: int = 300


FINE_EFFORT = FitEffort()
"""Effort for covers that are fitted once."""
COARSE_EFFORT = FitEffort(detail=0.15, rounds=1, steps=15)
"""Effort for covers that are fitted many times until their number of spheres is right."""


def fit_cover(shape: LinkShape, allowed: float, *, seed: int = 0, effort: FitEffort = FINE_EFFORT) -> Cover:
    """Returns a proved cover of a shape whose spheres protrude by at most `allowed` [m].

    Raises:
        CoverError: if gaps remain, or the surface is too large for a proof.
    """
    if len(shape.pieces) == 1 and len(shape.pieces[0].vertices) == 1:
        return _one_ball(shape)
    fit = _Fit(shape, allowed - 2 * GRID_M, seed, effort.detail)
    counts, gaps = [], None
    for _ in range(effort.rounds):
        fit.choose(effort.steps)
        gaps = prove_cover(shape, *fit.rounded(), max(_COARSE_M, allowed / 10))
        fit.add_samples(gaps.points[np.argsort(-gaps.outside)], allowed / 6)
        counts.append(len(fit.rounded()[1]))
        if len(counts) == effort.rounds or (len(counts) > _STALE and counts[-1] >= counts[-1 - _STALE]):
            break
        fit.add_neighbours()
    assert gaps is not None
    before = gaps.area if gaps.budget_spent else math.inf
    if gaps.budget_spent and gaps.area > _MOST_OPEN * shape.areas.sum():
        raise CoverError(_TOO_LARGE)
    for k in range(_MOST_ROUNDS):
        fit.choose(effort.steps // (k + 1))
        centers, radii = fit.rounded()
        gaps = prove_cover(shape, centers, radii)
        if not len(gaps.points):
            return Cover(centers=centers, radii=radii, protrusion=protrusion(shape, centers, radii))
        if gaps.budget_spent and gaps.area > _MOST_LEFT * before:
            raise CoverError(_TOO_LARGE)
        before = gaps.area
        fit.add_samples(gaps.points[np.argsort(-gaps.outside)], allowed / 6)
    raise CoverError(f"{len(gaps.points)} gaps remain, up to {gaps.uncovered_mm:.3g} mm")


def _one_ball(shape: LinkShape) -> Cover:
    """The cover of a ball."""
    (piece,) = shape.pieces
    centers, radii = _rounded(piece.vertices, np.array([piece.radius + 2 * GRID_M]))
    return Cover(centers=centers, radii=radii, protrusion=protrusion(shape, centers, radii))


def _rounded(centers: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Spheres on the grid, radii rounded up."""
    return _on_grid(centers), np.round(np.ceil(radii / GRID_M + 1e-6) * GRID_M, 5)


def _on_grid(points: np.ndarray) -> np.ndarray:
    return np.round(np.round(points / GRID_M) * GRID_M, 5) + 0.0


def fit_coarse_cover(shape: LinkShape, allowed: float) -> Cover:
    """Returns a cover of a shape with little effort, see `fit_cover`. Raises `CoverError`."""
    return fit_cover(shape, allowed, effort=COARSE_EFFORT)


def coarse_covers(
    shapes: Sequence[LinkShape | None], budget: int, fit: Callable[[LinkShape, float], Cover] = fit_coarse_cover
) -> list[Cover | None]:
    """Returns covers of about `budget` spheres in all, the first (the base's) not counted.

    The spheres of the link that protrudes most are made to protrude less, while the number of spheres allows it.
    `fit` is `fit_coarse_cover`, or one that remembers its results.
    """
    solid = [k for k, shape in enumerate(shapes) if shape is not None]
    allowed = dict.fromkeys(solid, _COARSEST_M)

    def fitted(k: int) -> Cover:
        shape = shapes[k]
        assert shape is not None
        return fit(shape, allowed[k])

    covers = {k: fitted(k) for k in solid}
    open_ = set(solid)
    while open_:
        k = max(open_, key=lambda link: (covers[link].protrusion, link))
        before = allowed[k]
        allowed[k] = min(before, covers[k].protrusion) * _FINER
        cover = fitted(k)
        others = sum(len(covers[link].radii) for link in solid if link not in (0, k))
        room = _BASE_BUDGET if k == 0 else budget - others
        if len(cover.radii) <= room:
            covers[k] = cover
        else:
            allowed[k] = before
        if len(cover.radii) > room or allowed[k] < _FINEST_COARSE_M:
            open_.remove(k)
    return [covers.get(k) for k in range(len(shapes))]


class _Fit:
    """Samples, candidates, and the spheres chosen so far."""

    def __init__(self, shape: LinkShape, allowed: float, seed: int, detail: float) -> None:
        self.shape, self.allowed, self._seed = shape, allowed, seed
        self._random = np.random.default_rng(seed)
        drawn = CoverSamples(shape, allowed, self._random, detail)
        self._points, self._thick = drawn.points, drawn.thick
        self._centers, self._radii = self._candidates(drawn.centers)
        self._chosen = np.empty(0, dtype=np.int32)
        self._rows = self._columns = np.empty(0, dtype=np.int32)
        self._append(self._reached(self._points, self._thick, self._centers, self._radii), 0, 0)
        self._add_candidates_for_missed(np.arange(len(self._points)))

    def choose(self, steps: int) -> None:
        """Chooses few candidates that cover all samples."""
        self._chosen = core.small_cover(
            samples=self._rows,
            candidates=self._columns,
            sample_count=len(self._points),
            candidate_count=len(self._radii),
            chosen=self._chosen,
            draws=np.random.default_rng(self._seed).random(steps),
        )

    def add_samples(self, points: Float[np.ndarray, "n 3"], spacing: float) -> None:
        """Adds points on the surface, at most one in a cube of that size, the first ones first."""
        most = max(_MOST_GAPS, int(_MOST_SHARE * len(self._points)))
        points = points[np.sort(one_in_each_cube(points, spacing))][:most]
        thick = np.full(len(points), float(self.shape.thickness.max()))
        before = len(self._points)
        self._points, self._thick = np.concatenate([self._points, points]), np.concatenate([self._thick, thick])
        self._append(self._reached(points, thick, self._centers, self._radii), before, 0)
        self._add_candidates_for_missed(np.arange(before, len(self._points)))

    def add_neighbours(self) -> None:
        """Adds candidates near the chosen spheres and between those that are near each other; drops unused ones."""
        keep = np.union1d(self._chosen, self._random.permutation(len(self._radii))[:_MOST_CANDIDATES])
        number = np.full(len(self._radii), -1, dtype=np.int32)
        number[keep] = np.arange(len(keep))
        self._centers, self._radii, self._chosen = self._centers[keep], self._radii[keep], number[self._chosen]
        columns = number[self._columns]
        self._rows, self._columns = self._rows[columns >= 0], columns[columns >= 0]
        centers = self._centers[self._chosen]
        spread = np.repeat(self._random.uniform(0.1, 1.2, _TRIES), len(centers))[:, None] * self.allowed
        moved = np.tile(centers, (_TRIES, 1)) + self._random.normal(size=(_TRIES * len(centers), 3)) * spread
        away = np.linalg.norm(centers[:, None] - centers, axis=2)
        first, second = np.nonzero(np.triu(away < np.minimum.outer(*[self._radii[self._chosen]] * 2), 1))
        some = self._random.permutation(len(first))[: _TRIES * len(centers)]
        between = (centers[first[some]] + centers[second[some]]) / 2
        self._add_candidates(*self._candidates(np.concatenate([moved, between])))

    def rounded(self) -> tuple[np.ndarray, np.ndarray]:
        """The chosen spheres on the grid, radii rounded up."""
        return _rounded(self._centers[self._chosen], self._radii[self._chosen])

    def _append(self, reached: tuple[np.ndarray, np.ndarray], first_row: int, first_column: int) -> None:
        self._rows = np.concatenate([self._rows, reached[0] + np.int32(first_row)])
        self._columns = np.concatenate([self._columns, reached[1] + np.int32(first_column)])

    def _add_candidates(self, centers: np.ndarray, radii: np.ndarray) -> None:
        before = len(self._radii)
        self._centers, self._radii = np.concatenate([self._centers, centers]), np.concatenate([self._radii, radii])
        self._append(self._reached(self._points, self._thick, centers, radii), 0, before)

    def _add_candidates_for_missed(self, rows: np.ndarray) -> None:
        """Adds candidates just below samples that no candidate covers, towards the middle of a piece: always inside."""
        while True:
            covered = np.zeros(len(self._points), dtype=bool)
            covered[self._rows] = True
            missed = rows[~covered[rows]][:_MOST_MISSED]
            if not len(missed):
                return
            points, out = self._points[missed], []
            for k in self.shape.nearest_pieces(points):
                away = self.shape.middle(k) - points
                distance = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
                out += [points + away / distance * np.minimum(t * self.allowed, distance) for t in _BELOW]
            centers, radii = self._candidates(np.concatenate(out))
            useful = np.unique(self._reached(points, self._thick[missed], centers, radii)[1])
            if not len(useful):
                return
            self._add_candidates(centers[useful], radii[useful])

    def _candidates(self, pool: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pool = _on_grid(pool)
        depth = self.shape.depth(pool)
        good = depth > GRID_M
        return pool[good], depth[good] + self.allowed

    def _reached(
        self, points: np.ndarray, thick: np.ndarray, centers: np.ndarray, radii: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Which samples with their thickness and slack lie in which spheres: numbers of both."""
        return core.points_in_balls(points, thick + _SLACK * self.allowed, centers, radii)
