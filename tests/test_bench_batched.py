"""`scripts/bench_batched.py`: it ends with 1 if threads are not fast enough."""

import importlib
import json

import numpy as np
import pytest
from support import checkout_scripts


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("bench_batched")


class Stub:
    """Environments whose step takes `takes_s` on a clock of their own."""

    now_s = 0.0

    def __init__(self, takes_s):
        self.takes_s, self.action_space = takes_s, np.zeros((2, 3))

    def reset(self, *, seed):
        pass

    def step(self, actions):
        Stub.now_s += self.takes_s

    def close(self):
        pass


@pytest.mark.parametrize(("ratio", "code"), [(1.75, 0), (1.65, 1), (1.0, 1)])
def test_threads_that_are_too_slow_end_the_script_with_1_and_a_sentence(bench, monkeypatch, capsys, ratio, code):
    monkeypatch.setattr(bench.time, "perf_counter", lambda: Stub.now_s)
    monkeypatch.setattr(bench.gymnasium, "make_vec", lambda *_, **__: Stub(1.0))
    monkeypatch.setattr(bench, "batched_env", lambda *_: Stub(1.0 / ratio))
    monkeypatch.setattr("sys.argv", ["bench_batched.py", "--steps", "4", "--rounds", "2"])
    assert bench.main() == code
    out, err = capsys.readouterr()
    assert json.loads(out)["ratio"] == pytest.approx(ratio)
    assert ("required: 1.7" in err) == bool(code)
