"""Edges, conflicts and certificates of the core against dense sampling by the reference implementation.

Sampling leaves a slack: the least clearance of a motion lies between that of its samples and the slack below that.
Tests skip cases that the slack leaves undecided, and check that enough cases were decided.
"""

import numpy as np
import pytest
from reference import clearance, motion, toys

from mmp_env import core
from mmp_env.errors import MmpError
from mmp_env.model.rings import ring_cell
from mmp_env.robot_folders import robot_names
from mmp_tasks.reach import Reach

FLOAT_M = 1e-5
KEPT = 0.6
"""Clearance proved between steps, relative to the margin at the steps."""
MIXES = [
    ("ur5e", "ur5e", "28", 0.002),
    ("panda", "piper", "fine", 0.002),
    ("fr5", "piper", "28", 0.002),
    ("piper", "panda", "28", 0.05),
]


def edges_to_ask_about(rng, cell, margin):
    """Returns short edges of arm0: in contact at an end, in contact in the middle, free, and random."""
    arm, queries = cell.arms[0], cell.collision
    q_from = toys.random_configurations(rng, arm, 1500)
    q_to = np.clip(q_from + rng.uniform(-0.2, 0.2, q_from.shape), arm.robot.lower, arm.robot.upper)
    least = np.min([queries.static_clearance("arm0", q) for q in (q_from, (q_from + q_to) / 2, q_to)], axis=0)
    kinds = [least < 0, (least > margin) & (least < 0.04), least > -1]
    rows = np.concatenate([np.flatnonzero(kind)[:5] for kind in kinds])
    return q_from[rows], q_to[rows]


@pytest.mark.parametrize(("robot", "margin"), [*((name, 0.002) for name in robot_names()), ("panda", 0.006)])
def test_an_edge_is_free_where_all_its_samples_are_and_not_where_one_is_in_contact(robot, margin):
    rng = np.random.default_rng(41)
    cell = toys.random_cell(rng, [robot, "ur5e"], "28")
    q_from, q_to = edges_to_ask_about(rng, cell, margin)
    found = cell.collision.edge_free("arm0", q_from, q_to, margin=margin)
    decided = {True: 0, False: 0}
    for k in range(len(q_from)):
        sampled = [clearance.static_clearance(cell, "arm0", q) for q in motion.along(q_from[k], q_to[k], 25)]
        # The clearance between two samples falls by less than it changes from one sample to the next.
        change = np.abs(np.diff(sampled)).max()
        if min(sampled) < margin - FLOAT_M:
            assert not found[k]
            decided[False] += 1
        elif min(sampled) - change > margin + 1e-4 + FLOAT_M:
            assert found[k]
            decided[True] += 1
    assert min(decided.values()) >= 3


def test_an_edge_through_a_thin_wall_is_not_free_though_few_of_its_configurations_touch_it():
    wall = toys.solid("box", [1.5, 0, 0], size=[2.0, 0.001, 1.0])
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), obstacles=[wall])
    before, after = np.array([[-1.5, 0]]), np.array([[1.5, 0]])
    assert clearance.static_clearance(cell, "a", before[0]) > 0.5
    assert not cell.collision.edge_free("a", before, after)[0]
    assert cell.collision.edge_free("a", before, np.array([[-0.4, 0]]))[0]


def test_an_edge_that_is_a_point_is_free_where_the_point_is():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), obstacles=[toys.solid("sphere", [2, 0, 0], radius=0.1)])
    q = np.array([[0.0, 0], [1.0, 0]])
    assert cell.collision.edge_free("a", q, q).tolist() == [False, True]


def test_an_edge_out_of_the_limits_is_not_free():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]))
    q = np.array([[3.0, 0]])
    assert cell.collision.edge_free("a", q, [[3.1, 0]])[0]
    assert not cell.collision.edge_free("a", q, [[3.2, 0]])[0]
    with pytest.raises(MmpError, match="q_from has 1 rows and q_to 2"):
        cell.collision.edge_free("a", q, np.zeros((2, 2)))


