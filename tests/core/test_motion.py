"""Edges, conflicts between trajectories and certificates of the core against dense sampling by the twin.

Sampling leaves a slack: clearances of whole motions are known to lie between (least sample - slack) and the least sample.
Where that decides nothing, nothing is asked; each test sees to it that enough was decided.
"""

import numpy as np
import pytest
from twins import clearance, motion, toys

from mmp_env import _core
from mmp_env.collision import HIT, KEEP_PROOF, PLAN_PROOF
from mmp_env.errors import MmpError
from mmp_env.rings import ring_cell
from mmp_env.robot import robot_names
from mmp_tasks.reach import Reach

FLOAT_M = 1e-5
MIXES = [("ur5e", "ur5e", "28"), ("panda", "panda", "fine"), ("fr5", "piper", "28"), ("piper", "panda", "28")]


@pytest.mark.parametrize("margin", [0.002, 0.02])
@pytest.mark.parametrize("robot", robot_names())
def test_an_edge_is_free_where_all_its_samples_are_and_not_where_one_is_in_contact(robot, margin):
    rng = np.random.default_rng(41)
    cell = toys.random_cell(rng, [robot, "ur5e"], "28")
    arm = cell.arms[0]
    q_from = toys.random_configurations(rng, arm, 400)
    q_from = q_from[cell.collision.static_clearance("arm0", q_from) > margin][:25]
    q_to = np.clip(q_from + rng.uniform(-0.25, 0.25, q_from.shape), arm.robot.lower, arm.robot.upper)
    found = cell.collision.edge_free("arm0", q_from, q_to, margin=margin)
    decided = {True: 0, False: 0}
    for k in range(len(q_from)):
        least = motion.edge_clearance(cell, "arm0", q_from[k], q_to[k], samples=60)
        if least < PLAN_PROOF * margin - FLOAT_M:
            assert not found[k]
            decided[False] += 1
        elif least - motion.edge_slack(cell, "arm0", q_from[k], q_to[k], samples=60) > margin + FLOAT_M:
            assert found[k]
            decided[True] += 1
    assert min(decided.values()) >= 2


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


def wandering_paths(rng, cell, lengths, step=0.08):
    """A path on the grid for each arm, from anywhere, with a new direction at every third step."""
    paths = []
    for arm, steps in zip(cell.arms, lengths, strict=True):
        q = [toys.random_configurations(rng, arm, 1)[0]]
        for k in range(steps):
            move = rng.uniform(-step, step, arm.dof) if k % 3 == 0 else move
            q.append(np.clip(q[-1] + move, arm.robot.lower, arm.robot.upper))
        paths.append(np.array(q))
    return paths


@pytest.mark.parametrize("margin", [0.002, 0.05])
@pytest.mark.parametrize(("robot_a", "robot_b", "spheres"), MIXES)
def test_the_steps_in_conflict_are_those_that_dense_sampling_finds(robot_a, robot_b, spheres, margin):
    rng = np.random.default_rng(42)
    decided = {True: 0, False: 0}
    for lengths in [(11, 5), (3, 12), (0, 10), (9, 9)]:
        cell = toys.random_cell(rng, [robot_a, robot_b], spheres, obstacles=False)
        for _ in range(3):
            a, b = wandering_paths(rng, cell, lengths, step=rng.choice([0.08, 0.3]))
            found = conflicts_of(cell, a, b, margin)
            check_flags(cell, a, b, margin, found, decided)
            np.testing.assert_array_equal(conflicts_of(cell, b, a, margin, names=("arm1", "arm0")), found)
    assert min(decided.values()) >= 10


def conflicts_of(cell, path_a, path_b, margin, names=("arm0", "arm1")):
    queries = cell.collision
    motions = [queries.motion(name, path) for name, path in zip(names, (path_a, path_b), strict=True)]
    return queries.conflict_steps(motions, [(0, 1)], margin)[0]


def check_flags(cell, a, b, margin, found, decided):
    """Every contact is at a flagged step or next to one; no flag stands where all around it is free."""
    last = max(len(a), len(b)) - 1
    flagged = [k in found for k in range(last + 1)]
    assert set(found) <= set(range(last + 1))
    q_a, q_b = motion.padded(a, last), motion.padded(b, last)
    at_step = [clearance.moving_clearance(cell, "arm0", q_a[k], "arm1", q_b[k]) for k in range(last + 1)]
    within = motion.step_clearances(cell, "arm0", a, "arm1", b, samples=16)
    for k in range(last + 1):
        if at_step[k] < HIT * margin - FLOAT_M:
            assert flagged[k]
            decided[True] += 1
        around = [least - slack for least, slack in within[max(k - 1, 0) : k + 1]]
        if min([at_step[k], *around]) > HIT * margin + FLOAT_M:
            assert not flagged[k]
            decided[False] += 1
    for k, (least, _) in enumerate(within):
        if least < KEEP_PROOF * margin - FLOAT_M:
            assert flagged[k] or flagged[k + 1]


