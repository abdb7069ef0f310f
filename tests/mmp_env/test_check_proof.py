"""Bounds of the checker over whole steps, against many instants of the same step."""

import numpy as np
import pytest
import tiny_plans
from hypothesis import given, settings
from hypothesis import strategies as st

from mmp_env.check.geoms import GeomPairs, GeomSolids, geom_parts
from mmp_env.check.items import Items
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.pairs import ignored_links, part_pairs
from mmp_env.check.reading import read_cell, robot_data
from mmp_env.check.spheres import CloudPairs, CloudSolids

OBSTACLES = [
    {"name": "ground", "shape": "box", "size": [3.0, 3.0, 0.1], "position": [0.3, 0.0, -0.05]},
    {"name": "pipe", "shape": "cylinder", "radius": 0.1, "length": 0.5, "position": [0.3, 0.5, 0.4], "yaw": 0.3},
    {"name": "bar", "shape": "capsule", "radius": 0.1, "length": 0.5, "position": [0.3, -0.5, 0.4]},
    {"name": "ball", "shape": "sphere", "radius": 0.1, "position": [0.3, 0.0, 1.0]},
]
SPHERES = "28"
CELL = {
    "spheres": SPHERES,
    "arms": [
        tiny_plans.arm("panda", [0.0, 0.0, 0.0], robot="panda", tool="franka-hand"),
        tiny_plans.arm("ur5e", [0.7, 0.1, 0.0], yaw=0.4),
        tiny_plans.arm("piper", [0.3, -0.4, 0.1], robot="piper", yaw=1.5),
    ],
    "obstacles": OBSTACLES,
}
MODEL = CellModel(read_cell(CELL))
PARTS, CLOUDS = sphere_parts(MODEL)
GEOMS = geom_parts(MODEL)
FAMILIES = {
    "clouds": CloudPairs(MODEL, PARTS, CLOUDS, part_pairs(MODEL.cell, PARTS)),
    "clouds and obstacles": CloudSolids(MODEL, PARTS, CLOUDS),
    "geoms": GeomPairs(MODEL, *GEOMS),
    "geoms and obstacles": GeomSolids(MODEL, *GEOMS),
}
DOF = sum(arm.dof for arm in MODEL.cell.arms)


def items(steps, pairs):
    """These pairs in every step between consecutive poses."""
    step = np.repeat(np.arange(steps), len(pairs))
    return Items(start=step, end=step + 1, pair=np.tile(pairs, steps))


def some_pairs(family, seed):
    """Some of a family's pairs."""
    return np.sort(np.random.default_rng(seed).permutation(len(family))[:16])


def random_step(seed, length):
    rng = np.random.default_rng(seed)
    start = rng.uniform(-2.5, 2.5, DOF)
    return start, start + length * rng.uniform(-1.0, 1.0, DOF) * (rng.random(DOF) < 0.7)


@pytest.mark.parametrize("name", FAMILIES)
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32), length=st.sampled_from([0.0, 0.02, 0.1, 0.5]))
def test_no_instant_of_a_step_has_less_clearance_than_both_bounds_say(name, seed, length):
    family = FAMILIES[name]
    pairs = some_pairs(family, seed)
    start, end = random_step(seed, length)
    share = np.linspace(0.0, 1.0, 9)
    dense = MODEL.poses(share, start + share[:, None] * (end - start))
    met = family.narrow(dense, items(8, pairs), np.inf).found.reshape(8, -1).min(axis=0)
    step = MODEL.poses(np.array([0.0, 1.0]), np.stack([start, end]))
    coarse = family.coarse(step)[0, pairs]
    narrow = family.narrow(step, items(1, pairs), np.inf)
    assert (coarse <= met + 1e-9).all()
    assert (narrow.lower <= met + 1e-9).all()
    assert (narrow.lower <= narrow.found + 1e-9).all()
    enough = family.narrow(step, items(1, pairs), 0.05)
    assert (enough.lower <= met + 1e-9).all()
    assert (np.minimum(enough.lower, 0.05) >= np.minimum(narrow.lower, 0.05) - 1e-9).all()


