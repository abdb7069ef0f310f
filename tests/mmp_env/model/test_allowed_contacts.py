"""Links that may touch an obstacle: no query tests them against it, all other links are tested, files keep it."""

import json
from dataclasses import replace

import numpy as np
import pytest

import mmp_env
from mmp_cli.main import main
from mmp_env.errors import UnknownNameError
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.files.writing import plain
from mmp_env.model.arm import Obstacle, place_arm
from mmp_env.model.cell import Cell

POSE = {"position": np.zeros(3), "quaternion": np.array([1.0, 0, 0, 0])}
SLEEVE = Obstacle(name="sleeve", shape="cylinder", radius=0.08, length=0.3, **POSE)
ARM = place_arm("arm", "ur5e", [0, 0, 0], [1, 0, 0, 0])
UPRIGHT = np.array([[0.0, -1.57, 0.0, 0.0, 0.0, 0.0]])


def cell(*links, **more):
    sleeve = replace(SLEEVE, may_touch=frozenset(links), **more)
    return Cell(name="c", arms=(ARM,), obstacles=(sleeve,), spheres="exact")


def test_an_allowed_contact_is_none_and_others_stay():
    free = Cell(name="c", arms=(ARM,), spheres="exact")
    touching, allowed = cell(), cell("arm/shoulder", "arm/upperarm")
    assert touching.collision.static_clearance("arm", UPRIGHT)[0] < 0
    assert not touching.collision.edge_free("arm", UPRIGHT, UPRIGHT + 0.01)[0]
    assert allowed.collision.static_clearance("arm", UPRIGHT)[0] > 0
    assert allowed.collision.edge_free("arm", UPRIGHT, UPRIGHT + 0.01)[0]
    assert "sleeve" not in allowed.collision.nearest({"arm": UPRIGHT[0]})["self"].bodies
    assert cell("arm/shoulder", length=0.6).collision.static_clearance("arm", UPRIGHT)[0] < 0  # the upper arm
    assert free.collision.static_clearance("arm", UPRIGHT)[0] > 0


def test_all_queries_agree_on_allowed_contacts():
    allowed = cell("arm/shoulder", "arm/upperarm")
    q = np.random.default_rng(1).uniform(-2, 2, (50, 6))
    for row, whole in zip(q, allowed.collision.clearance({"arm": q}), strict=True):
        near = allowed.collision.nearest({"arm": row})
        assert near["obstacles"].clearance_m == pytest.approx(whole, abs=2e-5) or whole < 0


def test_a_file_keeps_them():
    again = cell_from_dict(cell_to_dict(cell("arm/shoulder")), "file")
    assert again.obstacles[0].may_touch == {"arm/shoulder"}
    assert "may_touch" not in cell_to_dict(cell())["obstacles"][0]


def test_an_unknown_link_is_answered_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'arm/shoulder'"):
        cell("arm/shuolder")
    with pytest.raises(UnknownNameError, match=r"unknown moving part in may_touch of obstacle 'sleeve': 'arm/base'"):
        cell("arm/base")


@pytest.mark.parametrize(("links", "valid"), [((), False), (("arm/shoulder", "arm/upperarm"), True)])
def test_the_checker_follows_them(links, valid):
    problem = mmp_env.make_problem(cell("arm/shoulder", "arm/upperarm"), {"arm": UPRIGHT[0]}, {"arm": UPRIGHT[0] + 0.1})
    problem = replace(problem, cell=cell(*links))
    positions = {"arm": np.concatenate([UPRIGHT, UPRIGHT + 0.1])}
    plan = mmp_env.Plan(problem=problem, times=np.array([0.0, 1.0]), positions=positions)
    assert mmp_env.check_plan(plan).valid == valid
    report = mmp_env.check_plan(plan)
    assert report.may_touch == tuple((link, "sleeve") for link in sorted(links))
    assert report.as_dict().get("may_touch", []) == [[link, "sleeve"] for link in sorted(links)]
    assert report.not_tested == [f"{link} and sleeve, which may touch" for link in sorted(links)]


@pytest.mark.parametrize("strange", ["arm/base", "arm/shuolder", "other/shoulder"])
def test_the_checker_refuses_names_of_no_moving_link(strange):
    problem = mmp_env.make_problem(cell("arm/shoulder", "arm/upperarm"), {"arm": UPRIGHT[0]}, {"arm": UPRIGHT[0]})
    document = plan_to_dict(mmp_env.Plan(problem=problem, times=np.array([0.0]), positions={"arm": UPRIGHT}))
    document["problem"]["cell"]["obstacles"][0]["may_touch"] = [strange]
    (sentence,) = mmp_env.check_plan(document).sentences
    told = f"may_touch of obstacle 'sleeve' names '{strange}', which is no moving part of an arm of the cell"
    assert sentence == f"schema: {told}"


def test_mmp_check_lists_the_pairs_that_nothing_tests(tmp_path, capsys):
    problem = mmp_env.make_problem(cell("arm/shoulder", "arm/upperarm"), {"arm": UPRIGHT[0]}, {"arm": UPRIGHT[0]})
    plan = mmp_env.Plan(problem=problem, times=np.array([0.0]), positions={"arm": UPRIGHT})
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(plain(plan_to_dict(plan))))
    main(["check", str(file)])
    assert "not tested  arm/shoulder and sleeve, which may touch" in capsys.readouterr().out
    main(["check", str(file), "--json"])
    pairs = [["arm/shoulder", "sleeve"], ["arm/upperarm", "sleeve"]]
    assert json.loads(capsys.readouterr().out)["may_touch"] == pairs