def wandering_paths(rng, cell, lengths, step):
    """Returns a path on the grid for each arm: the first two start near each other, and turn every third step."""
    starts = [toys.random_configurations(rng, arm, 300) for arm in cell.arms]
    nearest = np.argmin(np.abs(cell.collision.pair_clearance("arm0", starts[0], "arm1", starts[1]) - 0.03))
    paths = []
    for arm, start, steps in zip(cell.arms, starts, lengths, strict=True):
        q = [start[nearest]]
        for k in range(steps):
            move = rng.uniform(-step, step, arm.dof) if k % 3 == 0 else move
            q.append(np.clip(q[-1] + move, arm.robot.lower, arm.robot.upper))
        paths.append(np.array(q))
    return paths


@pytest.mark.parametrize(("robot_a", "robot_b", "spheres", "margin"), MIXES)
def test_the_instants_of_conflict_are_those_that_dense_sampling_finds(robot_a, robot_b, spheres, margin):
    rng = np.random.default_rng(42)
    decided = {"at": 0, "not at": 0, "not between": 0}
    for lengths, step in [((11, 5), 0.08), ((3, 12), 0.3), ((0, 10), 0.08), ((9, 9), 0.3)]:
        cell = toys.random_cell(rng, [robot_a, robot_b], spheres, obstacles=False)
        a, b = wandering_paths(rng, cell, lengths, step)
        found = instants_of(cell, a, b, margin)
        check_instants(cell, a, b, margin, found, decided)
        swapped = instants_of(cell, b, a, margin, names=("arm1", "arm0"))
        np.testing.assert_array_equal(np.floor(swapped), np.floor(found))
    assert min(decided.values()) >= 3


def instants_of(cell, path_a, path_b, margin, names=("arm0", "arm1")):
    queries = cell.collision
    motions = [queries.motion(name, path) for name, path in zip(names, (path_a, path_b), strict=True)]
    return queries.conflict_instants(motions, [(0, 1)], core.Levels(margin, KEPT * margin))[0]


def check_instants(cell, a, b, margin, found, decided):
    last = max(len(a), len(b)) - 1
    q_a, q_b = motion.padded(a, last), motion.padded(b, last)
    at_step = [clearance.moving_clearance(cell, "arm0", q_a[k], "arm1", q_b[k]) for k in range(last + 1)]
    for k in range(last + 1):
        if abs(at_step[k] - margin) > FLOAT_M:
            assert (k in found) == (at_step[k] < margin)
            decided["at" if k in found else "not at"] += 1
    for k, (least, slack) in enumerate(motion.step_clearances(cell, "arm0", a, "arm1", b, samples=12)):
        between = found[(found > k) & (found < k + 1)]
        assert len(between) <= 1
        if least < KEPT * margin - FLOAT_M:
            assert len(between) or k in found or k + 1 in found
        if least - slack > margin + FLOAT_M:
            assert not len(between)
            decided["not between"] += 1
        for t in between:
            q = [path[k] + (t - k) * (path[k + 1] - path[k]) for path in (q_a, q_b)]
            assert clearance.moving_clearance(cell, "arm0", q[0], "arm1", q[1]) < margin + FLOAT_M


def test_a_contact_between_two_steps_is_found_and_placed():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi))
    still = np.zeros((1, 2))
    for passing in (0.2, 0.5, 0.8):
        # The tip of a passes the tip of b at the fraction `passing` of the second step.
        a = np.array([[-1.5, 0], [-1.0 * passing, 0], [1.0 * (1 - passing), 0], [1.5, 0]])
        assert motion.conflicting_steps(cell, "a", a, "b", still, 0.002) == [1]
        for found in (instants_of(cell, a, still, 0.002, ("a", "b")), instants_of(cell, still, a, 0.002, ("b", "a"))):
            # They touch where the angle is less than 0.1 rad.
            assert found == pytest.approx([1 + passing - 0.1], abs=0.04)


def test_a_finished_arm_stays_at_its_goal_and_still_collides():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi))
    parked = np.array([[0.3, 0], [0.0, 0]])
    passing = np.array([[x, 0] for x in (-1.5, -1.0, -0.5, 0.05, 1.0)])
    assert instants_of(cell, passing, parked, 0.002, ("a", "b")).tolist() == [3]
    assert instants_of(cell, parked, passing, 0.002, ("b", "a")).tolist() == [3]


