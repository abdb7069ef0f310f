"""What the environment costs beside the physics: one JSON line per figure. Usage: bench_env.py [environment id]

Ratios are medians over pairs of which both sides are timed in turn, so that a busy machine slows both alike.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from typing import Any

import gymnasium
import mujoco
import numpy as np

import mmp_env

BLOCKS, STEPS = 10, 50
SEED = 7


def main() -> None:
    """Prints the figures of one environment, `MultiArmCell-8` by default."""
    name = sys.argv[1] if len(sys.argv) > 1 else "MultiArmCell-8"
    env = gymnasium.make(name, control_mode="delta", terminate_on_contact=False)
    env.reset(seed=SEED)
    print_stepping(env)
    print_resets(env)
    print_execution(env)


def print_stepping(env: Any) -> None:
    """One control period of the wrapped environment against as many bare `mj_step` calls from the same state."""
    simulated = env.unwrapped
    model, bare = simulated.model, mujoco.MjData(simulated.model)
    substeps = round(1 / (env.metadata["render_fps"] * model.opt.timestep))
    env.action_space.seed(SEED)
    ours, theirs = [], []
    for _ in range(BLOCKS):
        env.reset(options=ends(simulated))
        for _ in range(STEPS):
            mujoco.mj_copyData(bare, model, simulated.data)
            action = env.action_space.sample()
            ours.append(seconds(lambda action=action: env.step(action)))
            bare.ctrl[:] = simulated.data.ctrl
            theirs.append(seconds(lambda: bare_steps(model, bare, substeps)))
    ratio = statistics.median(a / b for a, b in zip(ours, theirs, strict=True))
    report("env_step", statistics.median(ours) * 1e6, "us", ratio, f"{substeps} x mj_step")


def bare_steps(model: Any, data: Any, count: int) -> None:
    """The physics alone."""
    for _ in range(count):
        mujoco.mj_step(model, data)


def print_resets(env: Any) -> None:
    """A reset to a given instance, which is validated, and one that draws its instance."""
    given, drawn = [], []
    for seed in range(20):
        drawn.append(seconds(lambda seed=seed: env.reset(seed=seed)))
        given.append(seconds(lambda: env.reset(options=ends(env.unwrapped))))
    report("env_reset_given", statistics.median(given) * 1e3, "ms")
    report("env_reset_drawn", statistics.median(drawn) * 1e3, "ms")


def print_execution(env: Any) -> None:
    """Execution of a plan that holds still for 2 s, against real time."""
    env.reset(seed=SEED)
    problem = env.unwrapped.problem
    still = {name: np.array([q, q]) for name, q in problem.start.items()}
    plan = mmp_env.Plan(problem=problem, times=np.array([0.0, 2.0]), positions=still)
    spent = min(seconds(lambda: env.unwrapped.execute(plan)) for _ in range(3))
    simulated = env.unwrapped.execute(plan).duration_s
    report("execute_per_simulated_second", spent / simulated * 1e3, "ms", simulated / spent, "real time")


def ends(env: Any) -> dict[str, Any]:
    """The present instance as `reset` takes it."""
    return {"start": env.problem.start, "goal": env.problem.goal}


def seconds(call: Any) -> float:
    """Wall-clock time of a call [s]."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def report(name: str, value: float, unit: str, ratio: float | None = None, ratio_to: str | None = None) -> None:
    """Prints one figure as a line of JSON."""
    line: dict[str, Any] = {"name": name, "value": round(value, 3), "unit": unit}
    if ratio is not None:
        line |= {"ratio": round(ratio, 3), "ratio_to": ratio_to}
    print(json.dumps(line))


if __name__ == "__main__":
    main()
