"""Margins: every plan keeps them at every instant with a proof, or the instance is refused."""

import dataclasses
import itertools
import json
import re

import numpy as np
import pytest
from reference import clearance
from support import two_arms

from mmp_env import check_plan, make_problem
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_env.model.arm import Obstacle
from mmp_env.model.margins import DEFAULT_MARGIN_M, KIND_WORDS, KINDS, Margins, asked_margins, millimetres
from mmp_env.model.rings import ring_cell
from mmp_env.retime import retime_with_report
from mmp_env.retime.limits import split
from mmp_env.sim.servo_reference import Reference
from mmp_planners import make, names

FLOAT_M = 1e-9


def with_a_post():
    """Returns a problem of two arms with a post that the left arm passes."""
    post = Obstacle(
        name="post",
        shape="cylinder",
        position=np.array([0.0, 0.0, 0.2]),
        quaternion=np.array([1.0, 0, 0, 0]),
        radius=0.05,
        length=0.4,
    )
    return dataclasses.replace(two_arms.facing_cell(1.5), obstacles=(post,))


def swinging(margin=None):
    """Returns a problem in which both hands swing across. Straight lines collide halfway."""
    start, goal = ({arm: two_arms.reaching(pan) for arm in ("left", "right")} for pan in (0.8, -0.8))
    return make_problem(with_a_post(), start, goal, margin=margin)


def least_sampled(plan):
    """Returns kind -> least clearance [m] at many instants of a plan, by the reference implementation."""
    cell = plan.problem.cell
    q = plan.sampled(plan.finer_times(0.02))
    (a, qa), (b, qb) = q.items()
    least = dict.fromkeys(KINDS, np.inf)
    for row_a, row_b in zip(qa, qb, strict=True):
        least["arms"] = min(least["arms"], clearance.pair_clearance(cell, a, row_a, b, row_b))
        for name, row in ((a, row_a), (b, row_b)):
            least["self"] = min(least["self"], clearance.self_clearance(cell, name, row))
            least["obstacles"] = min(least["obstacles"], clearance.obstacle_clearance(cell, name, row))
    return least


@pytest.mark.parametrize("name", names())
def test_every_planner_keeps_the_given_margins(name):
    asked = {"arms": 0.06, "obstacles": 0.03}
    problem = swinging(asked)
    plan = make(name).plan(problem, seed=1, time_limit=60.0).plan
    assert plan is not None
    report = check_plan(plan)
    assert report.valid, report
    assert all(report.proved_m[kind] >= problem.margins[kind] for kind in KINDS)
    least = least_sampled(plan)
    for kind, margin in asked.items():
        assert problem.margins[kind] == margin
        assert least[kind] >= margin - FLOAT_M


def test_a_retimed_plan_keeps_the_given_margins():
    problem = swinging({"arms": 0.06, "obstacles": 0.03})
    plan, _ = retime_with_report(make("auto").plan(problem, seed=1, time_limit=60.0).plan)
    report = check_plan(plan)
    assert report.valid, report
    assert all(least >= problem.margins[kind] - FLOAT_M for kind, least in least_sampled(plan).items())


@pytest.mark.parametrize("rate_hz", [20.0, 250.0])
def test_the_reference_of_an_execution_keeps_the_given_margins(rate_hz):
    problem = swinging({"arms": 0.06, "obstacles": 0.03})
    plan, _ = retime_with_report(make("auto").plan(problem, seed=1, time_limit=60.0).plan, rate=rate_hz)
    reference = Reference(plan, problem.start)
    clock = np.linspace(reference.start_s, reference.end_s, 1500)
    q = split(problem.cell, reference.at(clock)[0])
    followed = dataclasses.replace(plan, times=clock - clock[0], positions=q, velocities=None, accelerations=None)
    assert all(least >= problem.margins[kind] - 1e-5 for kind, least in least_sampled(followed).items())


def test_one_number_is_for_arms_and_obstacles_and_not_for_an_arm_against_itself():
    margins = swinging(0.02).margins
    assert (margins.arms, margins.obstacles) == (0.02, 0.02)
    assert margins.self == swinging().margins.self <= DEFAULT_MARGIN_M


