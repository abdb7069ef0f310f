"""Ctrl-C while planning, with a handler that raises `StopPlanning`: planners return the best plan so far."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]

PLANNING = """
import json, math, signal, sys
sys.path.insert(0, sys.argv[1])
from support import two_arms
from reference import toys
from mmp_env import check_plan, make_problem
from mmp_planners import StopPlanning, make

interrupted = []
def handle(signum, frame):
    interrupted.append(signum)
    raise StopPlanning
signal.signal(signal.SIGINT, handle)

def shut_in():
    # A ball separates the goal of a planar arm from its start, so its planner searches for a long time.
    places = [[2 * math.cos(angle), 2 * math.sin(angle), 0.0] for angle in (0.4, -0.4)]
    balls = [toys.solid("sphere", place, name=f"ball{k}", radius=0.2) for k, place in enumerate(places)]
    arm = toys.toy_arm("a", [0, 0, 0], lower=[-math.pi, -1e-3], upper=[math.pi, 1e-3])
    return make_problem(toys.toy_cell(arm, obstacles=balls), {"a": [0.0, 0.0]}, {"a": [1.0, 0.0]})

def after(name):
    def watch(event):
        if type(event).__name__ == name:
            print("ready", flush=True)
    return watch
"""

WITHOUT_A_PLAN = """
result = make("apf-ecbs").plan(shut_in(), watch=after("SearchStarted"))
valid = None
"""

WITH_A_PLAN = """
result = make("ecbs", w=1.0, patience=10**8).plan(two_arms.passing(1.0), watch=after("SolutionFound"))
valid = check_plan(result.plan).valid
"""

REPORT = """
print(json.dumps([len(interrupted), str(result.status), result.plan is not None, valid, result.stats["deadline_hit"]]))
"""


@pytest.mark.parametrize(
    ("code", "expected"),
    [(WITHOUT_A_PLAN, [1, "timeout", False, None, False]), (WITH_A_PLAN, [1, "solved", True, True, False])],
    ids=["nothing found yet", "a plan that could be better"],
)
def test_ctrl_c_returns_the_best_so_far(code, expected):
    """Without the interrupt both planners would run for hours."""
    command = [sys.executable, "-c", PLANNING + code + REPORT, str(TESTS)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate(timeout=60)
        finally:
            process.kill()
    assert json.loads(out.splitlines()[-1]) == expected
    assert process.returncode == 0
