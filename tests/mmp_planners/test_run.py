"""Time that a run reserves for certification."""

import math
from types import SimpleNamespace

import pytest
from support import two_arms
from support.arms_on_a_line import refusal

import mmp_planners
from mmp_env import core
from mmp_planners.portfolio import run as run_module
from mmp_planners.portfolio.run import FIRST_PROOFS, LEAST_PROOF_S, LEAST_PROOF_SHARE_S, PROOF_SHARE, PROOFS, Run


def left_for_proof(monkeypatch, remaining, proofs=0, proof_s=0.0):
    """Returns how much of the remaining time [s] is reserved after some proofs, the longest of `proof_s`."""
    run, made, asked = Run.begin("auto", None, two_arms.passing(), 0, math.inf), core.Clock, []
    run.clock, run.proofs, run.proof_s = SimpleNamespace(remaining=remaining), proofs, proof_s
    monkeypatch.setattr(core, "Clock", lambda seconds: asked.append(seconds) or made(seconds))
    with run.early_clock():
        pass
    return remaining - asked[0]


@pytest.mark.parametrize(
    ("remaining", "kept"), [(0.1, LEAST_PROOF_SHARE_S), (100.0, 100.0 * PROOF_SHARE), (0.01, 0.01)]
)
def test_before_any_proof_a_share_of_the_time_or_a_minimum_is_reserved(monkeypatch, remaining, kept):
    assert left_for_proof(monkeypatch, remaining) == pytest.approx(kept)


@pytest.mark.parametrize(
    ("proofs", "proof_s", "kept"),
    [(1, 0.0001, LEAST_PROOF_S), (1, 0.5, 0.5 * FIRST_PROOFS), (2, 0.5, 0.5 * PROOFS), (2, 60.0, 10.0)],
)
def test_the_reserved_time_is_a_multiple_of_the_longest_proof_and_at_most_a_share(monkeypatch, proofs, proof_s, kept):
    assert left_for_proof(monkeypatch, 100.0, proofs, proof_s) == pytest.approx(kept)


def test_only_successful_proofs_count_for_the_reserved_time(monkeypatch):
    run = Run.begin("auto", None, two_arms.passing(), 0, math.inf)
    plan = mmp_planners.make("rrt-connect", shorten=0).plan(run.problem, seed=0).plan
    clock = iter(range(100))
    monkeypatch.setattr(run_module, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    proved = run_module.certify
    monkeypatch.setattr(run_module, "certify", lambda *_: refusal(0, 1, instant=0.0))
    assert not run.offer(plan)
    assert (run.proofs, run.proof_s) == (0, 0)
    monkeypatch.setattr(run_module, "certify", proved)
    assert run.offer(plan)
    assert (run.proofs, run.proof_s) == (1, 1)
