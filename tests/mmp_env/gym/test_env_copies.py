"""Copies of environments by deepcopy or pickle: they continue like the original, and independently of it."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

import mmp_env
from mmp_env.gym.env import MultiArmCellEnv
from mmp_env.model.rings import ring_cell
from mmp_env.opengl import possible_render_modes
from mmp_env.sim.simulation import Simulation

COPIES = {"deepcopy": copy.deepcopy, "pickle": lambda value: pickle.loads(pickle.dumps(value))}
every_copy = pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)

ENVIRONMENTS = [
    ("MultiArmCell-2", {"control_mode": "velocity"}),
    ("MultiArmCell-4", {"robot": "panda", "control_mode": "delta", "terminate_on_contact": False}),
    ("MultiArmCell-mixed-4", {"task": "packing"}),
    ("MultiArmCell-2", {"events": {"cart": {}, "goals": {"every_s": 0.2}}}),
]


def assert_same(here, there):
    assert here.keys() == there.keys()
    for name in here:
        np.testing.assert_array_equal(here[name], there[name], name)


@every_copy
@pytest.mark.parametrize(("name", "options"), ENVIRONMENTS)
def test_a_copy_continues_exactly_as_the_original(name, options, copied):
    env = gymnasium.make(name, **options)
    env.reset(seed=3)
    env.action_space.seed(3)
    actions = [env.action_space.sample() for _ in range(6)]
    for action in actions[:3]:
        env.step(action)
    other = copied(env)
    assert other.unwrapped.problem.name == env.unwrapped.problem.name
    for action in actions[3:]:
        (observation, *rest), (its, *its_rest) = env.step(action), other.step(action)
        assert_same(observation, its)
        assert rest == its_rest
    assert_same(env.reset()[0], other.reset()[0])
    np.testing.assert_array_equal(env.action_space.sample(), other.action_space.sample())


@every_copy
def test_a_copy_is_independent_of_the_original(copied):
    env = gymnasium.make("MultiArmCell-2", control_mode="velocity")
    env.reset(seed=0)
    other = copied(env)
    before = env.unwrapped.data.qpos.copy()
    other.step(np.full(12, 0.5, np.float32))
    other.unwrapped.model.opt.gravity[:] = 0
    np.testing.assert_array_equal(env.unwrapped.data.qpos, before)
    assert env.unwrapped.model.opt.gravity[2] < 0
    assert other.unwrapped.data.qpos[0] != before[0]


@every_copy
def test_an_environment_before_its_first_reset_can_be_copied(copied):
    env, other = gymnasium.make("MultiArmCell-2"), copied(gymnasium.make("MultiArmCell-2"))
    assert_same(env.reset(seed=4)[0], other.reset(seed=4)[0])


@every_copy
def test_a_copy_executes_plans_and_reports_contacts_like_the_original(copied):
    env = MultiArmCellEnv(cell=ring_cell(2), self_contacts=False)
    env.reset(seed=0)
    problem = env.problem
    still = {name: np.array([q, q]) for name, q in problem.start.items()}
    plan = mmp_env.Plan(problem=problem, times=np.array([0.0, 0.2]), positions=still)
    report, its = env.execute(plan), copied(env).execute(plan)
    assert its.duration_s == report.duration_s
    assert_same(report.positions, its.positions)


@every_copy
def test_a_copy_of_a_simulation_keeps_what_counts_as_a_contact(copied):
    folded = np.concatenate([[0.0, -1.57, 3.1, 0.0, 0.0, 0.0], mmp_env.load_robot("ur5e").tucked])
    for counted in (True, False):
        other = copied(Simulation(ring_cell(2), self_contacts=counted))
        other.place(folded)
        assert bool(other.log.contacts) == counted


@every_copy
def test_a_copy_opens_its_own_renderer(copied):
    if "rgb_array" not in possible_render_modes(["rgb_array"]):
        pytest.skip("nothing can be drawn on this machine")
    env = gymnasium.make("MultiArmCell-2", render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0)
    picture = env.render()
    other = copied(env)
    np.testing.assert_array_equal(other.render(), picture)
    env.close()
    other.close()


def test_a_copy_shares_what_never_changes():
    """The compiled queries of a cell take longer to build than the rest takes to copy."""
    env = MultiArmCellEnv(cell=ring_cell(2))
    env.reset(seed=0)
    other = copy.deepcopy(env)
    assert other.cell is env.cell
    assert other.problem.cell is env.cell


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_copy_of_the_collision_queries_is_built_from_the_cell_and_answers_alike(copied):
    model = ring_cell(2).collision
    other, tucked = copied(model), {arm.name: arm.robot.tucked for arm in model.cell.arms}
    assert other.cell.collision is other
    assert other.nearest(tucked) == model.nearest(tucked)