@pytest.mark.parametrize("kind", KINDS)
def test_a_margin_that_start_or_goal_violates_is_refused_with_the_largest_possible(kind):
    free = swinging()
    ends = [free.cell.collision.nearest(q)[kind].clearance_m for q in (free.start, free.goal)]
    room = {kind: ends[0] if ends[0] < ends[1] + 0.005 else ends[1]}
    with pytest.raises(InvalidInstanceError) as refused:
        swinging({kind: room[kind] + 0.005})
    message = str(refused.value)
    assert f"{room[kind] * 1e3:.2f} mm apart" in message
    assert f"the margin asked for {KIND_WORDS[kind]} is" in message
    assert {"arms": " and right/", "obstacles": "obstacle/post", "self": "/"}[kind] in message
    largest = float(message.split("the largest that would do is ")[1].split(" mm")[0]) / 1e3
    assert room[kind] - 1e-4 < largest < room[kind]
    assert swinging({kind: largest}).margins[kind] == largest


def test_the_largest_possible_margin_holds_for_arms_and_obstacles():
    with pytest.raises(InvalidInstanceError) as refused:
        swinging(5.0)
    largest = float(str(refused.value).split("the largest that would do is ")[1].split(" mm")[0]) / 1e3
    assert swinging(largest).margins.arms == largest


def test_margins_that_differ_are_answered_with_the_largest_of_each():
    with pytest.raises(InvalidInstanceError, match=r"would do are [\d.]+ mm between arms and [\d.]+ mm to obstacles"):
        swinging({"arms": 5.0, "obstacles": 6.0})


def test_the_default_is_less_where_start_or_goal_is_tight_for_that_kind_alone():
    cell = two_arms.facing_cell(1.4)
    near = [q for q in np.linspace(0.0, 0.6, 2000) if 1e-4 < _gap(cell, q) < 2e-3]
    tight = make_problem(cell, _poses(near[0]), _poses(0.8))
    room = _gap(cell, near[0])
    assert tight.margins.arms == pytest.approx(0.8 * room)
    assert tight.margins.self == swinging().margins.self
    with pytest.raises(InvalidInstanceError, match="would do"):
        make_problem(cell, _poses(near[0]), _poses(0.8), margin=DEFAULT_MARGIN_M)


def _poses(pan):
    return {"left": two_arms.reaching(pan), "right": two_arms.reaching(pan)}


def _gap(cell, pan):
    return cell.collision.nearest(_poses(pan))["arms"].clearance_m


def test_planners_look_farther_than_the_margins_but_not_farther_than_start_and_goal_allow():
    for margin in (None, 0.001, 0.05):
        problem = swinging(margin)
        ends = [problem.cell.collision.nearest(q) for q in (problem.start, problem.goal)]
        assert 0 < problem.slack <= 0.001
        for near, kind in itertools.product(ends, KINDS):
            assert problem.conflict_distances[kind] < near[kind].clearance_m


@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_the_nearest_bodies_are_those_of_the_reference_implementation(robot):
    rng = np.random.default_rng(5)
    boxes = [
        Obstacle(
            name=f"box{k}",
            shape="box",
            position=rng.uniform([-2, -2, 0], [2, 2, 2]),
            quaternion=np.array([1.0, 0, 0, 0]),
            size=np.full(3, 0.02),
        )
        for k in range(20)
    ]
    cell = ring_cell(4, robot)
    cell = dataclasses.replace(cell, obstacles=(*cell.obstacles, *boxes))
    for _ in range(10):
        q = {arm.name: rng.uniform(arm.robot.draw_lower, arm.robot.draw_upper) for arm in cell.arms}
        found = cell.collision.nearest(q)
        least = min(near.clearance_m for near in found.values())
        assert least == pytest.approx(clearance.least_clearance(cell, q), abs=1e-9)
        between = min(clearance.pair_clearance(cell, a, q[a], b, q[b]) for a, b in itertools.combinations(q, 2))
        assert found["arms"].clearance_m == pytest.approx(between, abs=1e-9)
        of_obstacles = min(clearance.obstacle_clearance(cell, arm, q[arm]) for arm in q)
        assert found["obstacles"].clearance_m == pytest.approx(of_obstacles, abs=1e-9)
        for kind, near in found.items():
            owners = [body.split("/")[0] for body in near.bodies.split(" and ")]
            assert (len(set(owners)) == 1) == (kind == "self")


