"""The checker's own distance of convex geoms, and the exact check where MuJoCo's distance is wrong."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import tiny_plans
from support.tiny_plans import UPRIGHT

from mmp_env import check_plan
from mmp_env.check.convex import Convex, separation
from mmp_env.check.distance import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE, geom_support
from mmp_env.check.fields import rotation
from mmp_env.check.geom_distance import GeomDistance

KINDS = {"sphere": SPHERE, "capsule": CAPSULE, "ellipsoid": ELLIPSOID, "cylinder": CYLINDER, "box": BOX}


def placed(kind, size, center, quaternion=(1.0, 0.0, 0.0, 0.0)):
    quaternion = np.array(quaternion) / np.linalg.norm(quaternion)
    return Convex(
        kind=KINDS[kind], size=np.array(size, float), center=np.array(center, float), rotation=rotation(quaternion)
    )


def random_geom(kind, rng):
    return placed(kind, rng.uniform(0.02, 0.5, 3), rng.uniform(-0.7, 0.7, 3), rng.normal(size=4))


def reach(geom, directions):
    """Returns the support [m] of a geom along unit directions [n, 3]."""
    count = len(directions)
    local = directions @ geom.rotation
    support = geom_support(np.full(count, geom.kind), np.tile(geom.size, (count, 1)), local)
    return directions @ geom.center + support


@pytest.mark.parametrize("other", KINDS)
@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=8)
@given(seed=st.integers(0, 2**32))
def test_the_direction_separates_two_geoms_by_the_distance_and_no_direction_by_more(kind, other, seed):
    rng = np.random.default_rng(seed)
    first, second = random_geom(kind, rng), random_geom(other, rng)
    distance, along = separation(first, second)
    assert np.linalg.norm(along) == pytest.approx(1.0)
    assert -reach(second, -along[None])[0] - reach(first, along[None])[0] == pytest.approx(distance, abs=1e-9)
    near = along + rng.normal(size=(200, 3)) * rng.choice([1e-3, 0.1, 10.0], (200, 1))
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    gaps = -reach(second, -near) - reach(first, near)
    if distance > 0 or {kind, other} == {"box"}:
        assert gaps.max() <= distance + 1e-9
    else:
        assert gaps.max() <= 1e-9  # the depth may be less than the result, but the geoms touch


DEPTHS = {
    "a ball beside a ball": (("sphere", [0.1, 0, 0], [0, 0, 0]), ("sphere", [0.2, 0, 0], [0.5, 0, 0]), 0.2),
    "a ball in a ball": (("sphere", [0.1, 0, 0], [0, 0, 0]), ("sphere", [0.2, 0, 0], [0.05, 0, 0]), -0.25),
    "balls about one point": (("sphere", [0.1, 0, 0], [0, 0, 0]), ("sphere", [0.2, 0, 0], [0, 0, 0]), -0.3),
    "a ball on a box": (("sphere", [0.1, 0, 0], [0, 0, 0.65]), ("box", [0.5, 0.5, 0.5], [0, 0, 0]), 0.05),
    "a ball deep in a box": (("sphere", [0.1, 0, 0], [0, 0, 0.3]), ("box", [0.5, 0.5, 0.5], [0, 0, 0]), -0.3),
    "a box in a box": (("box", [0.1, 0.1, 0.1], [0, 0.3, 0]), ("box", [0.5, 0.5, 0.5], [0, 0, 0]), -0.3),
    "a rod through a board": (("capsule", [0.02, 0.6, 0], [0, 0, 0.1]), ("box", [1, 1, 0.05], [0, 0, 0]), -0.57),
    "a tin in a tin": (("cylinder", [0.1, 0.2, 0], [0, 0, 0.35]), ("cylinder", [0.1, 0.2, 0], [0, 0, 0]), -0.05),
}


@pytest.mark.parametrize("what", DEPTHS)
def test_depths_agree_with_values_computed_by_hand(what):
    first, second, depth = DEPTHS[what]
    assert separation(placed(*first), placed(*second))[0] == pytest.approx(depth, abs=1e-9)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32))
def test_geoms_that_are_apart_are_as_far_apart_as_mujoco_says(seed):
    """Capsules are left out: MuJoCo reports some of them as apart from a box that they overlap."""
    rng = np.random.default_rng(seed)
    names = [str(name) for name in rng.choice([name for name in KINDS if name != "capsule"], 2)]
    geoms = [random_geom(name, rng) for name in names]
    spec = mujoco.MjSpec()
    for geom in geoms:
        turned = np.zeros(4)
        mujoco.mju_mat2Quat(turned, geom.rotation.ravel())
        spec.worldbody.add_geom(type=mujoco.mjtGeom(geom.kind), size=geom.size, pos=geom.center, quat=turned)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    theirs, ours = mujoco.mj_geomDistance(model, data, 0, 1, 10.0, np.zeros(6)), separation(*geoms)[0]
    assert (theirs > 0) == (ours > 0)
    if ours > 0:
        assert ours == pytest.approx(theirs, abs=1e-6)


def with_a_rod(**more):
    """Returns a plan of a turning arm that holds a long rod downwards, through its own links and the table."""
    rod = {"shape": "capsule", "radius": 0.02, "length": 1.2, "position": [0.0, 0.0, -0.3]} | more
    arms = [tiny_plans.arm("arm", [0.0, 0.0, 0.0])]
    over = [0.0, -1.2, 1.6, -1.9708, -1.5708, 0.0]
    table = {"name": "table", "shape": "box", "size": [2.0, 2.0, 0.1], "position": [0.0, 0.0, -0.05]}
    plan = tiny_plans.plan(arms, {"arm": [over, [0.5, *over[1:]]]}, obstacles=[table])
    plan["problem"]["cell"]["arms"][0]["held"] = rod
    return plan


@pytest.fixture
def measured(monkeypatch):
    """Counts pairs of geoms, and stops a check that does not end."""
    counts = [0]
    measure = GeomDistance.measure

    def counted(self, poses, steps):
        counts[0] += len(steps.first)
        assert counts[0] < 50_000
        return measure(self, poses, steps)

    monkeypatch.setattr(GeomDistance, "measure", counted)
    return counts


SHAPES = {
    "capsule": {},
    "cylinder": {"shape": "cylinder"},
    "box": {"shape": "box", "radius": None, "length": None, "size": [0.04, 0.04, 1.2]},
    "sphere": {"shape": "sphere", "radius": 0.4, "length": None},
}


@pytest.mark.parametrize("reach_m", [-0.3, 0.0, 0.3])
@pytest.mark.parametrize("shape", SHAPES)
def test_an_object_deep_inside_links_and_table_is_found_with_few_measurements(measured, shape, reach_m):
    plan = with_a_rod(**SHAPES[shape], position=[0.0, 0.0, reach_m])
    report = check_plan(plan, exact=True)
    found = {violation.values["things"][1]: violation for violation in report.violations}
    assert "obstacle/table" in found or "arm/held" in found
    assert all(violation.values["found"] for violation in report.violations)
    assert measured[0] < 5_000


def test_a_rod_through_a_table_is_in_contact(measured):
    """MuJoCo's own distance of the two is positive."""
    report = check_plan(with_a_rod(position=[0.0, 0.0, 0.4]), exact=True)
    (found,) = [violation for violation in report.violations if violation.rule == "arm-obstacle"]
    assert found.values["things"] == ["arm/held", "obstacle/table"]
    assert found.values["found"]
    assert found.values["clearance_m"] < -0.05
    assert measured[0] < 5_000


def test_a_plan_far_from_obstacles_uses_distances_of_mujoco_alone(monkeypatch):
    def never(*_):
        raise AssertionError

    monkeypatch.setattr("mmp_env.check.geom_distance.separation", never)
    arms = [tiny_plans.arm("arm", [0.0, 0.0, 0.0])]
    assert check_plan(tiny_plans.plan(arms, {"arm": [UPRIGHT, [0.4, *UPRIGHT[1:]]]}), exact=True).valid
