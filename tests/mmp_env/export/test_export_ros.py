"""ROS 2 trajectories: read back without ROS, valid by a controller's rules, and interpolated like a controller."""

from dataclasses import replace

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
import yaml
from support import tiny_plans

from mmp_env.errors import MmpError
from mmp_env.export import export_plan, load_joint_trajectory
from mmp_env.export.motion import ArmMotion, Motion
from mmp_env.export.ros import yaml_text
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.retime import retime
from mmp_env.retime.limits import rate_limits

RATE_HZ = 250


@pytest.fixture
def plan():
    return plan_from_dict(tiny_plans.two_apart())


def swing(plan, period_s=4.0):
    """Returns a retimed motion in which every joint swings once, from rest to rest."""
    times = np.arange(round(period_s * RATE_HZ) + 1) / RATE_HZ
    w = 2 * np.pi / period_s
    forms = {
        "positions": 0.4 * (1 - np.cos(w * times)),
        "velocities": 0.4 * w * np.sin(w * times),
        "accelerations": 0.4 * w**2 * np.cos(w * times),
    }
    scale = np.linspace(0.5, 1.0, 6)
    by_arm = {key: dict.fromkeys(plan.positions, form[:, None] * scale) for key, form in forms.items()}
    return replace(plan, times=times, **by_arm)


def controller(trajectory, t):
    """Returns positions at time t by the polynomials of joint_trajectory_controller."""
    k = min(int(np.searchsorted(trajectory.times, t, side="right")) - 1, len(trajectory.times) - 2)
    span, u = trajectory.times[k + 1] - trajectory.times[k], t - trajectory.times[k]
    fields = [trajectory.positions, trajectory.velocities, trajectory.accelerations]
    given = [field for field in fields if field is not None]
    powers = np.arange(2 * len(given))
    factors = [np.prod([powers - j for j in range(order)], axis=0) for order in range(len(given))]
    rows = [
        np.where(powers >= order, factor * at ** np.maximum(powers - order, 0), 0.0)
        for at in (0.0, span)
        for order, factor in enumerate(factors)
    ]
    ends = [field[at] for at in (k, k + 1) for field in given]
    return np.linalg.solve(np.array(rows), np.array(ends)).T @ u ** powers.astype(float)


def one_arm(times, positions):
    joints = tuple(f"joint{k}" for k in range(positions.shape[1]))
    arm = ArmMotion(joints=joints, positions=positions, velocities=None, accelerations=None)
    return Motion(times=times, arms={"arm": arm})


def test_a_plan_reads_back_exactly_with_times_to_the_nanosecond(plan, tmp_path):
    export_plan(plan, tmp_path / "all.yaml", joint_names="{arm}_{joint}")
    trajectory = load_joint_trajectory(tmp_path / "all.yaml")
    assert trajectory.joint_names == tuple(f"{arm}_joint{k}" for arm in ("left", "right") for k in range(1, 7))
    np.testing.assert_allclose(trajectory.times, plan.times, rtol=0, atol=0.5e-9)
    np.testing.assert_array_equal(trajectory.positions, np.hstack([plan.positions["left"], plan.positions["right"]]))
    assert trajectory.velocities is None
    assert trajectory.accelerations is None


def test_a_retimed_plan_reads_back_with_velocities_and_accelerations_for_each_arm(plan, tmp_path):
    moved = swing(plan)
    export_plan(moved, tmp_path / "{arm}.yaml")
    trajectory = load_joint_trajectory(tmp_path / "right.yaml")
    for key in ("positions", "velocities", "accelerations"):
        np.testing.assert_array_equal(getattr(trajectory, key), getattr(moved, key)["right"])


@hypothesis.given(
    st.lists(st.floats(allow_nan=False, allow_infinity=False, width=64), min_size=1, max_size=20),
    st.lists(st.integers(1, 10**12), min_size=19, max_size=19),
)
def test_every_number_and_nanosecond_reads_back_the_same(values, gaps):
    nanoseconds = np.cumsum([0, *gaps[: len(values) - 1]])
    data = yaml.safe_load(yaml_text(one_arm(nanoseconds / 1e9, np.array(values)[:, None])))
    assert [point["positions"] for point in data["points"]] == [[value] for value in values]
    assert {type(point["positions"][0]) for point in data["points"]} == {float}
    stamps = [point["time_from_start"] for point in data["points"]]
    assert [stamp["sec"] * 10**9 + stamp["nanosec"] for stamp in stamps] == nanoseconds.tolist()


@pytest.mark.parametrize("value", [1e-05, -1e-300, 1e16, 0.1, 5e-324, 2.0])
def test_numbers_that_yaml_takes_for_words_are_written_with_a_point(value):
    data = yaml.safe_load(yaml_text(one_arm(np.zeros(1), np.array([[value]]))))
    assert data["points"][0]["positions"] == [value]


