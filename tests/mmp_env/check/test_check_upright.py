"""The checker proves bounds on tool axes, and finds violations that were planted into plans."""

import itertools

import numpy as np
import pytest
from support import tiny_plans

from mmp_env import check_plan
from mmp_env.check.model import CellModel
from mmp_env.check.reading import read_cell

START = [0.3, -1.2, 1.4, -0.2, 0.2, 0.5]
BOUND_RAD = 0.3


def kept(rows, axis, *, within=BOUND_RAD, robot="ur5e", tool=None):
    """Returns a plan of one arm through rows, with a bound on an axis of its tool."""
    arm = tiny_plans.arm("arm", [0.1, 0.2, 0.3], robot=robot, yaw=0.7, tool=tool)
    plan = tiny_plans.plan([arm], {"arm": np.asarray(rows).tolist()})
    plan["problem"]["keep"] = {"arm": {"upright": {"axis": list(axis), "within": within}}}
    return plan


def axis_up(q, *, robot="ur5e", tool=None):
    """Returns the axis of the tool frame that points up at q, and a function of q: the angle of that axis [rad]."""
    arm = tiny_plans.arm("arm", [0.1, 0.2, 0.3], robot=robot, yaw=0.7, tool=tool)
    model = CellModel(read_cell({"arms": [arm], "spheres": "28"}))

    def rotation(at):
        data = model.place(np.asarray(at))
        return (data.body(f"arm/{tool}").xmat if tool else data.site("arm/flange").xmat).reshape(3, 3).copy()

    axis = rotation(q)[2]

    def tilt(at):
        x, y, z = rotation(at) @ axis
        return float(np.arctan2(np.hypot(x, y), z))

    return axis, tilt


def rules(plan):
    return {violation.rule for violation in check_plan(plan).violations}


@pytest.mark.parametrize(("robot", "tool"), [("ur5e", None), ("panda", None), ("panda", "franka-hand")])
def test_a_plan_is_valid_up_to_its_largest_angle_and_not_beyond(robot, tool):
    rng = np.random.default_rng(3)
    start = np.array(START if robot == "ur5e" else [0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
    axis, tilt = axis_up(start, robot=robot, tool=tool)
    rows = start + np.cumsum(rng.normal(0, 0.06, (6, len(start))), axis=0) - rng.normal(0, 0.01, len(start))
    dense = [a + s * (b - a) for a, b in itertools.pairwise(rows) for s in np.linspace(0, 1, 200)]
    largest = max(map(tilt, dense))
    enough = kept(rows, axis, within=largest + 1e-4, robot=robot, tool=tool)
    assert "upright" not in rules(enough)
    (found,) = check_plan(kept(rows, axis, within=largest - 1e-4, robot=robot, tool=tool)).violations
    assert found.rule == "upright"
    assert found.arms == ("arm",)
    assert found.values["angle_rad"] == pytest.approx(largest, abs=1e-3)
    assert tilt(np.array([np.interp(found.time_s, enough["times"], joint) for joint in rows.T])) == pytest.approx(
        found.values["angle_rad"], abs=1e-9
    )


def planted(seed):
    """Returns a plan of ten samples within 0.6 of its bound, and the same plan with a violation."""
    rng = np.random.default_rng(seed)
    axis, tilt = axis_up(START)
    rows = np.array(START) + np.cumsum(rng.normal(0, 0.01, (10, 6)), axis=0)
    rows[:, 0] += np.linspace(0, rng.uniform(-2, 2), 10)  # the first axis is vertical: it does not tilt the tool
    within = max(map(tilt, rows)) / 0.6
    kind = seed % 3
    wrong, bound = rows.copy(), within
    if kind == 0:  # a waypoint in the middle is tilted
        k = rng.integers(2, 8)
        joint, size = 1 + rng.integers(0, 3), 1.0
        while tilt(wrong[k]) <= within * (1 + rng.uniform(0.001, 0.3)):
            wrong[k] = rows[k] + 0.01 * size * np.eye(6)[joint]
            size += 1
    elif kind == 1:  # the bound is tightened
        bound = max(map(tilt, rows)) * rng.uniform(0.7, 0.9999)
    else:  # the tool tilts and comes back within a hundredth of the time between two samples
        k, share, size = rng.integers(2, 8), rng.uniform(0.1, 0.8), 1.0
        here, there = (rows[k] + s * (rows[k + 1] - rows[k]) for s in (share, share + 0.01))
        peak = (here + there) / 2
        while tilt(peak) <= within * (1 + rng.uniform(0.001, 0.05)):
            peak = (here + there) / 2 + 0.01 * size * np.eye(6)[3]
            size += 1
        wrong = np.vstack([rows[: k + 1], here, peak, there, rows[k + 1 :]])
    return kept(rows, axis, within=within), kept(wrong, axis, within=bound)


@pytest.mark.parametrize("seed", range(12))
def test_planted_violations_are_found(seed):
    sound, wrong = planted(seed)
    assert "upright" not in rules(sound)
    assert "upright" in rules(wrong)


def test_an_excursion_between_two_upright_samples_is_found():
    q = np.array(START)
    axis, tilt = axis_up(q)
    over = q + np.array([0, 0, 0, np.pi, -2 * q[4], np.pi])  # the wrist turned over: the same pose of the flange
    assert max(tilt(q), tilt(over)) < 1e-6
    highest = max(tilt(q + share * (over - q)) for share in np.linspace(0, 1, 201))
    (found,) = check_plan(kept([q, over], axis)).violations
    assert found.rule == "upright"
    assert found.values["angle_rad"] == pytest.approx(highest, abs=1e-3)
    nearly = q + 0.05 * (over - q)
    assert "upright" not in rules(kept([q, nearly, q], axis, within=1.01 * tilt(nearly)))


@pytest.mark.parametrize(
    "keep",
    [
        {"arm": {"upright": {"axis": [0, 0, 0], "within": 0.2}}},
        {"arm": {"upright": {"axis": [0, 0, 1], "within": 0.0}}},
        {"arm": {"upright": {"axis": [0, 0, 1], "within": 3.0}}},
        {"arm": {"upright": {"axis": [0, 0, 1]}}},
        {"arm": {"upright": {"axis": [0, 0], "within": 0.2}}},
        {"arm": {"level": {"axis": [0, 0, 1], "within": 0.2}}},
        {"other": {"upright": {"axis": [0, 0, 1], "within": 0.2}}},
        [1],
    ],
)
def test_a_bound_that_cannot_be_read_breaks_the_schema(keep):
    plan = kept([START, START], [0, 0, 1])
    plan["problem"]["keep"] = keep
    (found,) = check_plan(plan).violations
    assert found.rule in ("schema", "shape")
    assert "keep" in found.message


def test_the_frame_without_a_tool_is_the_flange():
    axis, tilt = axis_up(START)
    assert tilt(START) == pytest.approx(0, abs=1e-7)
    assert "upright" not in rules(kept([START, START], axis, within=0.001))
