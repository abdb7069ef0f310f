"""A cell as MJCF: the file alone compiles to the model of the environment, number by number."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from support import tiny_plans

from mmp_env import find_cell
from mmp_env.errors import MmpError
from mmp_env.export import export_plan, mjcf
from mmp_env.export.mjcf import mjcf_text
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.sim.scene import compile_scene

ADDED = ("key", "nkey", "site", "nsite", "name", "nname", "nbuffer", "signature", "paths", "npaths")
"""Intended differences: keyframes, the look of tool points, and fields that depend on them."""


def poses(cell):
    return {
        "start": {arm.name: arm.robot.home for arm in cell.arms},
        "goal": {arm.name: arm.robot.tucked for arm in cell.arms},
    }


def differences(model, other):
    """Returns the names of the fields in which two models differ by more than the last bit."""
    parts = {"": (model, other)}
    parts |= {f"{name}.": (getattr(model, name), getattr(other, name)) for name in ("opt", "stat")}
    for name in ("global_", "headlight", "map", "quality"):
        parts[f"vis.{name}."] = getattr(model.vis, name), getattr(other.vis, name)
    for prefix, (one, two) in parts.items():
        for field in dir(one):
            if field.startswith(("_", *ADDED)):
                continue
            a, b = getattr(one, field), getattr(two, field)
            if not isinstance(a, np.ndarray | int | float):
                continue
            if np.shape(a) != np.shape(b) or not np.allclose(a, b, rtol=1e-12, atol=1e-15):
                yield prefix + field


@pytest.mark.parametrize("name", ["ring-2", "ring-4-panda", "ring-2-fr5", "ring-2-piper", "mixed-4"])
def test_the_file_compiles_to_the_model_of_the_cell(name):
    cell = find_cell(name)
    model, other = compile_scene(cell), mujoco.MjModel.from_xml_string(mjcf_text(cell, poses(cell)))
    assert list(differences(model, other)) == []
    counts = {"body": "nbody", "joint": "njnt", "geom": "ngeom", "actuator": "nu", "camera": "ncam", "material": "nmat"}
    for kind, count in counts.items():
        names = [[getattr(one, kind)(k).name for k in range(getattr(one, count))] for one in (model, other)]
        assert names[0] == names[1]


def test_the_keyframes_are_start_and_goal_exactly_with_the_servos_holding_them(tmp_path):
    plan = plan_from_dict(tiny_plans.two_apart())
    export_plan(plan, tmp_path / "cell.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "cell.xml"))
    assert [model.key(k).name for k in range(model.nkey)] == ["start", "goal"]
    for name, q in (("start", plan.problem.start), ("goal", plan.problem.goal)):
        joined = np.concatenate([q["left"], q["right"]])
        np.testing.assert_array_equal(model.key(name).qpos, joined)
        np.testing.assert_array_equal(model.key(name).ctrl, joined)


def test_from_the_start_the_arms_stand_still_and_driven_to_the_goal_they_get_there(tmp_path):
    plan = plan_from_dict(tiny_plans.two_apart())
    export_plan(plan, tmp_path / "cell.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "cell.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_step(model, data, 100)
    assert np.abs(data.qpos - model.key("start").qpos).max() < 1e-3
    for weight in np.linspace(0.0, 1.0, 200):
        data.ctrl[:] = (1 - weight) * model.key("start").ctrl + weight * model.key("goal").ctrl
        mujoco.mj_step(model, data, 10)
    mujoco.mj_step(model, data, 200)
    assert np.abs(data.qpos - model.key("goal").qpos).max() < 1e-2


@pytest.mark.parametrize("name", ["ring-2", "ring-2-panda"])
def test_each_arm_has_a_visible_site_at_its_tool(name):
    cell = find_cell(name)
    model = mujoco.MjModel.from_xml_string(mjcf_text(cell, poses(cell)))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    for arm in cell.arms:
        site = model.site(f"{arm.name}/tool_point")
        assert site.group[0] <= 2
        assert site.rgba[3] == 1.0
        expected = cell.collision.tool_points(arm.name, arm.robot.home[None])[0]
        np.testing.assert_allclose(data.site(site.name).xpos, expected, atol=1e-6)
        assert model.site(f"{arm.name}/flange").name


def test_obstacles_of_every_shape_and_held_objects_are_exported():
    shapes = [
        {"shape": "box", "size": [0.1, 0.2, 0.3], "yaw": 0.3},
        {"shape": "sphere", "radius": 0.1},
        {"shape": "cylinder", "radius": 0.05, "length": 0.4, "quaternion": [0.9, 0.1, 0.3, 0.2]},
        {"shape": "capsule", "radius": 0.05, "length": 0.4},
    ]
    obstacles = [
        shape | {"name": f"thing {k} & <more>", "position": [3.0 + k, 0.5, 0.5]} for k, shape in enumerate(shapes)
    ]
    data = tiny_plans.plan(
        [tiny_plans.arm("left", [0.0, 0.0, 0.0], yaw=1.0) | {"held": {**shapes[0], "position": [0.0, 0.0, 0.2]}}],
        {"left": [tiny_plans.UPRIGHT, tiny_plans.REACHING]},
        obstacles=obstacles,
    )
    cell = plan_from_dict(data).problem.cell
    model, other = compile_scene(cell), mujoco.MjModel.from_xml_string(mjcf_text(cell, poses(cell)))
    assert list(differences(model, other)) == []
    assert other.geom("obstacle/thing 3 & <more>").type == mujoco.mjtGeom.mjGEOM_CAPSULE
    assert other.body("left/held").mass > 0


def with_robot(text, monkeypatch):
    """Returns a cell of one UR5e with the MJCF `text` as its model."""
    cell = find_cell("ring-2")
    monkeypatch.setattr(mjcf, "compile_scene", lambda cell: mujoco.MjModel.from_xml_string(text))
    return replace(cell, arms=cell.arms[:1])


def test_a_robot_with_a_height_field_is_refused_because_a_file_alone_cannot_hold_it(monkeypatch):
    text = """
    <mujoco><asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset>
    <worldbody><body name="arm0/base"><geom type="hfield" hfield="h"/></body></worldbody></mujoco>
    """
    cell = with_robot(text, monkeypatch)
    with pytest.raises(MmpError, match="'arm0/base' has a geom of type hfield, which an XML file alone cannot hold"):
        mjcf_text(cell, poses(cell))


def test_the_hulls_of_a_cell_with_exact_geometry_are_meshes_at_the_same_places():
    cell = find_cell("ring-2-panda", spheres="exact")
    model, other = compile_scene(cell), mujoco.MjModel.from_xml_string(mjcf_text(cell, poses(cell)))
    np.testing.assert_allclose(mesh_boxes(other), mesh_boxes(model), atol=1e-6)


def mesh_boxes(model):
    """Returns the corners of the bounding boxes [m] of all mesh geoms in the frames of their bodies."""
    out = []
    for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        mesh, turn = model.geom_dataid[geom], np.empty(9)
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        points = model.mesh_vert[first : first + count] @ turn.reshape(3, 3).T + model.geom_pos[geom]
        out.append([points.min(axis=0), points.max(axis=0)])
    assert out
    return np.array(out)


def test_a_robot_with_other_actuators_than_position_servos_is_refused(monkeypatch):
    text = """
    <mujoco><worldbody><body><geom size="1"/><joint name="j"/></body></worldbody>
    <actuator><motor name="arm0/servo1" joint="j"/></actuator></mujoco>
    """
    cell = with_robot(text, monkeypatch)
    with pytest.raises(MmpError, match="actuator 'arm0/servo1' is no position servo"):
        mjcf_text(cell, poses(cell))
