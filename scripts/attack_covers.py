"""Attacks the fit of sphere covers: random links, protrusions and rotations, checked apart from fit and proof.

Usage: attack_covers.py ROBOT... [--covers N] [--points N] [--seed N]. A ROBOT is a name or the path of a robot folder.
Each cover must contain every vertex of its link's pieces and random points of their surfaces, but for points inside
another piece. It prints a JSON line for each robot; exit 1 if a point is outside.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env import MmpError
from mmp_env.importing.checked_files import read_robot_files
from mmp_env.importing.cover_fit import FitEffort, fit_cover
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import Piece
from mmp_env.robot_folders import find_robot

OUTSIDE_M = 1e-9
"""Distance [m] from the spheres up to which a point counts as inside, for rounding."""


def main() -> int:
    """Prints how many covers of each robot were tried and how many leave a point outside."""
    parser = Parser("attack_covers.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="+", metavar="ROBOT", help="name or folder of a robot")
    parser.add_argument("--covers", type=int, default=1000, metavar="N", help="covers of each robot (default: 1000)")
    parser.add_argument("--points", type=int, default=100_000, metavar="N", help="surface points (default: 100000)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random choices (default: 0)")
    args = parser.parse()
    failed = 0
    for name in args.robots:
        random = np.random.default_rng(args.seed)
        links = robot_pieces(name)
        worst = [attack(links[int(random.integers(len(links)))], args.points, random) for _ in range(args.covers)]
        wrong = sum(outside > OUTSIDE_M for outside in worst)
        failed += wrong
        line = {"robot": name, "covers": args.covers, "points": args.points, "wrong": wrong}
        print(json.dumps(line | {"worst_mm": max(0.0, max(worst)) * 1e3}), flush=True)
    return 1 if failed else 0


def robot_pieces(name: str) -> list[tuple[Piece, ...]]:
    """Returns the convex pieces of the links of a robot that have any. Raises `MmpError`."""
    folder, faults = find_robot(name) or Path(name), list[str]()
    files = read_robot_files(folder, faults)
    if files is None:
        raise MmpError("; ".join(faults))
    return [pieces for pieces in files.arm.pieces if pieces]


def attack(pieces: Sequence[Piece], count: int, random: np.random.Generator) -> float:
    """Returns how far [m] a vertex or surface point lies outside a cover of turned and moved pieces, at most."""
    turn, move = np.linalg.qr(random.normal(size=(3, 3)))[0], random.uniform(-1, 1, 3)
    turn *= np.sign(np.linalg.det(turn))  # a rotation, no reflection
    turned = [Piece(vertices=piece.vertices @ turn.T + move, radius=piece.radius) for piece in pieces]
    effort = FitEffort(
        detail=float(random.uniform(0.1, 0.7)), rounds=int(random.integers(1, 4)), steps=int(random.integers(20, 200))
    )
    allowed = float(np.exp(random.uniform(np.log(0.004), np.log(0.05))))
    cover = fit_cover(LinkShape(turned), allowed, seed=int(random.integers(1000)), effort=effort)
    worst = -np.inf
    for k, piece in enumerate(turned):
        points = surface_points(piece, max(1, count // len(turned)), random)
        outside = beyond_spheres(points, cover.centers, cover.radii)
        for other in turned[:k] + turned[k + 1 :]:
            outside[is_inside(points, other)] = -np.inf
        worst = max(worst, float(outside.max()))
    return worst


def surface_points(piece: Piece, count: int, random: np.random.Generator) -> Float[np.ndarray, "n 3"]:
    """Returns points of the surface of a piece: its vertices, and random points of faces, edges and corners."""
    directions = random.normal(size=(max(1, count // 4), 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    corners = piece.vertices[(piece.vertices @ directions.T).argmax(axis=0)] + piece.radius * directions
    if len(piece.vertices) == 1:
        return corners
    if len(piece.vertices) == 2:
        along = piece.vertices[1] - piece.vertices[0]
        flat = directions - np.outer(directions @ along, along) / (along @ along)
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        sides = piece.vertices[0] + random.random((len(flat), 1)) * along + piece.radius * flat
        return np.concatenate([corners, sides])
    hull = ConvexHull(piece.vertices)
    triangles = piece.vertices[hull.simplices]
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    chosen = random.choice(len(area), count, p=area / area.sum())
    shares = random.dirichlet(np.full(3, 0.5), count)  # more of them near edges and corners
    faces = np.einsum("nk,nkd->nd", shares, triangles[chosen]) + piece.radius * hull.equations[chosen, :3]
    return np.concatenate([piece.vertices, corners, faces])


def is_inside(points: Float[np.ndarray, "n 3"], piece: Piece) -> np.ndarray:
    """Returns which points lie inside a piece, those in its thickness not counted where it is a polytope."""
    if len(piece.vertices) <= 2:
        first, along = piece.vertices[0], piece.vertices[-1] - piece.vertices[0]
        share = np.clip((points - first) @ along / max(float(along @ along), 1e-30), 0, 1)
        return np.linalg.norm(points - first - np.outer(share, along), axis=1) < piece.radius
    planes = ConvexHull(piece.vertices).equations
    return np.array((points @ planes[:, :3].T + planes[:, 3]).max(axis=1) < 0)


def beyond_spheres(
    points: Float[np.ndarray, "n 3"], centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]
) -> Float[np.ndarray, "n"]:
    """Returns how far [m] each point lies outside the sphere that it is deepest in; negative inside."""
    out = np.full(len(points), np.inf)
    for center, radius in zip(centers, radii, strict=True):
        np.minimum(out, np.linalg.norm(points - center, axis=1) - radius, out=out)
    return out


if __name__ == "__main__":
    run_script(main)
