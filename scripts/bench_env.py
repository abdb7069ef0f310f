"""Cost of the environment relative to the physics: a JSON line per figure. Usage: bench_env.py [ID...]

Both sides of a ratio are timed alternately, in blocks from the same states. The fastest block of each counts, because
other work on the machine disturbs it least.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import gymnasium
import mujoco
import numpy as np
from figure import print_figure

import mmp_env
from mmp_cli.arguments import Parser, environment_id
from mmp_cli.main import run_script

SOURCES = tuple(f"MultiArmCell-{arms}" for arms in (2, 4, 6, 8))
BLOCKS, STEPS = 20, 10
SEED = 7
CALM = 0.2
"""Share of the largest motion in an action: contacts, which make the physics ten times slower, stay rare."""


def main() -> None:
    """Prints the figures of each environment."""
    parser = Parser("bench_env.py", __doc__)
    parser.add_argument("ids", nargs="*", type=environment_id, default=SOURCES, metavar="ID")
    for source in parser.parse().ids:
        env = gymnasium.make(source, control_mode="delta", terminate_on_contact=False)
        env.reset(seed=SEED)
        print_stepping(source, env)
        print_resets(source, env)
        print_execution(source, env)
        env.close()


def print_stepping(source: str, env: Any) -> None:
    """Prints the time of a control period, relative to as many bare `mj_step` calls from the same state."""
    simulated = env.unwrapped
    model, bare = simulated.model, mujoco.MjData(simulated.model)
    substeps = round(1 / (env.metadata["render_fps"] * model.opt.timestep))
    env.action_space.seed(SEED)
    ours, theirs = [], []
    for _ in range(BLOCKS):
        env.reset(options=ends(simulated))
        mujoco.mj_copyData(bare, model, simulated.data)
        actions = [CALM * env.action_space.sample() for _ in range(STEPS)]
        ours.append(seconds(lambda actions=actions: [env.step(action) for action in actions]) / STEPS)
        theirs.append(seconds(lambda: [mujoco.mj_step(model, bare) for _ in range(STEPS * substeps)]) / STEPS)
    fast, bare_fast = min(ours), min(theirs)
    print_figure(f"{source}/env_step", fast * 1e6, "us", ratio=fast / bare_fast, ratio_to=f"{substeps} x mj_step")


def print_resets(source: str, env: Any) -> None:
    """Prints the times of a reset to a given instance, which is validated, and of one that draws its instance."""
    given, drawn = [], []
    for seed in range(20):
        drawn.append(seconds(lambda seed=seed: env.reset(seed=seed)))
        instance = ends(env.unwrapped)
        given.append(seconds(lambda instance=instance: env.reset(options=instance)))
    print_figure(f"{source}/env_reset_given", statistics.median(given) * 1e3, "ms")
    print_figure(f"{source}/env_reset_drawn", statistics.median(drawn) * 1e3, "ms")


def print_execution(source: str, env: Any) -> None:
    """Prints the time of executing a plan that stands still for 2 s, relative to real time."""
    env.reset(seed=SEED)
    problem = env.unwrapped.problem
    still = {name: np.array([q, q]) for name, q in problem.start.items()}
    plan = mmp_env.Plan(problem=problem, times=np.array([0.0, 2.0]), positions=still)
    spent = min(seconds(lambda: env.unwrapped.execute(plan)) for _ in range(3))
    simulated = env.unwrapped.execute(plan).duration_s
    value = spent / simulated * 1e3
    print_figure(f"{source}/execute_per_simulated_second", value, "ms", ratio=simulated / spent, ratio_to="real time")


def ends(env: Any) -> dict[str, Any]:
    """Returns the current instance as `reset` takes it."""
    return {"start": env.problem.start, "goal": env.problem.goal}


def seconds(call: Any) -> float:
    """Returns the processor time of a call [s]."""
    begin = time.thread_time()
    call()
    return time.thread_time() - begin


if __name__ == "__main__":
    run_script(main)
