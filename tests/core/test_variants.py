"""All variants of the core give the same bits: the same seed gives the same plan on every processor."""

import itertools

import numpy as np
import pytest
from reference import toys
from support.upright_problems import upright_problem

import mmp_env.model.collision
import mmp_tasks.alone
from mmp_env import core
from mmp_env.gym.instances import draw_instance
from mmp_env.model.collision import CollisionModel
from mmp_env.model.rings import ring_cell
from mmp_tasks.reach import Reach

MARGIN_M, PROOF_M = LEVELS = 0.002, 0.0015


def flattened(results):
    """Returns arrays, numbers and nested sequences of them as one list of arrays. None differs from every number."""
    if isinstance(results, list | tuple):
        return [array for item in results for array in flattened(item)]
    return [np.array(["nothing"]) if results is None else np.asarray(results)]


def by_every_variant(monkeypatch, cell, ask):
    """Returns `ask(core module, collision model)` for each variant that this processor runs."""
    out = {}
    for name in core.usable_variants():
        variant = core.load_variant(name)
        monkeypatch.setattr(mmp_env.model.collision, "core", variant)
        monkeypatch.setattr(mmp_tasks.alone, "core", variant)
        # Twice: this shows dependence on uninitialised memory, even with one variant.
        out[name], out[f"{name} again"] = (flattened(ask(variant, CollisionModel(cell))) for _ in range(2))
    return out


def assert_same_bits(results):
    reference = results["v1"]
    assert reference
    for name, arrays in results.items():
        assert len(arrays) == len(reference), name
        for found, expected in zip(arrays, reference, strict=True):
            assert found.dtype == expected.dtype, name
            np.testing.assert_array_equal(found, expected, err_msg=name)


MIXES = [(("ur5e", "panda", "piper"), "28"), (("panda", "fr5"), "fine"), (("panda", "panda"), "exact")]


def test_the_portable_variant_is_there_and_the_best_one_is_preferred(monkeypatch):
    names = core.usable_variants()
    assert names[0] == "v1"
    monkeypatch.delenv("MMP_CORE", raising=False)
    assert core.preferred_variant() == names[-1]


@pytest.mark.parametrize(("robots", "spheres"), MIXES)
def test_queries_agree_to_the_last_bit(monkeypatch, robots, spheres):
    rng = np.random.default_rng(72)
    cell = toys.random_cell(rng, robots, spheres)
    q = {arm.name: toys.random_configurations(rng, arm, 45) for arm in cell.arms}
    ends = {arm.name: q[arm.name] + rng.uniform(-0.3, 0.3, q[arm.name].shape) for arm in cell.arms}

    def ask(core, model):
        out = []
        for k, arm in enumerate(cell.arm_names):
            out += [model.spheres(arm, q[arm]), model.tool_points(arm, q[arm])]
            out += [model.static_clearance(arm, q[arm], precise=precise) for precise in (False, True)]
            for margin in (MARGIN_M, 0.01):
                wanted = core.Levels(margin, 0.75 * margin, 0.001, -0.0005)
                out.append(core.edges_free(model.core, k, q[arm], ends[arm], wanted))
        pairs = ("arm0", q["arm0"], "arm1", q["arm1"])
        out += [model.pair_clearance(*pairs, precise=precise) for precise in (False, True)]
        return [*out, model.clearance(q)]

    assert_same_bits(by_every_variant(monkeypatch, cell, ask))


def test_upright_tools_agree_to_the_last_bit(monkeypatch):
    problem = upright_problem(ring_cell(2), 6)
    cell, levels = problem.cell, (0.003, 0.0025, 0.0, 0.0, -0.002)
    rng = np.random.default_rng(75)
    q = {arm.name: toys.random_configurations(rng, arm, 45) for arm in cell.arms}
    start, goal = (np.concatenate([end[arm] for arm in cell.arm_names]) for end in (problem.start, problem.goal))

    def ask(core, model):
        out = []
        for k, arm in enumerate(cell.arm_names):
            moved, found = model.project_upright(arm, q[arm])
            ends = moved + 0.05
            out += [moved, found, model.tilt(arm, q[arm])]
            out.append(core.edges_free(model.core, k, moved, ends, core.Levels(*levels)))
            search = core.SingleArm(
                model.core,
                k,
                start=problem.start[arm],
                goals=problem.goal[arm][None],
                max_step=np.full(6, 0.08),
                levels=core.Levels(*levels),
                seed=3,
            )
            out.append(search.plan([], 3, core.Clock(600.0)))
        composite = core.CompositeSearch(
            model.core, start=start, goals=goal[None], samples=core.Levels(*levels), edges=core.Levels(*levels), seed=3
        )
        groups = core.GroupSearch(
            model.core, start=start, goal=goal, samples=core.Levels(*levels), edges=core.Levels(*levels), seed=3
        )
        return [*out, *(search.grow(300, core.Clock(600.0)) for search in (composite, groups))]

    assert_same_bits(by_every_variant(monkeypatch, cell, ask))