def test_the_message_has_the_fields_and_types_of_trajectory_msgs(plan, tmp_path):
    export_plan(swing(plan), tmp_path / "all.yaml")
    data = yaml.safe_load((tmp_path / "all.yaml").read_text(encoding="utf-8"))
    assert data.keys() == {"header", "joint_names", "points"}
    assert data["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert {type(name) for name in data["joint_names"]} == {str}
    for point in data["points"]:
        assert point.keys() == {"positions", "velocities", "accelerations", "time_from_start"}
        assert {type(number) for key in ("positions", "velocities", "accelerations") for number in point[key]} == {
            float
        }
        stamp = point["time_from_start"]
        assert {type(number) for number in stamp.values()} == {int}
        assert 0 <= stamp["nanosec"] < 10**9


def test_a_controllers_rules_are_kept(plan, tmp_path):
    """Times increase strictly from 0, every point has one number per joint, and the arm ends at rest."""
    export_plan(swing(plan), tmp_path / "all.yaml")
    trajectory = load_joint_trajectory(tmp_path / "all.yaml")
    assert trajectory.times[0] == 0.0
    assert (np.diff(trajectory.times) > 0).all()
    shape = (len(trajectory.times), len(trajectory.joint_names))
    assert trajectory.positions.shape == trajectory.velocities.shape == trajectory.accelerations.shape == shape
    assert np.abs(trajectory.velocities[-1]).max() < np.finfo(np.float32).eps


def test_finite_differences_of_the_file_of_a_retimed_plan_keep_the_limits(plan, tmp_path):
    retimed = retime(plan)
    export_plan(retimed, tmp_path / "all.yaml")
    trajectory = load_joint_trajectory(tmp_path / "all.yaml")
    limits, step = rate_limits(plan.problem), np.diff(trajectory.times).mean()
    rates = trajectory.positions
    for limit in (limits.velocity, limits.acceleration, limits.jerk):
        rates = np.diff(rates, axis=0) / step
        assert (np.abs(rates) <= 1.001 * limit).all()
    assert np.abs(trajectory.velocities[[0, -1]]).max() < np.finfo(np.float32).eps


def test_indented_under_trajectory_it_is_the_goal_of_an_action(plan, tmp_path):
    """docs/how-to/export.md does this with `sed` for `ros2 action send_goal --stdin`."""
    export_plan(plan, tmp_path / "all.yaml")
    text = (tmp_path / "all.yaml").read_text(encoding="utf-8")
    goal = yaml.safe_load("trajectory:\n" + "".join(f"  {line}\n" for line in text.splitlines()))
    assert goal == {"trajectory": yaml.safe_load(text)}


def test_a_controller_follows_positions_alone_in_the_proved_straight_lines(plan, tmp_path):
    export_plan(plan, tmp_path / "left.yaml")
    trajectory = load_joint_trajectory(tmp_path / "left.yaml")
    for t in np.linspace(0.0, plan.makespan_s, 101):
        here = plan.at(float(t))
        np.testing.assert_allclose(controller(trajectory, t), np.concatenate([here["left"], here["right"]]), atol=1e-8)


def test_a_controller_leaves_the_lines_of_a_retimed_plan_by_a_dt_squared_over_8(plan, tmp_path):
    moved = swing(plan)
    export_plan(moved, tmp_path / "{arm}.yaml")
    trajectory = load_joint_trajectory(tmp_path / "left.yaml")
    fastest = np.abs(moved.accelerations["left"]).max()
    rng = np.random.default_rng(0)
    away = max(
        np.abs(controller(trajectory, t) - moved.at(float(t))["left"]).max()
        for t in rng.uniform(0.0, moved.makespan_s, 200)
    )
    assert 0 < away <= 1.01 * fastest / RATE_HZ**2 / 8


def test_times_that_a_message_cannot_tell_apart_or_hold_are_refused():
    with pytest.raises(MmpError, match=r"of sample 2 comes less than 1 ns after 1\.0 s"):
        yaml_text(one_arm(np.array([0.0, 1.0, 1.0 + 2e-10]), np.zeros((3, 1))))
    for times in ([0.0, 3e9], [0.0, -1e308], [1e308, 0.0]):
        with pytest.raises(MmpError, match="does not fit time_from_start"):
            yaml_text(one_arm(np.array(times), np.zeros((2, 1))))


def test_names_in_any_script_are_kept(tmp_path):
    motion = Motion(
        times=np.array([0.0, 1.0]),
        arms={
            "a": ArmMotion(
                joints=("ä/'\": #1", "左/関節🦾"), positions=np.zeros((2, 2)), velocities=None, accelerations=None
            )
        },
    )
    (tmp_path / "a.yaml").write_text(yaml_text(motion), encoding="utf-8")
    assert load_joint_trajectory(tmp_path / "a.yaml").joint_names == motion.arms["a"].joints


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("points: [", "not YAML"),
        ("points: !!timestamp x", "line 1: the YAML tag '!!timestamp' is not supported"),
        ("a: &a [x, x]\npoints: [*a, *a]", "line 2: YAML aliases"),
        ("points: []\npoints: []", "the field 'points' twice"),
        (
            "{joint_names: [a], points: [{positions: [1.0], time_from_start: {sec: x, nanosec: 0}}]}",
            "time_from_start is .* whole numbers",
        ),
        ("[1, 2]", "is no JointTrajectory"),
        ("joint_names: [a]", "is no JointTrajectory: KeyError: 'points'"),
        (
            "{joint_names: [a], points: [{positions: [1.0, 2.0], time_from_start: {sec: 0, nanosec: 0}}]}",
            r"points\[0\]\.positions has 2 numbers for 1 joints",
        ),
        ("{joint_names: [a], points: [{time_from_start: {sec: 0, nanosec: 0}}]}", "has no positions"),
    ],
)
def test_a_file_that_is_no_trajectory_is_one_sentence(tmp_path, text, message):
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(MmpError, match=message):
        load_joint_trajectory(tmp_path / "a.yaml")
    with pytest.raises(MmpError, match="cannot be read"):
        load_joint_trajectory(tmp_path / "missing.yaml")
