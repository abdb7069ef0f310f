"""Fit of few spheres that cover a link and protrude little: a greedy set cover, then a proof, then its gaps closed.

Candidates are centres inside the link. A candidate's radius is its depth plus the allowed protrusion, so no chosen
sphere protrudes by more. Samples that few candidates cover count more. The gaps that the proof finds become samples of
the next fit. After some fits, further spheres close the gaps that are left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mmp_env.importing.cover_proof import protrusion, prove_cover
from mmp_env.importing.link_samples import CoverSamples
from mmp_env.importing.link_shape import LinkShape

GRID_M = 1e-5
"""Grid [m] of the numbers of a sphere. Radii are rounded up and the proof is of the rounded numbers."""
FINE_M = 0.005
"""Protrusion [m] that set `fine` has at most."""
_LARGE_M2, _MOST_TIMES = 0.6, 6.0
_SLACK = 0.05
"""Share of the protrusion by which a sphere reaches past the samples that it covers, so that gaps between are small."""
_FITS = 4
_MOST_ROUNDS = 60
_MOST_GAPS = 1200
_COARSE_M = 4e-4
_MOST_MISSED = 300
_BELOW = (0.1, 0.5, 0.9, 1.3)
"""Depths below a sample, in allowed protrusions, of candidates for it alone."""
_ROWS = 500
_CLIMBS, _TRIES = 2, 16
_COARSE_DETAIL = 0.2
_COARSEST_M, _FINEST_COARSE_M, _FINER = 0.1, 0.008, 0.7
_BASE_BUDGET = 16


def fine_protrusion(shape: LinkShape) -> float:
    """Returns the protrusion [m] that set `fine` may have: 5 mm, more for links of more than 0.6 m^2 such as torsos.

    The number of spheres grows with the surface and falls with the protrusion, which grows with the surface for that.
    """
    return FINE_M * float(np.clip(shape.areas.sum() / _LARGE_M2, 1.0, _MOST_TIMES))


class CoverError(ArithmeticError):
    """The gaps of a cover could not be closed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cover:
    """Spheres of a link: `centers` [s, 3] and `radii` [s] [m], and their largest `protrusion` [m]."""

    centers: Float[np.ndarray, "s 3"]
    radii: Float[np.ndarray, "s"]
    protrusion: float


def fit_cover(shape: LinkShape, allowed: float, *, seed: int = 0, fits: int = _FITS, detail: float = 1.0) -> Cover:
    """Returns a proved cover of a shape whose spheres protrude by at most `allowed` [m].

    `detail` scales the number of samples.

    Raises:
        CoverError: if gaps remain.
    """
    if len(shape.pieces) == 1 and len(shape.pieces[0].vertices) == 1:
        return _one_ball(shape)
    fit = _Fit(shape, allowed - 2 * GRID_M, np.random.default_rng(seed), detail)
    for k in range(fits):
        fit.start()
        fit.choose()
        fit.drop_idle()
        centers, radii = fit.rounded()
        gaps = prove_cover(shape, centers, radii, max(_COARSE_M, allowed / 20) if k < fits - 1 else _COARSE_M / 4)
        if not len(gaps.points):
            break
        fit.add_samples(gaps.points[np.argsort(-gaps.outside)], allowed / 6)
    for _ in range(_MOST_ROUNDS):
        centers, radii = fit.rounded()
        gaps = prove_cover(shape, centers, radii)
        if not len(gaps.points):
            return Cover(centers=centers, radii=radii, protrusion=protrusion(shape, centers, radii))
        fit.add_samples(gaps.points[np.argsort(-gaps.outside)], allowed / 3)
        fit.choose()
    gaps = prove_cover(shape, *fit.rounded())
    raise CoverError(f"{len(gaps.points)} gaps remain, up to {gaps.uncovered_mm:.3g} mm")


def _one_ball(shape: LinkShape) -> Cover:
    """The cover of a ball."""
    (piece,) = shape.pieces
    centers, radii = _rounded(piece.vertices, np.array([piece.radius + 2 * GRID_M]))
    return Cover(centers=centers, radii=radii, protrusion=protrusion(shape, centers, radii))