@pytest.mark.parametrize("name", FAMILIES)
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32))
def test_the_bound_of_a_short_step_is_close_to_what_is_met_in_it(name, seed):
    family = FAMILIES[name]
    start, end = random_step(seed, 1e-4)
    step = MODEL.poses(np.array([0.0, 1.0]), np.stack([start, end]))
    narrow = family.narrow(step, items(1, some_pairs(family, seed)), np.inf)
    apart = narrow.found > 1e-3
    assert (narrow.found - narrow.lower)[apart].max() < 1e-3


@settings(max_examples=3)
@given(seed=st.integers(0, 2**32))
def test_the_clearance_of_clouds_is_that_of_all_their_spheres(seed):
    q = random_step(seed, 0.0)[0]
    model, found = MODEL, brute_force(q)
    pose = model.poses(np.zeros(2), np.stack([q, q]))
    for name in ("clouds", "clouds and obstacles"):
        family = FAMILIES[name]
        bounds = family.narrow(pose, items(1, np.arange(len(family))), np.inf)
        for pair in range(len(family)):
            things = tuple(sorted(family.names(pair).things))
            assert bounds.found[pair] == pytest.approx(found.pop(things), abs=1e-9)
    assert not found, f"pairs that the checker leaves out: {list(found)}"


def brute_force(q):
    """Clearance [m] of every two things that must keep apart, sphere by sphere."""
    data = MODEL.place(q)
    spheres, moving = {}, set()
    for arm in MODEL.cell.arms:
        links = dict(robot_data("robots", arm.model, "spheres.json")[SPHERES])
        if arm.tool:
            links[arm.tool] = robot_data("tools", arm.tool, "spheres.json")[SPHERES]
        for k, (link, rows) in enumerate(links.items()):
            body = data.body(f"{arm.name}/{link}")
            turn = body.xmat.reshape(3, 3)
            spheres[arm.name, link] = [(body.xpos + turn @ row[:3], row[3]) for row in rows]
            if k:
                moving.add((arm.name, link))
    ignored = {arm.name: ignored_links(arm, SPHERES) for arm in MODEL.cell.arms}
    found = {}
    for one, first in spheres.items():
        for other, second in spheres.items():
            same_arm = one[0] == other[0]
            tested = one[1] != other[1] and {one[1], other[1]} not in ignored[one[0]]
            if one < other and (tested if same_arm else one in moving or other in moving):
                least = min(np.linalg.norm(c - d) - r - s for c, r in first for d, s in second)
                found["/".join(one), "/".join(other)] = least
        if one in moving:
            for obstacle in OBSTACLES:
                least = min(outside(obstacle, center) - radius for center, radius in first)
                found[tuple(sorted(("/".join(one), f"obstacle/{obstacle['name']}")))] = least
    return found


def outside(obstacle, point):
    """Signed distance [m] of a point to an obstacle that is upright, turned about z at most."""
    yaw = obstacle.get("yaw", 0.0)
    x, y, z = point - np.array(obstacle["position"])
    x, y = x * np.cos(yaw) + y * np.sin(yaw), y * np.cos(yaw) - x * np.sin(yaw)
    if obstacle["shape"] in ("sphere", "capsule"):
        z -= np.clip(z, -obstacle.get("length", 0.0) / 2, obstacle.get("length", 0.0) / 2)
        return np.sqrt(x * x + y * y + z * z) - obstacle["radius"]
    if obstacle["shape"] == "cylinder":
        beyond = np.array([np.hypot(x, y) - obstacle["radius"], abs(z) - obstacle["length"] / 2])
    else:
        beyond = np.abs([x, y, z]) - np.array(obstacle["size"]) / 2
    return np.linalg.norm(np.maximum(beyond, 0.0)) + min(beyond.max(), 0.0)
