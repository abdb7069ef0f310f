"""What a run leaves of its time for the proof of what it finds last."""

import math
import time

import pytest
import two_arms

import mmp_planners
from mmp_env import _core
from mmp_planners.finishing import PROOF_S, PROOF_SHARE, PROOFS, Run


def begun(time_limit):
    return Run.begin("auto", None, two_arms.passing(), 0, time_limit)


def left_for_proof(run):
    early = run.early_clock()
    return run.clock.remaining - early.remaining


@pytest.mark.parametrize(("time_limit", "kept"), [(0.1, PROOF_S), (100.0, 100.0 * PROOF_SHARE)])
def test_before_any_proof_a_share_is_left_or_so_many_seconds(time_limit, kept):
    assert left_for_proof(begun(time_limit)) == pytest.approx(kept, rel=0.1)


def test_proofs_are_given_as_long_as_they_took(monkeypatch):
    run = begun(100.0)
    plan = mmp_planners.make("rrt-connect", shorten=0).plan(run.problem, seed=0).plan
    certify = _core.certify

    def slowly(*arguments):
        time.sleep(0.2)
        return certify(*arguments)

    monkeypatch.setattr(_core, "certify", slowly)
    assert run.offer(plan)
    assert run.proof_s >= 0.2
    assert left_for_proof(run) == pytest.approx(PROOFS * run.proof_s, rel=0.1)
    monkeypatch.setattr(_core, "certify", certify)
    longest = run.proof_s
    run.best = None
    assert run.offer(plan)
    assert run.proof_s == longest


def test_a_run_without_end_has_an_early_clock_without_end():
    assert begun(math.inf).early_clock().remaining > 1e9 / 2
