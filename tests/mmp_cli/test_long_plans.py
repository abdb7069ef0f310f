"""Commands on a plan of an enormous duration: one sentence, or a number with few digits."""

import json

import numpy as np
import pytest
from support import tiny_plans
from support.refusals import assert_refused

from mmp_env.errors import MmpError
from mmp_env.opengl import offscreen_backend


@pytest.fixture(params=[1e10, 1e300])
def long_plan(request, tmp_path):
    data = tiny_plans.two_apart()
    data["times"] = np.linspace(0.0, request.param, len(data["times"])).tolist()
    (tmp_path / "long.json").write_text(json.dumps(data))
    return tmp_path / "long.json"


def test_a_long_plan_is_exported_and_reported_with_few_digits(mmp, long_plan, tmp_path):
    ran = mmp("export", long_plan, "--no-retime", "--to", tmp_path / "long.csv")
    assert ran.code == 0
    assert f" {np.genfromtxt(tmp_path / 'long.csv', delimiter=',', skip_header=1)[-1, 0]:.6g} s; " in ran.out
    ran = mmp("export", long_plan, "--no-retime", "--to", tmp_path / "long.yaml")
    assert_refused(ran, "does not fit time_from_start")


@pytest.mark.parametrize(
    ("option", "file", "words"),
    [("--video", "long.gif", "a plan that is executed takes 1200 s"), ("--rerun", "long.rrd", "a recording holds")],
)
def test_a_long_plan_is_not_shown(mmp, long_plan, tmp_path, option, file, words):
    pytest.importorskip("rerun")
    try:
        offscreen_backend()
    except MmpError as error:
        pytest.skip(str(error))
    assert_refused(mmp("show", long_plan, option, tmp_path / file), words)
    assert not (tmp_path / file).exists()