@pytest.mark.parametrize(("robots", "spheres"), MIXES)
def test_conflicts_and_forces_agree_to_the_last_bit(monkeypatch, robots, spheres):
    rng = np.random.default_rng(73)
    cell = toys.random_cell(rng, robots, spheres)
    starts = [toys.random_configurations(rng, arm, 300) for arm in cell.arms]
    near = np.argsort(np.abs(cell.collision.pair_clearance("arm0", starts[0], "arm1", starts[1]) - 0.03))[:6]
    paths = [
        [
            start[k] + np.cumsum(rng.uniform(-0.05, 0.05, (20, arm.dof)), axis=0)
            for arm, start in zip(cell.arms, starts, strict=True)
        ]
        for k in near
    ]
    pairs = np.array([(i, j) for i in range(len(cell.arms)) for j in range(i)], dtype=np.int32)

    def ask(core, model):
        out = []
        for set_of_paths in paths:
            first, *others = motions = [core.Motion(model.core, k, path) for k, path in enumerate(set_of_paths)]
            out += core.conflict_instants(model.core, motions, pairs, core.Levels(0.02, 0.012))
            out += [
                core.repulsive_force(model.core, first, others, core.RepulsionSettings(centre_distance=centre))
                for centre in (False, True)
            ]
            out += [descent(core, model, first, others, normalised) for normalised in (False, True)]
        return out

    assert_same_bits(by_every_variant(monkeypatch, cell, ask))


def descent(core, model, first, others, normalised):
    """Returns six iterations of ModifyMotion, regardless of static contacts."""
    modified = core.modify_motion(
        model.core,
        first,
        others=others,
        constraints=[],
        max_step_rad=np.full(model.cell.arms[0].dof, 1.0),
        levels=core.Levels(-1.0, -1.0),
        constraint_margin=0.001,
        settings=core.RepulsionSettings(alpha=1e-6, max_iterations=6, normalised=normalised),
        clock=core.Clock(60.0),
        trace=True,
    )
    return [
        modified.positions,
        modified.moved,
        modified.iterations,
        modified.input_breaks_constraint,
        modified.trace,
    ]


@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_single_arm_plans_and_certificates_agree_to_the_last_bit(monkeypatch, robot):
    cell = ring_cell(2, robot)
    start, goal = Reach().sample(cell, np.random.default_rng(74))

    def ask(core, model):
        planners = [
            core.SingleArm(
                model.core,
                k,
                start=start[arm],
                goals=np.stack([goal[arm], 0.9 * goal[arm], 0.5 * start[arm] + 0.4 * goal[arm]]),
                max_step=np.full(cell.arms[k].dof, 0.08),
                levels=core.Levels(*LEVELS),
                seed=k,
            )
            for k, arm in enumerate(cell.arm_names)
        ]
        out = []
        for seed in range(4):
            constraints = [
                core.Constraint.standing(model.core, 1, start["arm1"], start=3, end=40),
                core.Constraint.ball((start["arm0"] + goal["arm0"]) / 2, 0.3, 0, 30),
                core.Constraint.sphere(np.array([0.0, 0.0, 0.4]), 0.05, 2, 10, 30),
            ][: seed % 4]
            out += planners[0].plan(
                constraints, seed, core.Clock(60.0), settings=core.SingleArmSettings(improve_iterations=30)
            )
            out.append(core.safe_intervals(model.core, 0, goal["arm0"], constraints, core.Levels(*LEVELS)))
        first, second = (planner.plan([], 0, core.Clock(60.0))[0] for planner in planners)
        length = max(len(first), len(second))
        whole = [np.vstack([q, np.repeat(q[-1:], length - len(q), axis=0)]) for q in (first, second)]
        required = core.Levels(0.001, 0.001, 0.0005, -0.0002)
        proof = core.certify(model.core, whole, required, 1e-4, core.Clock(60.0))
        return [*out, proof.valid, proof.clearance, proof.arm_a, proof.arm_b, proof.segment, proof.fraction]

    assert_same_bits(by_every_variant(monkeypatch, cell, ask))


def test_instances_agree_to_the_last_bit(monkeypatch):
    cell = ring_cell(4)

    def ask(core, model):
        fresh = ring_cell(4)
        fresh.__dict__["collision"] = model
        start, goal = Reach().sample(fresh, np.random.default_rng(75))
        return [*start.values(), *goal.values()]

    assert_same_bits(by_every_variant(monkeypatch, cell, ask))


STEP_RAD = 0.08


def stepwise(path, step):
    """Returns a path on a grid in which no joint moves farther than `step` [rad] per step: [steps + 1, joints]."""
    rows = [path[:1]]
    for a, b in itertools.pairwise(path):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        rows.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    return np.concatenate(rows)


