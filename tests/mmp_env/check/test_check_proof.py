"""Bounds of the checker over whole steps, against many instants of the same step."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import tiny_plans

from mmp_env.check.geoms import GeomPairs, GeomSolids, colliding_pairs, geom_parts
from mmp_env.check.items import Items
from mmp_env.check.model import CellModel, sphere_parts
from mmp_env.check.pairs import ignored_links, part_pairs
from mmp_env.check.reading import read_cell
from mmp_env.check.spheres import SpherePairs, SphereSolids
from mmp_env.check.trajectory import PlacedTrajectory, Trajectory

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
RULES = ("arms", "self")
FAMILIES = {
    **{
        f"clouds, {rule}": SpherePairs(MODEL, PARTS, CLOUDS, pairs)
        for rule, pairs in zip(RULES, part_pairs(MODEL.cell, PARTS).by_rule, strict=True)
    },
    "clouds and obstacles": SphereSolids(MODEL, PARTS, CLOUDS),
    **{
        f"geoms, {rule}": GeomPairs(MODEL, *GEOMS[:2], pairs, GEOMS[2])
        for rule, pairs in zip(RULES, colliding_pairs(MODEL, GEOMS[0]).by_rule, strict=True)
    },
    "geoms and obstacles": GeomSolids(MODEL, *GEOMS),
}
BASES = ("/link0", "/base", "/base_link")
DOF = sum(arm.dof for arm in MODEL.cell.arms)


def random_path(seed, length, bent):
    """Returns a path of two samples, or of six samples that do not lie on a line."""
    rng = np.random.default_rng(seed)
    line = np.linspace(0.0, 1.0, 6 if bent else 2)[:, None]
    move = length * rng.uniform(-1.0, 1.0, DOF) * (rng.random(DOF) < 0.7)
    q = rng.uniform(-2.5, 2.5, DOF) + line * move + bent * length * rng.uniform(-0.05, 0.05, (len(line), DOF))
    return Trajectory(np.arange(float(len(q))), q), float(len(q) - 1)


def items(track, pairs):
    """Returns these pairs in every step of a track."""
    step = np.repeat(np.arange(len(track.steps.start)), len(pairs))
    return Items(steps=track.steps, step=step, pair=np.tile(pairs, len(track.steps.start)))


def coarse(family, track):
    """Returns the bounds [u, p] of the broad phase of all pairs in all steps."""
    out = np.full((len(track.steps.start), len(family)), np.inf)
    found, lower = family.coarse(track.poses, track.steps, np.inf)
    out[found.step, found.pair] = lower
    return out


def some_pairs(family, seed):
    return np.sort(np.random.default_rng(seed).permutation(len(family))[:16])


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("name", FAMILIES)
@settings(max_examples=10)
@given(seed=st.integers(0, 2**32), length=st.sampled_from([0.0, 0.02, 0.1, 0.5]))
def test_no_instant_of_a_step_has_less_clearance_than_both_bounds(name, bent, seed, length):
    family = FAMILIES[name]
    pairs = some_pairs(family, seed)
    path, last = random_path(seed, length, bent)
    dense = PlacedTrajectory(MODEL, path, np.linspace(0.0, last, 9))
    met = family.narrow(dense.poses, items(dense, pairs), np.inf).found.reshape(8, -1).min(axis=0)
    whole = PlacedTrajectory(MODEL, path, np.array([0.0, last]))
    narrow = family.narrow(whole.poses, items(whole, pairs), np.inf)
    enough = family.narrow(whole.poses, items(whole, pairs), 0.05)
    assert (coarse(family, whole)[0, pairs] <= met + 1e-9).all()
    assert (narrow.lower <= met + 1e-9).all()
    assert (enough.lower <= met + 1e-9).all()
    assert (np.minimum(enough.lower, 0.05) >= np.minimum(narrow.lower, 0.05) - 1e-9).all()


@pytest.mark.parametrize("name", FAMILIES)
@settings(max_examples=10)
@given(seed=st.integers(0, 2**32))
def test_the_bound_of_a_short_step_is_close_to_its_least_clearance(name, seed):
    family = FAMILIES[name]
    path, last = random_path(seed, 1e-4, False)
    track = PlacedTrajectory(MODEL, path, np.array([0.0, last]))
    narrow = family.narrow(track.poses, items(track, some_pairs(family, seed)), np.inf)
    apart = narrow.found > 1e-3
    assert (narrow.found - narrow.lower)[apart].max() < 1e-3


@pytest.mark.parametrize("name", ["clouds, self", "geoms, self"])
@settings(max_examples=3)
@given(seed=st.integers(0, 2**32))
def test_links_that_only_turn_together_keep_exactly_the_clearance_that_they_have(name, seed):
    family = FAMILIES[name]
    bases = np.cumsum([0, *(arm.dof for arm in MODEL.cell.arms)])[:-1]
    start = np.random.default_rng(seed).uniform(-1.0, 1.0, DOF)
    end = start.copy()
    end[bases] += 1.5
    track = PlacedTrajectory(MODEL, Trajectory(np.arange(2.0), np.stack([start, end])), np.array([0.0, 1.0]))
    still = np.array(
        [k for k in range(len(family)) if not any(thing.endswith(BASES) for thing in family.names(k).things)]
    )
    bounds = family.narrow(track.poses, items(track, still), np.inf)
    apart = bounds.found > 1e-3
    assert bounds.lower[apart] == pytest.approx(bounds.found[apart], abs=2e-5)


@pytest.mark.parametrize("name", FAMILIES)
@settings(max_examples=10)
@given(seed=st.integers(0, 2**32))
def test_the_bounds_of_the_broad_phase_hold_during_the_whole_step(name, seed):
    path, last = random_path(seed, 0.7, False)
    dense = PlacedTrajectory(MODEL, path, np.linspace(0.0, last, 65))
    met = coarse(FAMILIES[name], dense).min(axis=0)  # the steps are short, so this is nearly exact
    whole = PlacedTrajectory(MODEL, path, np.array([0.0, last]))
    assert (coarse(FAMILIES[name], whole)[0] <= met + 2e-3).all()


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32))
def test_turn_and_bend_of_a_step_are_exact_after_any_number_of_bisections(seed):
    path, last = random_path(seed, 1.0, True)
    track = PlacedTrajectory(MODEL, path, np.array([0.0, last]))
    for _ in range(4):
        shares = np.linspace(0.0, 1.0, 41)[:, None]
        steps, times = track.steps, track.poses.times
        for start, end, turn, bend in zip(steps.start, steps.end, steps.move, steps.bend, strict=True):
            _, q = path.at(times[start] + shares[:, 0] * (times[end] - times[start]))  # times count samples here
            assert np.abs(q[-1] - q[0]) == pytest.approx(turn)
            assert (np.abs(q - (q[0] * (1 - shares) + q[-1] * shares)) <= bend + 1e-12).all()
        track.halve(np.arange(len(steps.start)))


@given(seed=st.integers(0, 2**32), length=st.sampled_from([0.0, 0.01, 0.1, 1.0]))
def test_the_first_steps_are_short_and_cover_the_path_with_all_its_corners(seed, length):
    rng = np.random.default_rng(seed)
    q = np.cumsum(length * rng.uniform(-1.0, 1.0, (12, 4)) * (rng.random((12, 1)) < 0.8), axis=0)
    path = Trajectory(np.arange(12.0), q)
    places = path.grid()
    assert places[0] == 0.0
    assert places[-1] == 11.0
    assert (np.diff(places) > 0).all()
    # A step within two samples goes straight; a longer one begins and ends at samples.
    assert all(high <= np.floor(low) + 1 or low % 1 == high % 1 == 0 for low, high in pairwise(places))
    dense = np.linspace(0.0, 11.0, 23)
    times, at = path.at(dense)
    assert times == pytest.approx(dense)
    assert at[::2] == pytest.approx(q)
    for low, high in pairwise(places):
        within = at[(dense >= low) & (dense <= high)]
        assert np.abs(within - path.at(np.array([low]))[1]).max(initial=0.0) <= 0.1 + 1e-9


@given(seed=st.integers(0, 2**32))
def test_no_sample_of_a_step_deviates_farther_than_its_bend(seed):
    q = np.random.default_rng(seed).normal(size=(9, 3))
    bend = Trajectory(np.arange(9.0), q).bend(2, 7)
    line = np.linspace(0.0, 1.0, 101)[:, None]
    at = Trajectory(np.arange(9.0), q).at(2.0 + 5.0 * line[:, 0])[1]
    off = np.abs(at - (q[2] * (1 - line) + q[7] * line)).max(axis=0)
    assert (off <= bend + 1e-12).all()
    assert bend == pytest.approx(off, rel=0.05)
    assert (Trajectory(np.arange(9.0), q).bend(3, 4) == 0.0).all()


@settings(max_examples=3)
@given(seed=st.integers(0, 2**32))
def test_the_clearance_of_clouds_is_that_of_all_their_spheres(seed):
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, DOF)
    found = brute_force(q)
    track = PlacedTrajectory(MODEL, Trajectory(np.zeros(1), q[None]), np.array([0.0, 1.0]))
    for name in ("clouds, arms", "clouds, self", "clouds and obstacles"):
        family = FAMILIES[name]
        bounds = family.narrow(track.poses, items(track, np.arange(len(family))), np.inf)
        for pair in range(len(family)):
            things = tuple(sorted(family.names(pair).things))
            assert bounds.found[pair] == pytest.approx(found.pop(things), abs=1e-9)
    assert not found, f"pairs that the checker leaves out: {list(found)}"


def brute_force(q):
    """Returns the clearance [m] of every two things that must keep apart, sphere by sphere."""
    data = MODEL.place(q)
    spheres, moving = {}, set()
    for arm in MODEL.cell.arms:
        links = arm.robot.sphere_set(SPHERES)
        if arm.tool:
            links |= arm.tool.sphere_set(SPHERES)
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
    """Returns the signed distance [m] of a point to an obstacle that is upright, turned about z at most."""
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