def test_the_proved_clearance_of_each_kind_is_close_to_the_sampled_one():
    plan = make("auto").plan(swinging(), seed=1, time_limit=60.0).plan
    proved = check_plan(plan).proved_m
    for kind, least in least_sampled(plan).items():
        assert 0.9 * least - 0.005 < proved[kind] <= least + FLOAT_M


@pytest.mark.parametrize("kind", KINDS)
def test_the_checker_refutes_a_plan_whose_file_claims_more_than_it_keeps(kind):
    document = plan_to_dict(make("auto").plan(swinging(), seed=1, time_limit=60.0).plan)
    kept = check_plan(document)
    assert kept.valid
    document["problem"]["margins"][kind] = kept.proved_m[kind] + 0.05
    document["problem"]["margin"] = document["problem"]["margins"]["arms"]
    report = check_plan(document)
    rule = {"arms": "arm-arm", "obstacles": "arm-obstacle", "self": "self"}[kind]
    assert {violation.rule for violation in report.violations} == {rule}


def test_a_file_with_a_single_margin_is_checked_with_half_of_it():
    document = json.loads(json.dumps(plan_to_dict(make("auto").plan(swinging(0.02), seed=1, time_limit=60.0).plan)))
    del document["problem"]["margins"]
    document["problem"]["margin"] = 0.04
    assert plan_from_dict(document).problem.margins.arms == 0.02
    report = check_plan(document)
    assert report.required_m == 0.02
    assert report.margins_m == {"arms": 0.02, "obstacles": 0.02, "self": 0.02}
    assert {violation.rule for violation in report.violations} == {"self"}, "which that margin never was for"


@pytest.mark.parametrize(
    ("margin", "words"),
    [
        (0.0, "above 0"),
        (1e-320, "1e-12 at least"),
        ({"self": 9.9e-13}, "margin between parts of one arm is 9.9e-13"),
        (-1.0, "above 0"),
        (float("nan"), "finite"),
        (True, "finite number"),
        (10**400, "finite number"),
        pytest.param(10**5000, "finite number", id="a number of 5001 digits"),
        (1e10, "100 at most"),
        ({"arm": 0.1}, "Did you mean 'arms'"),
        ({"self": "2"}, "finite number"),
    ],
)
def test_a_malformed_margin_is_one_sentence(margin, words):
    with pytest.raises(MmpError, match=words):
        asked_margins(margin)


@pytest.mark.parametrize("number", [np.float32(0.25), np.int64(1)])
def test_a_margin_may_be_a_number_of_numpy(number):
    assert asked_margins({"arms": number}) == {"arms": float(number)}


@pytest.mark.parametrize(
    ("metres", "text"),
    [
        (0.002, "2"),
        (0.0149999, "14.99"),
        (1e-9, "1e-06"),
        (3.27e-6, "0.00327"),
        (1e-320, "0"),
        (1e300, "1e+303"),
        (np.inf, "inf"),
    ],
)
def test_a_margin_is_shown_in_millimetres_rounded_down(metres, text):
    assert millimetres(metres) == text


@pytest.mark.parametrize("metres", ["1e-320", "1e+300"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_problem_refuses_a_margin_below_the_rounding_of_clearances_and_beyond_all_cells(kind, metres):
    allowed = "it must be .* 1e-12 at least and 100 at most"
    with pytest.raises(MmpError, match=f"margin {KIND_WORDS[kind]} is {re.escape(metres)}; {allowed}"):
        dataclasses.replace(
            swinging(), margins=Margins(**{"arms": 1e-12, "obstacles": 1e-12, "self": 1e-12, kind: float(metres)})
        )


def test_margins_read_like_a_mapping():
    margins = Margins(arms=0.05, obstacles=0.02, self=0.002)
    assert dict(margins) == {"arms": 0.05, "obstacles": 0.02, "self": 0.002}
    assert asked_margins(margins) == dict(margins)


def test_a_margin_of_none_is_left_out():
    assert asked_margins({"arms": None, "obstacles": 0.003, "self": None}) == {"obstacles": 0.003}
    assert asked_margins(dict.fromkeys(KINDS)) == {}
    with pytest.raises(MmpError, match="unknown margin 'arm'"):
        asked_margins({"arm": None})
