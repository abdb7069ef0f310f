"""The MJCF geoms of robots and tools: inside both sphere sets, filling the links, never a stick figure."""

import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mmp_env.model.robot import SPHERE_SETS
from mmp_env.model.robot_reading import load_robot, load_tool
from mmp_env.model.transforms import matrix_from_quaternion
from mmp_env.robot_folders import find_robot, robot_names, tool_names

OUTSIDE_M = 0.001
"""Largest protrusion [m] of a geom from its link's spheres."""
LEAST_FILL = 0.4
PAGE = Path(__file__).parents[3] / "docs" / "reference" / "robots.md"

MODELS = {
    name: load(name) for load, names in ((load_robot, robot_names()), (load_tool, tool_names())) for name in names
}
every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
every_robot = pytest.mark.parametrize("name", robot_names())

SHAPES = ("BOX", "SPHERE", "ELLIPSOID", "CYLINDER", "CAPSULE")
BOX, SPHERE, ELLIPSOID, CYLINDER, CAPSULE = (int(getattr(mujoco.mjtGeom, f"mjGEOM_{shape}")) for shape in SHAPES)


def directions(n=3000):
    """Returns evenly spread unit vectors [n, 3] (a Fibonacci lattice)."""
    z = 1 - (2 * np.arange(n) + 1) / n
    angle, ring = np.pi * (1 + 5**0.5) * np.arange(n), np.sqrt(1 - z**2)
    return np.c_[ring * np.cos(angle), ring * np.sin(angle), z]


def surface(kind, size, n=60):
    """Returns points on a geom of MuJoCo's conventions in its own frame, [points, 3] [m]."""
    if kind in (SPHERE, ELLIPSOID):
        return directions() * (size if kind == ELLIPSOID else size[0])
    if kind == BOX:
        u, v = (a.ravel() for a in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n)))
        faces = [np.roll(np.c_[np.full_like(u, side), u, v], axis, axis=1) for axis in range(3) for side in (-1, 1)]
        return np.concatenate(faces) * size
    radius, half = size[:2]
    angle, height = (a.ravel() for a in np.meshgrid(np.linspace(0, 2 * np.pi, 90), np.linspace(-half, half, 120)))
    side = np.c_[radius * np.cos(angle), radius * np.sin(angle), height]
    if kind == CAPSULE:
        ends = directions() * radius
        return np.concatenate([side, ends + np.sign(ends[:, 2:]) * [0, 0, half]])
    assert kind == CYLINDER
    angle, share = (a.ravel() for a in np.meshgrid(np.linspace(0, 2 * np.pi, 90), np.linspace(0, 1, 20)))
    disc = np.c_[radius * share * np.cos(angle), radius * share * np.sin(angle), np.zeros_like(angle)]
    end = np.array([0, 0, half])
    return np.concatenate([side, disc + end, disc - end])


def contains(kind, size, points):
    """Returns which of the points [n, 3], in the geom's frame, are inside it."""
    if kind == BOX:
        return (np.abs(points) <= size).all(axis=1)
    if kind in (SPHERE, ELLIPSOID):
        return ((points / (size if kind == ELLIPSOID else size[0])) ** 2).sum(axis=1) <= 1
    radius, half = size[:2]
    beyond = np.maximum(np.abs(points[:, 2]) - half, 0)
    across = np.hypot(points[:, 0], points[:, 1])
    return np.hypot(across, beyond) <= radius if kind == CAPSULE else (across <= radius) & (beyond == 0)


class LinkGeoms:
    """The geoms of one body of a compiled model; points and volumes in the body's frame."""

    def __init__(self, model, body):
        ids = np.flatnonzero(model.geom_bodyid == model.body(body).id)
        self.parts = [
            (model.geom_type[i], model.geom_size[i], matrix_from_quaternion(model.geom_quat[i]), model.geom_pos[i])
            for i in ids
        ]

    def surface(self):
        return np.concatenate([surface(kind, size) @ turn.T + at for kind, size, turn, at in self.parts])

    def volume(self):
        """Returns the volume [m^3] of the union, from 200,000 random points in its bounding box (error about 0.3 %)."""
        points = self.surface()
        low, high = points.min(axis=0), points.max(axis=0)
        tries = np.random.default_rng(0).uniform(low, high, (200_000, 3))
        hits = np.zeros(len(tries), bool)
        for kind, size, turn, at in self.parts:
            hits |= contains(kind, size, (tries - at) @ turn)
        return hits.mean() * np.prod(high - low)