def test_a_contact_between_two_steps_counts_for_the_nearer_one():
    cell = toys.toy_cell(toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi))
    still = np.zeros((1, 2))
    for meeting, expected in [(0.2, [1]), (0.8, [2])]:
        # The tip of a passes that of b within the second step, `meeting` of the way through it.
        a = np.array([[-1.5, 0], [-1.0 * meeting, 0], [1.0 * (1 - meeting), 0], [1.5, 0]])
        margin = 0.002
        assert motion.conflicting_steps(cell, "a", a, "b", still, margin) == [1]
        assert conflicts_of(cell, a, still, margin, names=("a", "b")).tolist() == expected


def test_every_pair_of_motions_that_is_asked_for_is_answered_in_its_place():
    rng = np.random.default_rng(43)
    cell = toys.random_cell(rng, ["ur5e", "panda", "piper"], "28", obstacles=False)
    paths = wandering_paths(rng, cell, (8, 6, 9))
    motions = [cell.collision.motion(arm, path) for arm, path in zip(cell.arm_names, paths, strict=True)]
    pairs = [(2, 1), (0, 1), (0, 2)]
    found = cell.collision.conflict_steps(motions, pairs, 0.05)
    for (i, j), steps in zip(pairs, found, strict=True):
        alone = conflicts_of(cell, paths[i], paths[j], 0.05, names=(f"arm{i}", f"arm{j}"))
        np.testing.assert_array_equal(steps, alone)


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
    """Least clearance over everything of dense samples, and how far below it may be in between [m]."""
    arms = cell.arm_names
    least, slack = np.inf, 0.0
    for k in range(len(paths[0]) - 1):
        ways = [motion.along(path[k], path[k + 1], samples) for path in paths]
        states = [dict(zip(arms, qs, strict=True)) for qs in zip(*ways, strict=True)]
        least = min([least, *(clearance.least_clearance(cell, state) for state in states)])
        travel = [
            motion.travel_bound(arm, cell.spheres, p[k + 1] - p[k]) for arm, p in zip(cell.arms, paths, strict=True)
        ]
        slack = max(slack, sum(sorted(travel)[-2:]) / samples)
    return least, slack


@pytest.mark.parametrize(("count", "robot", "spheres"), [(4, "ur5e", "28"), (2, "panda", "fine"), (2, "piper", "28")])
def test_a_certificate_proves_nearly_what_dense_sampling_finds_and_never_more(count, robot, spheres):
    cell = ring_cell(count, robot, spheres)
    verdicts = []
    for seed in range(10):
        paths = paths_from_a_valid_state(cell, seed, steps=3, size=0.1)
        required, tolerance = 0.001, 1e-4
        valid, proved, *_ = _core.certify(cell.collision.core, paths, required, tolerance, _core.Clock(60.0))
        least, slack = sampled_clearance(cell, paths, samples=25)
        verdicts.append(valid)
        if least < required - 1e-9:
            assert not valid
        if least - slack > required:
            assert valid
        if valid:
            assert required <= proved <= least + 1e-9
            # Each lowering of the aim is two tolerances.
            assert proved >= max(required, least - slack - 4 * tolerance)
    assert True in verdicts
    assert False in verdicts


def test_a_refused_certificate_names_the_arms_and_the_place():
    cell = toys.toy_cell(
        toys.toy_arm("a", [0, 0, 0]), toys.toy_arm("b", [4, 0, 0], yaw=np.pi), toys.toy_arm("c", [0, 9, 0])
    )
    still = np.zeros((4, 2))
    crossing = np.array([[-1.5, 0], [-1.0, 0], [0.6, 0], [1.0, 0]])
    valid, found, arm_a, arm_b, step, fraction = _core.certify(
        cell.collision.core, [crossing, still, still], 0.001, 1e-4, _core.Clock(60.0)
    )
    assert (valid, arm_a, arm_b, step) == (False, 0, 1, 1)
    assert found < 0.001
    where = crossing[1] + fraction * (crossing[2] - crossing[1])
    assert clearance.pair_clearance(cell, "a", where, "b", still[0]) < 0.01


def test_a_certificate_that_ran_out_of_time_is_none():
    cell = ring_cell(2)
    paths = paths_from_a_valid_state(cell, 0, steps=3, size=0.01)
    assert _core.certify(cell.collision.core, paths, 0.0005, 1e-4, _core.Clock(60.0))[0]
    expired = _core.Clock(60.0)
    expired.cancel()
    assert not _core.certify(cell.collision.core, paths, 0.0005, 1e-4, expired)[0]
