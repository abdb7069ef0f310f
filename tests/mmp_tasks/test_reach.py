"""Task `reach`: its rules, its repeated draws, and its errors."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from reference import clearance, kinematics, toys

import mmp_tasks
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.files.cell_source import find_cell
from mmp_env.model.arm import place_arm
from mmp_env.model.cell import Cell
from mmp_env.model.margins import DEFAULT_MARGIN_M
from mmp_env.model.rings import ring_cell
from mmp_env.model.robot_reading import load_robot
from mmp_env.robot_folders import robot_names
from mmp_tasks.reach import Reach
from mmp_tasks.shared_space import has_open_middle, middle, neighbourhood, neighbours

CELLS = [
    (8, "ur5e", "28"),
    (4, "ur5e", "fine"),
    (6, "panda", "fine"),
    (4, "fr5", "28"),
    (2, "piper", "fine"),
    (8, "piper", "28"),
]


def states(count, robot, spheres, seeds):
    cell = ring_cell(count, robot, spheres)
    for seed in seeds:
        yield from ((cell, state) for state in Reach().sample(cell, np.random.default_rng(seed)))


@pytest.mark.parametrize(("count", "robot", "spheres"), CELLS)
def test_arms_keep_a_centimetre_from_each_other_and_the_whole_margin_from_the_rest(count, robot, spheres):
    for cell, state in states(count, robot, spheres, range(2)):
        assert set(state) == set(cell.arm_names)
        for a, b in combinations(cell.arm_names, 2):
            assert clearance.pair_clearance(cell, a, state[a], b, state[b]) >= 0.01 - 1e-12
        assert 0.8 * clearance.least_clearance(cell, state) > DEFAULT_MARGIN_M


@pytest.mark.parametrize(("count", "robot", "spheres"), CELLS)
def test_every_tool_point_lies_in_the_shared_space_and_every_joint_in_its_draw_limits(count, robot, spheres):
    for cell, state in states(count, robot, spheres, range(2)):
        space = middle(cell)
        for arm in cell.arms:
            q = state[arm.name]
            x, y, z = kinematics.tool_point(arm, q)
            assert np.hypot(x, y) <= space.radius + 1e-9
            assert 0.05 - 1e-9 <= z <= 0.80 + 1e-9
            assert (q >= arm.robot.draw_lower).all()
            assert (q <= arm.robot.draw_upper).all()


@pytest.mark.parametrize("name", robot_names())
def test_draw_limits_are_the_limits_cut_to_half_a_turn_on_both_sides(name):
    robot = load_robot(name)
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    if name == "ur5e":  # a quarter turn and more points the upper arm into the table
        lower[1], upper[1] = -1.5 * np.pi, np.pi / 2
    np.testing.assert_allclose(robot.draw_lower, lower, atol=1e-6)
    np.testing.assert_allclose(robot.draw_upper, upper, atol=1e-6)
    assert (robot.draw_lower >= robot.lower).all()
    assert (robot.draw_upper <= robot.upper).all()


def test_the_same_state_of_the_generator_gives_the_same_instance_and_leaves_the_same_state():
    cell = ring_cell(4)
    first, second, other = (np.random.default_rng(seed) for seed in (5, 5, 6))
    (start, goal), (start_again, goal_again) = Reach().sample(cell, first), Reach().sample(ring_cell(4), second)
    for arm in cell.arm_names:
        np.testing.assert_array_equal(start[arm], start_again[arm])
        np.testing.assert_array_equal(goal[arm], goal_again[arm])
        assert not np.array_equal(start[arm], goal[arm])
    assert first.bit_generator.state == second.bit_generator.state
    assert not np.array_equal(Reach().sample(cell, other)[0]["arm0"], start["arm0"])


def test_a_seed_gives_the_same_instance_in_every_version():
    """The last goal depends on every draw before it. Published results refer to these instances."""
    _, goal = Reach().sample(ring_cell(8), np.random.default_rng(7))
    assert goal["arm7"].tolist() == [
        1.8694056194528224,
        -2.7112017177650443,
        2.4080134678875824,
        2.56115988846478,
        -0.18723898641385883,
        2.7246067186882654,
    ]


@pytest.mark.parametrize(
    ("count", "robot", "radius"),
    [
        (8, "ur5e", 0.70 - 0.15),
        (4, "panda", 0.55 - 0.15),
        (2, "fr5", 0.40 - 0.15),
        (2, "piper", 0.20),
        (8, "piper", 0.361),
    ],
)
def test_the_shared_space_of_a_ring_ends_15_cm_before_the_bases_but_never_below_20_cm(count, robot, radius):
    space = middle(ring_cell(count, robot))
    np.testing.assert_allclose(space.center, [0, 0], atol=1e-9)
    assert space.radius == pytest.approx(radius, abs=1e-3)
    assert (space.bottom, space.top) == (0.05, 0.80)


def test_the_shared_space_stands_on_the_lowest_base_in_the_middle_of_all():
    cell = toys.toy_cell(
        toys.toy_arm("a", [1, 0, 0.4]), toys.toy_arm("b", [2, 2, 0.1]), toys.toy_arm("c", [3, -2, 0.1])
    )
    space = middle(cell)
    np.testing.assert_allclose(space.center, [2, 0])
    assert space.radius == pytest.approx((1 + 2 + np.sqrt(5)) / 3 - 0.15)
    assert (space.bottom, space.top) == pytest.approx((0.15, 0.90))


def test_a_single_arm_has_its_reach_to_itself():
    assert middle(toys.toy_cell(toys.toy_arm("a", [1, 1, 0]))).radius == 2.0


def test_points_on_the_surface_of_the_shared_space_are_in_it():
    space = middle(toys.toy_cell(toys.toy_arm("a", [1, 0, 0])))
    points = np.array([[3.0, 0, 0.05], [3.01, 0, 0.05], [1, 0, 0.80], [1, 0, 0.81], [1, 0, 0.04]])
    assert space.contains(points).tolist() == [True, False, True, False, False]


class FakeQueries:
    """Collision queries that refuse the first `refused` configurations of `arm1`."""

    def __init__(self, refused):
        self.refused, self.tried, self.first = refused, {"arm0": 0, "arm1": 0}, []

    def tool_points(self, arm, q):
        return np.tile([0.0, 0.0, 0.5], (len(q), 1))

    def static_clearance(self, arm, q, *, precise):
        assert precise
        if arm == "arm0":
            self.first.append(q[0])
        before = self.tried[arm]
        self.tried[arm] += len(q)
        numbers = np.arange(before, before + len(q))
        return np.where((arm == "arm0") | (numbers >= self.refused), 0.0025, 0.0024)

    def pair_clearance(self, arm_a, q_a, arm_b, q_b, *, precise):
        assert precise
        assert q_a.shape == q_b.shape
        return np.full(len(q_a), 0.01)


@pytest.fixture
def paths_everywhere(monkeypatch):
    """Lets every arm find a path alone: fake queries have no core."""
    monkeypatch.setattr("mmp_tasks.reach.has_path_alone", lambda cell, arm, start, goal: True)


def cell_with(queries):
    cell = ring_cell(2)
    cell.__dict__["collision"] = queries
    return cell


@pytest.mark.usefixtures("paths_everywhere")
def test_a_new_draw_begins_after_all_tries_of_one_arm():
    queries = FakeQueries(refused=300)
    start, goal = Reach().sample(cell_with(queries), np.random.default_rng(0))
    assert len(queries.first) == 3  # arm0 in the failed draw, in the second one, and for the goal
    np.testing.assert_array_equal(start["arm0"], queries.first[1])
    np.testing.assert_array_equal(goal["arm0"], queries.first[2])


@pytest.mark.usefixtures("paths_everywhere")
def test_the_last_try_still_counts():
    queries = FakeQueries(refused=299)
    start, _ = Reach().sample(cell_with(queries), np.random.default_rng(0))
    np.testing.assert_array_equal(start["arm0"], queries.first[0])


def test_the_task_gives_up_after_its_draws_and_names_cell_and_arm():
    queries = FakeQueries(refused=10**9)
    with pytest.raises(MmpError, match=r"no start for cell 'ring-2' in 100 draws: 100 of them ended at arm 'arm1'"):
        Reach().sample(cell_with(queries), np.random.default_rng(0))
    assert queries.tried["arm1"] == 100 * 300 + 100 * 6000


def test_a_cell_without_room_is_an_error_that_names_the_obstructing_bodies():
    filled = toys.solid("box", [0, 0, 0.5], size=[1.2, 1.2, 1.0])
    ring = ring_cell(2)
    cell = Cell(name="filled", arms=ring.arms, obstacles=(filled,))
    message = r"'filled' in 3 draws: 3 of them ended at arm 'arm0'.*too close are arm0/\w+ and obstacle/solid"
    with pytest.raises(MmpError, match=message):
        Reach(draws=3).sample(cell, np.random.default_rng(0))


def test_arms_of_different_robots_share_a_cell():
    places = {"panda": [-0.4, 0, 0], "ur5e": [0.4, 0, 0], "piper": [0, 0.3, 0]}
    arms = tuple(place_arm(robot, robot, position, [1, 0, 0, 0]) for robot, position in places.items())
    start, _ = Reach().sample(Cell(name="mixed", arms=arms), np.random.default_rng(0))
    assert {name: q.shape for name, q in start.items()} == {"panda": (7,), "ur5e": (6,), "piper": (6,)}


def test_the_clearance_asked_for_is_kept():
    cell = ring_cell(2)
    for state in Reach(clearance=0.15, static_clearance=0.008).sample(cell, np.random.default_rng(1)):
        assert clearance.pair_clearance(cell, "arm0", state["arm0"], "arm1", state["arm1"]) >= 0.15 - 1e-12
        assert clearance.least_clearance(cell, state) >= 0.008 - 1e-12


@pytest.mark.parametrize(
    "options",
    [
        {"clearance": -0.01},
        {"clearance": float("nan")},
        {"clearance": "far"},
        {"tries": 0},
        {"draws": 1.5},
        {"tries": True},
    ],
)
def test_a_bad_option_is_named(options):
    with pytest.raises(MmpError, match=f"{next(iter(options))} of task 'reach' is"):
        mmp_tasks.make("reach", **options)


def test_an_unknown_option_names_the_nearest_and_all_known():
    with pytest.raises(
        UnknownNameError, match=r"option of task 'reach' 'trys'.* Did you mean 'tries'.*clearance, draws"
    ):
        mmp_tasks.make("reach", trys=3)


def test_the_task_is_registered_with_its_options():
    assert "reach" in mmp_tasks.names()
    assert mmp_tasks.make("reach") == Reach()
    description = mmp_tasks.describe("reach")
    assert description.options == {"clearance": 0.01, "static_clearance": 0.0025, "tries": 300, "draws": 100}
    assert description.summary.startswith("Random configurations")


LAYOUTS = [("ring-2", True), ("ring-8", True), ("ring-8-piper", True), ("mixed-4", True), ("line-16", False)]


@pytest.mark.parametrize(("name", "is_open"), LAYOUTS)
def test_rings_share_their_open_middle_and_lines_do_not(name, is_open):
    assert has_open_middle(find_cell(name)) is is_open


def test_a_post_in_the_middle_leaves_no_open_middle():
    ring = ring_cell(4)
    for position, size, is_open in (
        ([0, 0, 0.5], [0.1, 0.1, 1.0], False),
        ([0, 0, 1.2], [0.1, 0.1, 0.4], True),  # above the space
        ([0.2, 0, 0.5], [0.1, 0.1, 1.0], True),  # beside the axis
    ):
        post = toys.solid("box", position, size=size)
        assert has_open_middle(replace(ring, obstacles=(*ring.obstacles, post))) is is_open


@pytest.mark.parametrize("name", ["line-10", "line-16-panda"])
def test_in_a_line_every_tool_point_is_where_two_other_arms_reach_as_well(name):
    cell = find_cell(name)
    for seed in range(2):
        for state in Reach().sample(cell, np.random.default_rng(seed)):
            assert 0.8 * clearance.least_clearance(cell, state) > DEFAULT_MARGIN_M
            for arm in cell.arms:
                x, y, z = kinematics.tool_point(arm, state[arm.name])
                others = [other for other in cell.arms if other is not arm]
                reached = [np.hypot(*(other.position[:2] - (x, y))) <= 0.75 * other.robot.reach for other in others]
                assert sum(reached) >= 2
                assert 0.05 - 1e-9 <= z <= 0.80 + 1e-9


def test_in_a_line_a_seed_gives_the_same_instance_in_every_version():
    _, goal = Reach().sample(find_cell("line-16"), np.random.default_rng(7))
    assert goal["arm15"].tolist() == [
        -0.03526733896964984,
        -2.2758465529968257,
        0.04072898139800385,
        1.647526075813299,
        -1.4685591310962738,
        -1.4945593121500642,
    ]


def test_two_arms_far_apart_have_no_neighbours():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [100, 0, 0]))
    assert not has_open_middle(cell)
    assert neighbours(cell, cell.arms[0]) == []
    space = neighbourhood(cell, cell.arms[0])
    assert space.contains(np.array([[0, 0, 0.5], [0, 0, 0.9]])).tolist() == [True, False]


def test_arms_that_cannot_stand_beside_each_other_are_an_error_that_names_one():
    filled = toys.solid("box", [0, 0, 0.5], size=[9.0, 9.0, 1.0])
    line = find_cell("line-10")
    cell = replace(line, name="filled", obstacles=(filled,))
    with pytest.raises(MmpError, match=r"no start for cell 'filled' in 2 draws: 2 of them ended at arm 'arm0'"):
        Reach(draws=2).sample(cell, np.random.default_rng(0))