def outside(points, centers, radii):
    """Returns the distance [m] of each point outside the union of the spheres, negative inside."""
    out = np.full(len(points), np.inf)
    for center, radius in zip(centers, radii, strict=True):
        out = np.minimum(out, np.linalg.norm(points - center, axis=1) - radius)
    return out


def bodies(model):
    return getattr(model, "link_names", (model.name,))


def compiled(model):
    return mujoco.MjModel.from_xml_string(model.mjcf)


@pytest.mark.parametrize("spheres", SPHERE_SETS)
@every_model
def test_no_geom_reaches_out_of_the_spheres_of_its_link(model, spheres):
    mjcf, cover = compiled(model), model.spheres[spheres]
    for link, body in enumerate(bodies(model)):
        own = cover.links == link
        points = LinkGeoms(mjcf, body).surface()
        assert outside(points, cover.centers[own], cover.radii[own]).max() <= OUTSIDE_M, body


@every_robot
def test_the_geoms_fill_each_link(name):
    robot = load_robot(name)
    hulls = json.loads((find_robot(robot.name) / "robot.json").read_text())["hull_volumes_m3"]
    mjcf = compiled(robot)
    fills = {link: LinkGeoms(mjcf, link).volume() / hulls[link] for link in robot.link_names}
    assert min(fills.values()) >= LEAST_FILL, fills
    assert max(fills.values()) <= 1, fills
    assert documented_fills(name) == {link: pytest.approx(fill, abs=0.011) for link, fill in fills.items()}


def documented_fills(name):
    """Returns link -> share from docs/reference/robots.md."""
    (table,) = re.findall(r"test_robot_geoms.py -->\n(.*?)<!-- end -->", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    head, _, *rows = ([cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines())
    at = head.index(f"`{name}`")
    return {row[at]: float(row[at + 1].removesuffix(" %")) / 100 for row in rows if row[at]}


@pytest.mark.parametrize("name", tool_names())
def test_the_geoms_of_a_tool_fill_its_fine_spheres(name):
    tool = load_tool(name)
    cover = tool.spheres["fine"]
    low, high = (cover.centers - cover.radii[:, None]).min(axis=0), (cover.centers + cover.radii[:, None]).max(axis=0)
    tries = np.random.default_rng(0).uniform(low, high, (100_000, 3))
    covered = (outside(tries, cover.centers, cover.radii) <= 0).mean() * np.prod(high - low)
    assert LinkGeoms(compiled(tool), name).volume() >= LEAST_FILL * covered


@every_robot
def test_the_base_stays_above_the_plane_that_it_stands_on(name):
    robot = load_robot(name)
    assert LinkGeoms(compiled(robot), robot.link_names[0]).surface()[:, 2].min() >= -1e-9


@every_model
def test_every_geom_is_a_visible_primitive_that_collides(model):
    mjcf = compiled(model)
    assert set(mjcf.geom_type) <= {BOX, SPHERE, ELLIPSOID, CYLINDER, CAPSULE}
    assert (mjcf.geom_group <= 2).all()
    assert ((mjcf.geom_contype & mjcf.geom_conaffinity) == 1).all()


@every_robot
def test_most_of_an_arm_is_of_the_material_that_is_tinted(name):
    mjcf = compiled(load_robot(name))
    materials = [mjcf.mat(i).name for i in range(mjcf.nmat)]
    assert sorted(materials) == ["accent", "body", "joint"]
    tinted = np.mean([materials[i] == "body" for i in mjcf.geom_matid])
    assert tinted >= 0.5


def test_the_test_finds_a_geom_outside_its_spheres():
    points = surface(CYLINDER, np.array([0.05, 0.1, 0.0]))
    assert outside(points, np.zeros((1, 3)), np.array([0.11])).max() == pytest.approx(np.hypot(0.05, 0.1) - 0.11)