def test_results_are_in_the_order_of_the_given_pairs_of_motions():
    rng = np.random.default_rng(43)
    cell = toys.random_cell(rng, ["ur5e", "panda", "piper"], "28", obstacles=False)
    paths = wandering_paths(rng, cell, (8, 6, 9), step=0.1)
    motions = [cell.collision.motion(arm, path) for arm, path in zip(cell.arm_names, paths, strict=True)]
    pairs = [(2, 1), (0, 1), (0, 2)]
    found = cell.collision.conflict_instants(motions, pairs, core.Levels(0.05, KEPT * 0.05))
    for (i, j), instants in zip(pairs, found, strict=True):
        alone = instants_of(cell, paths[i], paths[j], 0.05, names=(f"arm{i}", f"arm{j}"))
        np.testing.assert_array_equal(instants, alone)


def paths_from_a_valid_state(cell, seed, steps, size):
    rng = np.random.default_rng(seed)
    state, _ = Reach().sample(cell, rng)
    out = []
    for arm in cell.arms:
        moves = rng.uniform(-size, size, (steps, arm.dof))
        path = np.vstack([state[arm.name], state[arm.name] + np.cumsum(moves, axis=0)])
        out.append(np.clip(path, arm.robot.lower, arm.robot.upper))
    return out


def sampled_clearance(cell, paths, samples):
    """Returns the least clearance of dense samples, and the slack between samples [m]."""
    arms = cell.arm_names
    least, slack = np.inf, 0.0
    for k in range(len(paths[0]) - 1):
        sampled_paths = [motion.along(path[k], path[k + 1], samples) for path in paths]
        states = [dict(zip(arms, qs, strict=True)) for qs in zip(*sampled_paths, strict=True)]
        least = min([least, *(clearance.least_clearance(cell, state) for state in states)])
        travel = [
            motion.travel_bound(arm, cell.spheres, p[k + 1] - p[k]) for arm, p in zip(cell.arms, paths, strict=True)
        ]
        slack = max(slack, sum(sorted(travel)[-2:]) / samples)
    return least, slack


@pytest.mark.parametrize(("count", "robot", "spheres"), [(4, "ur5e", "28"), (2, "panda", "fine"), (4, "piper", "28")])
def test_a_certificate_proves_nearly_what_dense_sampling_finds_and_never_more(count, robot, spheres):
    cell = ring_cell(count, robot, spheres)
    verdicts = set()
    for seed in range(5):
        paths = paths_from_a_valid_state(cell, seed, steps=2, size=0.1 if seed < 3 else 0.6)
        required, tolerance, share = 0.001, 1e-4, 1e-4
        wanted = core.Levels(required, required)
        proof = core.certify(cell.collision.core, paths, wanted, share, core.Clock(60.0))
        least, slack = sampled_clearance(cell, paths, samples=8)
        valid, proved = proof.valid, proof.clearance
        verdicts.add(valid)
        if least < required - 1e-9:
            assert not valid
        if least - slack > required:
            assert valid
        if valid:
            assert required <= proved <= least + 1e-9
            # The proof aims at all but a ten-thousandth of the sampled clearance beyond the required one.
            assert proved >= max(required, least - slack - 4 * tolerance)
    assert verdicts == {True, False}, "both kinds of motions are among those that were tried"


def test_a_refused_certificate_names_the_arms_and_the_place():
    cell = toys.toy_cell(
        toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi), toys.toy_arm("c", [0, 9, 0])
    )
    still = np.zeros((4, 2))
    crossing = np.array([[-1.5, 0], [-1.0, 0], [0.6, 0], [1.0, 0]])
    proof = core.certify(
        cell.collision.core, [crossing, still, still], core.Levels(0.001, 0.001), 1e-4, core.Clock(60.0)
    )
    assert (proof.valid, proof.arm_a, proof.arm_b, proof.segment) == (False, 0, 1, 1)
    assert proof.clearance <= 0.001
    where = crossing[1] + proof.fraction * (crossing[2] - crossing[1])
    assert clearance.pair_clearance(cell, "a", where, "b", still[0]) < 0.01


def test_a_certificate_that_ran_out_of_time_is_none():
    cell = ring_cell(2)
    paths = paths_from_a_valid_state(cell, 0, steps=3, size=0.01)
    assert core.certify(cell.collision.core, paths, core.Levels(0.0005, 0.0005), 1e-4, core.Clock(60.0)).valid
    expired = core.Clock(60.0)
    expired.cancel()
    assert not core.certify(cell.collision.core, paths, core.Levels(0.0005, 0.0005), 1e-4, expired).valid
