"""Values of a tool's joints: followers follow, closed loops need every value."""

from pathlib import Path

import mujoco
import pytest

from mmp_env.errors import MmpError
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.tool_folder import _placed

GRIPPER = """<mujoco><worldbody><body name="palm"><geom size=".05"/>
<body name="f1"><joint name="drive" type="slide" axis="1 0 0" range="0 .04"/><geom size=".01"/></body>
<body name="f2"><joint name="follow" type="slide" axis="-1 0 0" range="-.1 .1"/><geom size=".01"/></body>
</body></worldbody><equality>{}</equality></mujoco>"""
FOLLOWS = '<joint joint1="follow" joint2="drive" polycoef="0.01 -2 0 0 0"/>'
LOOP = '<connect name="pin" body1="f1" body2="f2" anchor="0 0 .1"/>'


def source(constraint, **more):
    model = mujoco.MjModel.from_xml_string(GRIPPER.format(constraint))
    return SourceModel(path=Path("g.xml"), title="g", model=model, velocity={}, digest="", **more)


def test_a_follower_takes_the_value_of_its_polynomial():
    _, joints = _placed(source(FOLLOWS), "drive=0.03", "state open")
    assert joints == pytest.approx({"drive": 0.03, "follow": -0.05})


@pytest.mark.parametrize(
    ("constraint", "more", "values", "told"),
    [
        (FOLLOWS, {}, "drive=0.03,follow=0", "joint 'follow' is 0; a constraint of the file makes it -0.05"),
        (LOOP, {}, "drive=0.03", "has a closed loop: equality constraint pin .* give every joint a value in --state"),
        ("", {"mimics": {"follow": "drive"}}, "drive=0.03", "'follow' mimics 'drive'; give it a value in --state"),
        ("", {}, "drive=0.03,drive=0", "joint 'drive' is given twice"),
    ],
)
def test_values_that_no_gripper_has_are_refused(constraint, more, values, told):
    with pytest.raises(MmpError, match=told):
        _placed(source(constraint, **more), values, "state open")


def test_a_closed_loop_with_every_value_is_taken():
    assert _placed(source(LOOP), "0.03,0.01", "state open")[1] == {"drive": 0.03, "follow": 0.01}