def _rounded(centers: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Spheres on the grid, radii rounded up."""
    centers = np.round(np.round(centers / GRID_M) * GRID_M, 5) + 0.0
    return centers, np.round(np.ceil(radii / GRID_M + 1e-6) * GRID_M, 5)


def coarse_covers(shapes: Sequence[LinkShape | None], budget: int) -> list[Cover | None]:
    """Returns covers of about `budget` spheres in all, the first (the base's) not counted.

    The spheres of the link that protrudes most are made to protrude less, while the number of spheres allows it.
    """
    solid = [k for k, shape in enumerate(shapes) if shape is not None]
    allowed = dict.fromkeys(solid, _COARSEST_M)

    def fitted(k: int) -> Cover:
        shape = shapes[k]
        assert shape is not None
        return fit_cover(shape, allowed[k], fits=1, detail=_COARSE_DETAIL)

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

    def __init__(self, shape: LinkShape, allowed: float, random: np.random.Generator, detail: float) -> None:
        self.shape, self.allowed, self.random = shape, allowed, random
        drawn = CoverSamples(shape, allowed, random, detail)
        self._points, self._thick = drawn.points, drawn.thick
        self._centers, self._radii = self._candidates(drawn.centers)
        self._reach = self._reached(self._points, self._thick, self._centers, self._radii)
        self._add_candidates_for_missed()
        self.start()

    def start(self) -> None:
        """Forgets the spheres."""
        self.centers, self.radii = np.empty((0, 3)), np.empty(0)

    def choose(self) -> None:
        """Adds spheres until all samples are covered."""
        count = self._reach.sum(axis=1)
        weight = (1.0 / np.maximum(count, 1.0)).astype(np.float32)
        left = ~self._covered()
        gain = self._weighed(weight, left)
        while left.any():
            best = int(gain.argmax())
            if gain[best] <= 1e-7:
                break
            center, radius = self._climbed(best, left, weight)
            rows = np.flatnonzero(left)
            done = np.zeros_like(left)
            done[rows] = self._reached(self._points[rows], self._thick[rows], center[None], np.array([radius]))[:, 0]
            if not done.any():
                gain[best] = 0.0
                continue
            self.centers = np.concatenate([self.centers, center[None]])
            self.radii = np.append(self.radii, radius)
            gain -= self._weighed(weight, done)
            left &= ~done

    def _weighed(self, weight: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Sum of the weights of the chosen samples that each candidate covers."""
        rows = np.flatnonzero(chosen)
        out = np.zeros(self._reach.shape[1], dtype=np.float32)
        for k in range(0, len(rows), _ROWS):
            out += weight[rows[k : k + _ROWS]] @ self._reach[rows[k : k + _ROWS]].astype(np.float32)
        return out

    def drop_idle(self) -> None:
        """Removes spheres whose samples are all covered by others, the smallest first."""
        reach = self._reached(self._points, self._thick, self.centers, self.radii)
        count = reach.sum(axis=1)
        keep = np.ones(len(self.radii), dtype=bool)
        for k in np.argsort(self.radii):
            if (count[reach[:, k]] > 1).all():
                keep[k] = False
                count = count - reach[:, k]
        self.centers, self.radii = self.centers[keep], self.radii[keep]

    def add_samples(self, points: Float[np.ndarray, "n 3"], spacing: float) -> None:
        """Adds points on the surface, at most one in a cube of that size, the first ones first."""
        _, first = np.unique(np.floor(points / spacing), axis=0, return_index=True)
        points = points[np.sort(first)][:_MOST_GAPS]
        thick = np.full(len(points), float(self.shape.thickness.max()))
        self._points, self._thick = np.concatenate([self._points, points]), np.concatenate([self._thick, thick])
        rows = self._reached(points, thick, self._centers, self._radii)
        self._reach = np.concatenate([self._reach, rows])
        self._add_candidates_for_missed()

    def rounded(self) -> tuple[np.ndarray, np.ndarray]:
        """The spheres on the grid, radii rounded up."""
        return _rounded(self.centers, self.radii)

    def _covered(self) -> np.ndarray:
        if not len(self.radii):
            return np.zeros(len(self._points), dtype=bool)
        return np.asarray(self._reached(self._points, self._thick, self.centers, self.radii).any(axis=1))

    def _add_candidates_for_missed(self) -> None:
        """Adds candidates just below samples that no candidate covers, towards the middle of a piece: always inside."""
        while len(missed := np.flatnonzero(~self._reach.any(axis=1))):
            points = self._points[missed[:_MOST_MISSED]]
            out = []
            for k in self.shape.nearest_pieces(points):
                away = self.shape.middle(k) - points
                distance = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
                out += [points + away / distance * np.minimum(t * self.allowed, distance) for t in _BELOW]
            centers, radii = self._candidates(np.concatenate(out))
            useful = self._reached(points, self._thick[missed[:_MOST_MISSED]], centers, radii).any(axis=0)
            centers, radii = centers[useful], radii[useful]
            if not len(radii):
                return
            rows = self._reached(self._points, self._thick, centers, radii)
            self._centers, self._radii = np.concatenate([self._centers, centers]), np.concatenate([self._radii, radii])
            self._reach = np.concatenate([self._reach, rows], axis=1)

    def _candidates(self, pool: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        depth = self.shape.depth(pool)
        good = depth > 0
        return pool[good], depth[good] + self.allowed

    def _reached(self, points: np.ndarray, thick: np.ndarray, centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """Which spheres [c] contain which samples [n] with their thickness and slack: [n, c]."""
        # Single precision about a point nearby: its error is far below the slack, and the proof uses double.
        middle = self.shape.middle(0)
        points, centers = (points - middle).astype(np.float32), (centers - middle).astype(np.float32)
        reach = radii.astype(np.float32)
        thick = (thick + _SLACK * self.allowed).astype(np.float32)
        offset = np.einsum("ij,ij->i", centers, centers)
        out = np.empty((len(points), len(centers)), dtype=bool)
        for k in range(0, len(points), _ROWS):
            part = points[k : k + _ROWS]
            squares = part @ (-2 * centers.T)
            squares += np.einsum("ij,ij->i", part, part)[:, None]
            squares += offset
            room = np.maximum(reach - thick[k : k + _ROWS, None], 0)
            room *= room
            np.less_equal(squares, room, out=out[k : k + _ROWS])
        return out

    def _climbed(self, best: int, left: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, float]:
        """A sphere near a candidate that covers more."""
        center, radius = self._centers[best], float(self._radii[best])
        near = left & (np.linalg.norm(self._points - center, axis=1) < radius + self.allowed)
        points, thick, weight = self._points[near], self._thick[near], weight[near]
        worth = float(weight @ self._reached(points, thick, center[None], np.array([radius]))[:, 0])
        for climb in range(_CLIMBS):
            tries = center + self.random.normal(size=(_TRIES, 3)) * self.allowed * 0.5 / 2**climb
            centers, radii = self._candidates(tries)
            if not len(radii):
                continue
            found = weight @ self._reached(points, thick, centers, radii)
            k = int(found.argmax())
            if found[k] > worth:
                center, radius, worth = centers[k], float(radii[k]), float(found[k])
        return center, radius
