"""The arms of a model: prefixes, names, all chains, fingers, torsos, and what is refused."""

import mujoco
import pytest
from support.scenes import arm, fingers, scene
from support.unchecked import unchecked

from mmp_env.errors import MmpError
from mmp_env.importing.scene.constraints import refuse_constraints
from mmp_env.importing.scene.model_arms import find_arms
from mmp_env.sim.model_tree import ModelTree


def found(text, asked=None):
    tree = ModelTree(mujoco.MjModel.from_xml_string(text))
    arms = find_arms(tree, asked)
    refuse_constraints(tree, arms)
    return {each.name: [tree.joint_name(j) for j in each.joints] for each in arms}


LEFT = ["l_joint1", "l_joint2", "l_joint3"]
RIGHT = ["r_joint1", "r_joint2", "r_joint3"]


def test_all_chains_are_named_after_what_their_joint_names_begin_with():
    assert found(scene()) == {"l": LEFT, "r": RIGHT}


def test_arms_are_chosen_by_prefix_or_by_names():
    assert found(scene(), {"left": "l_", "right": RIGHT}) == {"left": LEFT, "right": RIGHT}
    assert found(scene(), {"one": LEFT[1:]}) == {"one": LEFT[1:]}


def test_fingers_end_an_arm():
    text = scene(arms=arm("l_", -0.4, hand=fingers("l_")) + arm("r_", 0.4))
    assert found(text) == {"l": LEFT, "r": RIGHT}
    assert found(text, {"left": "l_"}) == {"left": LEFT}


def test_joints_of_a_torso_that_both_arms_share_belong_to_none():
    torso = f"""<body name="torso"><joint name="waist" range="-1 1"/><geom size="0.05"/>
      {arm("l_", -0.4)}{arm("r_", 0.4)}
      <body name="head" pos="0 0 1"><joint name="nod" range="-1 1"/><geom size="0.1"/></body></body>"""
    assert found(scene(arms=torso)) == {"l": LEFT, "r": RIGHT}
    with pytest.raises(MmpError, match=r"joint 'waist' belongs to the arms 'a' and 'b'; leave it out of both"):
        found(scene(arms=torso), {"a": ["waist", *LEFT], "b": ["waist", *RIGHT]})
    with pytest.raises(MmpError, match=r"joint 'waist' of arm 'a' moves arm 'b' as well"):
        found(scene(arms=torso), {"a": ["waist", *LEFT], "b": "r_"})


def test_doors_and_drawers_are_no_arms():
    door = '<body name="door" pos="0 2 0"><joint name="hinge" range="0 1"/><geom size="0.1"/></body>'
    assert found(scene(world=door)) == {"l": LEFT, "r": RIGHT}


def test_arms_of_nameless_joints_are_found():
    text = scene().replace('name="l_joint1" ', "").replace('<position joint="l_joint1" kp="400" kv="40"/>', "")
    assert found(text)["l_link1"] == ["joint 0", *LEFT[1:]]


def test_an_arm_on_a_rail_has_the_rail():
    rail = f'<body name="l_cart"><joint name="l_rail" type="slide" range="-1 1"/>{arm("l_", -0.4)}</body>'
    assert found(scene(arms=rail)) == {"l": ["l_rail", *LEFT]}


REFUSED = {
    "unknown prefix": ({}, {"left": "left_"}, "unknown joint prefix 'left_'"),
    "unknown joint": ({}, {"left": ["l_joint1", "l_jiont2"]}, "unknown joint 'l_jiont2'. Did you mean 'l_joint2'"),
    "no chain": ({}, {"left": ["l_joint1", "r_joint2"]}, "are no serial chain"),
    "from tip to base": ({}, {"left": LEFT[::-1]}, "are no serial chain"),
    "two arms of one prefix": (
        {"arms": arm("robot_l_", -0.4) + arm("robot_r_", 0.4), "actuator": ""},
        {"both": "robot_"},
        "joint prefix 'robot_' begins the joints of 2 arms: robot_l_joint1 ..., robot_r_joint1 ...; give a longer",
    ),
    "a number": ({}, {"left": 5}, "arm 'left' has 5; give a list of joint names, or a prefix of them"),
    "nothing": ({}, {"left": None}, "arm 'left' has None; give a list of joint names"),
    "a list in a list": ({}, {"left": [["l_joint1"]]}, "arm 'left' has [['l_joint1']]; give a list of joint names"),
    "a number as a name": ({}, {3: "l_"}, "an arm is called 3; its name must be 1 to 100 printable characters"),
    "twice": ({}, {"a": "l_", "b": LEFT[1:]}, "joint 'l_joint2' belongs to the arms 'a' and 'b'"),
    "a loop": (
        {"after": '<equality><connect name="grip" body1="l_link3" body2="r_link3" anchor="0 0 0"/></equality>'},
        None,
        "closed loop: equality constraint grip joins 'l_link3' and 'r_link3'",
    ),
    "a coupling": (
        {"after": '<equality><joint joint1="l_joint3" joint2="l_joint2"/></equality>'},
        {"left": LEFT},
        "equality constraint number 0 couples joint 'l_joint3' of arm 'left'",
    ),
    "a tendon": (
        {
            "after": '<tendon><fixed name="wire" limited="true" range="0 1"><joint joint="l_joint1" coef="1"/></fixed>'
            "</tendon>"
        },
        None,
        "a limit of tendon wire acts on joint 'l_joint1' of arm 'l'",
    ),
}


@pytest.mark.parametrize(("more", "asked", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_arm_is_refused_in_one_sentence(more, asked, sentence):
    with unchecked(), pytest.raises(MmpError) as error:
        found(scene(**more), asked)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_a_constraint_that_is_switched_off_is_none():
    loop = '<equality><connect body1="l_link3" body2="r_link3" anchor="0 0 0" active="false"/></equality>'
    assert found(scene(after=loop)) == {"l": LEFT, "r": RIGHT}


def test_a_ball_joint_in_a_chain_is_refused():
    text = scene().replace('name="l_joint2" axis="0 1 0" range="-2.5 2.5"', 'name="l_joint2" type="ball"')
    with pytest.raises(MmpError, match="joint 'l_joint2' in its chain is a ball joint"):
        found(text.replace('<position joint="l_joint2" kp="400" kv="40"/>', ""), {"left": ["l_joint1", "l_joint3"]})