@pytest.mark.parametrize("robot", ["ur5e", "panda"])
@pytest.mark.parametrize("step", [STEP_RAD, 0.01])
def test_composite_paths_and_shortcuts_agree_to_the_last_bit(monkeypatch, robot, step):
    """With the finer grid the plans have more than 512 steps."""
    cell = ring_cell(4, robot)
    start, goal = draw_instance(cell, seed=2)
    dof = cell.arms[0].dof

    def ask(core, model):
        out = []
        for seed, edge in ((0, 0.05), (1, 2.0)):
            search = core.CompositeSearch(
                model.core,
                start=np.concatenate(list(start.values())),
                goals=np.stack([np.concatenate(list(goal.values())), np.concatenate(list(start.values())) + 0.4]),
                samples=core.Levels(MARGIN_M, MARGIN_M),
                edges=core.Levels(PROOF_M, 0.6 * MARGIN_M, 0.001, -0.0005),
                seed=seed,
                settings=core.CompositeSettings(step=edge),
            )
            path = search.grow(3000, core.Clock(60.0))
            assert path is not None
            rows = np.split(stepwise(path, step), 4, axis=1)
            assert step > 0.05 or len(rows[0]) > 512
            speeds = [np.full(dof, step)] * 4
            out += [path, search.nodes, search.iterations]
            settings, clock = core.ShortcutSettings(attempts=60), core.Clock(60.0)
            levels = core.Levels(*LEVELS)
            rest = {"levels": levels, "groups": [0] * 4, "settings": settings, "seed": seed, "clock": clock}
            nearer = [np.vstack([q[-1], q[0] + 0.9 * (q[-1] - q[0])]) for q in rows]
            out += [
                core.shortcut(model.core, rows, speeds, goals=goals, **rest)
                for goals in ([q[:0] for q in rows], nearer)
            ]
        return out

    assert_same_bits(by_every_variant(monkeypatch, cell, ask))


def sweep(cell, arm, turn, wait, steps):
    """Returns a path that waits, turns about the base from side to side in `steps` steps, and stops: [k, dof]."""
    home = np.array(cell.arm(arm).robot.home)
    side = 1.3 * turn * np.eye(len(home))[0]
    moving = home - side + np.linspace(0, 2, steps + 1)[:, None] * side
    return np.vstack([np.repeat(moving[:1], wait, axis=0), moving])


@pytest.mark.parametrize("robot", ["ur5e", "panda"])
@pytest.mark.parametrize(("wait", "steps"), [(0, 13), (5, 40), (21, 33), (3, 600), (517, 35)])
def test_planning_among_dynamic_obstacles_agrees_to_the_last_bit(monkeypatch, robot, wait, steps):
    """The motions lie within one block of steps, across blocks, and beyond the last block."""
    cell = ring_cell(2, robot)
    own, other = sweep(cell, "arm0", -1, 0, 33), sweep(cell, "arm1", 1, wait, steps)
    rng = np.random.default_rng(76)
    stays = np.array(cell.arms[0].robot.home) + rng.uniform(-1.2, 1.2, (12, cell.arms[0].dof))

    def ask(core, model):
        motion, late = core.Motion(model.core, 1, other), core.Motion(model.core, 1, other[wait // 2 :])
        steps = np.full(len(own[0]), STEP_RAD)
        arm = core.SingleArm(
            model.core, 0, start=own[0], goals=own[-1:], max_step=steps, levels=core.Levels(*LEVELS), seed=7
        )
        whole = core.Constraint.moving(motion, 0, core.FOREVER)
        part = core.Constraint.moving(motion, 7, wait + 30)
        clock, short = core.Clock(60.0), core.SingleArmSettings(max_iterations=100)
        found = arm.plan([], 1, clock, settings=core.SingleArmSettings(improve_iterations=20), others=[motion])
        out = [found, arm.plan(part, 2, clock, others=[late]), arm.plan(whole, 3, clock, settings=short)]
        again = {"others": [late], "experience": own if found[0] is None else found[0]}
        out += [arm.plan([], 4, clock, **again), arm.plan(part, 5, clock, settings=short, **again)]
        for q in stays:
            for rules, others in (([], [motion]), (part, [late]), (whole, [])):
                out.append(core.safe_intervals(model.core, 0, q, rules, core.Levels(*LEVELS), others=others))
        pairs = np.array([[0, 1], [0, 2]], np.int32)
        motions = [core.Motion(model.core, 0, own), motion, late]
        return [*out, core.conflict_instants(model.core, motions, pairs, core.Levels(*LEVELS))]

    results = by_every_variant(monkeypatch, cell, ask)
    assert_same_bits(results)
    assert any(array.ndim == 2 and array.shape[1] == len(own[0]) for array in results["v1"]), "some path is found"
