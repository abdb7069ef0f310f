"""Contacts that a cell allows: bearings that touch in every configuration, but no collision beside them."""

import mujoco
import pytest

import mmp_env
from mmp_env.errors import MmpError

ROD = '<geom name="rod" type="capsule" size="0.03" fromto="0 0 0 0 0 0.3"/>'


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    """One cache for all tests of this file."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "scene-cache"))


def cell_on_a_post(rod=ROD, *, option=""):
    """A cell of an arm whose first link has a hub, which is 50 mm deep in a post, and a rod."""
    return mmp_env.cell_from_mujoco(
        mujoco.MjModel.from_xml_string(f"""
        <mujoco model="post"><compiler angle="radian"/>{option}<worldbody>
          <geom name="post" type="cylinder" size="0.08 0.3" pos="0 0 0.3"/>
          <body name="upper" pos="0 0 0.62"><joint name="p_joint1" axis="0 1 0" range="-3 3"/>
            <geom name="hub" type="sphere" size="0.07"/>{rod}
            <body name="fore" pos="0 0 0.38"><joint name="p_joint2" axis="0 1 0" range="-2 2"/>
              <geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.2"/></body></body>
        </worldbody></mujoco>"""),
        {"p": "p_"},
    )


def allowed(cell):
    return {obstacle.name: obstacle.may_touch for obstacle in cell.obstacles}


def test_a_bearing_may_touch_its_post():
    assert allowed(cell_on_a_post(rod="")) == {"post": {"p/upper"}}


def test_a_rod_that_can_enter_the_post_beside_its_bearing_is_refused():
    with pytest.raises(
        MmpError, match=r"link 'p/upper' touches 'post' in every configuration, its geom 'rod' by 10 to"
    ):
        cell_on_a_post()


def test_a_shallow_contact_is_not_hidden_by_a_deeper_one_of_the_same_link():
    with pytest.raises(MmpError, match=r"its geom 'rod' by 0 to \d+ mm; exclude the two in the model \(<exclude>\)"):
        cell_on_a_post(ROD.replace('fromto="0 0 0', 'fromto="0 0 0.1'))


@pytest.mark.parametrize("flag", ["contact", "constraint"])
def test_bearings_are_found_where_the_model_switches_contacts_off(flag):
    cell = cell_on_a_post(rod="", option=f'<option><flag {flag}="disable"/></option>')
    assert allowed(cell) == {"post": {"p/upper"}}
