"""`mmp plan` on a MuJoCo model."""

import json

import pytest
from support.scenes import scene

from mmp_cli.main import main

ENDS = (
    *("--start", json.dumps({"left": [-0.6, 1.3, 0.3], "right": [2.5, 1.3, 0.0]})),
    *("--goal", json.dumps({"left": [0.6, 1.3, 0.0], "right": [-2.5, 1.3, 0.3]})),
)


@pytest.fixture
def model(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "two_arms.xml"
    path.write_text(scene(), encoding="utf-8")
    return path


def test_a_plan_in_a_model_is_executed_in_it_and_checked(model, tmp_path, capsys):
    out = str(tmp_path / "plan.json")
    assert main(["plan", str(model), "--arms", "left=l_,right=r_", *ENDS, "--execute", "--json", "--out", out]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["status"] == "solved"
    assert main(["check", out]) == 0
    assert (
        json.loads((tmp_path / "plan.json").read_text())["problem"]["cell"]["joints"]["names"]["left"][0] == "l_joint1"
    )


def test_the_summary_says_which_joints_the_arms_have_and_that_the_others_are_held(model, capsys):
    held = "all other joints of the model are held at their value"
    assert main(["plan", str(model), "--arms", "left=l_,right=r_", *ENDS]) == 0
    told = capsys.readouterr().out
    assert "left: l_joint1, " in told
    assert "right: r_joint1, " in told
    assert held not in told
    assert main(["plan", str(model), "--arms", "left=l_", "--start", "home", "--goal", "stay"]) == 0
    assert held in capsys.readouterr().out


def test_a_model_whose_arms_cannot_be_driven_is_refused_before_planning(model, tmp_path, capsys):
    model.write_text(scene(actuator=2 * '<position joint="l_joint1" kp="400" kv="40"/>'), encoding="utf-8")
    out = tmp_path / "plan.json"
    asked = ["plan", str(model), "--arms", "left=l_,right=r_", *ENDS, "--out", str(out)]
    assert main([*asked, "--execute"]) == 2
    assert capsys.readouterr().err.startswith("mmp: --execute: the position actuators 'actuator 0' and 'actuator 1'")
    assert not out.exists()
    assert main(asked) == 0


REFUSED = {
    "unknown prefix": (["--arms", "left=l_,right=x_"], "unknown joint prefix 'x_'"),
    "no pairs": (["--arms", "left"], "'left' is not of the form name=prefix,name=prefix"),
    "unknown arm": (["--arms", "a=l_,b=r_", *ENDS], "unknown arm 'left'"),
    "one arm": (["--arms", "left=l_", *ENDS], "unknown arm 'right'"),
    "a robot": (["--robot", "ur5e"], "is a MuJoCo model, which has no robot to choose"),
}


@pytest.mark.parametrize(("options", "sentence"), REFUSED.values(), ids=REFUSED)
def test_bad_options_are_refused_in_one_sentence(model, capsys, options, sentence):
    assert main(["plan", str(model), *options]) == 2
    assert sentence in capsys.readouterr().err


def test_a_file_that_mujoco_refuses_is_told(model, capsys):
    model.write_text("<mujoco><worldbody><body><geom/></body></worldbody></mujoco>", encoding="utf-8")
    assert main(["plan", str(model)]) == 2
    assert "cannot be read by MuJoCo" in capsys.readouterr().err
    assert main(["plan", str(model.with_name("no.xml"))]) == 2
    assert "there is no such file" in capsys.readouterr().err


def test_arms_of_a_cell_file_are_refused(capsys):
    assert main(["plan", "MultiArmCell-2", "--arms", "left=l_"]) == 2
    assert "--arms is" in capsys.readouterr().err
