"""A cell as one self-contained MJCF file, with keyframes and a visible site at each tool.

This module writes the numbers of the compiled model. MuJoCo's own writer rounds to six digits, and its output for parts
that were attached with a prefix does not compile.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.scene import compile_scene
from mmp_env.sim.scene_appearance import SKY

TOOL_SITE = "tool_point"
"""Name of the site `<arm>/tool_point`: at the tool point, or at the flange of an arm without a tool."""
_MARK = {"size": "0.015", "group": "0", "rgba": "0.9 0.2 0.1 1"}
_NOTE = " Keyframes `start` and `goal`: in MuJoCo's viewer, choose one under Simulation and press Load key. "

_GEOMS = {"plane": 3, "sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
"""Type of geom -> number of its sizes."""
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
_TOUCH = ["contype", "conaffinity", "condim", "priority", "friction", "solmix", "solref", "solimp", "margin", "gap"]
_GEOM = ["pos", "quat", "group", "rgba", *_TOUCH]
_SITE = ["size", "pos", "quat", "group", "rgba"]
_MATERIAL = ["rgba", "emission", "specular", "shininess", "reflectance", "metallic", "roughness"]
_LIGHT = ["pos", "dir", "diffuse", "specular", "ambient", "attenuation", "cutoff", "exponent", "castshadow", "active"]
_CAMERA = ["pos", "quat", "fovy"]
_JOINT = {"jnt": ["pos", "axis", "group", "stiffness", "margin"], "dof": ["damping", "armature", "frictionloss"]}
_ACTUATOR = ["gear", "group"]
_PLAIN = """
<mujoco>
  <asset><material name="m"/></asset>
  <worldbody><light/><camera/><body><joint name="j"/><geom size="1"/><site/></body></worldbody>
  <actuator><general joint="j"/></actuator>
</mujoco>
"""


def mjcf_text(cell: Cell, keyframes: Mapping[str, Mapping[str, Float[np.ndarray, " dof"]]]) -> str:
    """Returns the XML of a cell.

    Args:
        keyframes: name -> arm name -> [dof] [rad]; the set points of the servos are the same.

    Raises:
        MmpError: if a robot has a geom that an XML file cannot hold, or actuators other than position servos.
    """
    return _Writer(cell).text(keyframes)


class _Writer:
    def __init__(self, cell: Cell) -> None:
        self._cell, self._model = cell, compile_scene(cell)
        self._plain = mujoco.MjModel.from_xml_string(_PLAIN)
        self._flanges = {f"{arm.name}/flange": arm.name for arm in cell.arms if arm.tool is None}

    def text(self, keyframes: Mapping[str, Mapping[str, Float[np.ndarray, " dof"]]]) -> str:
        model, root = self._model, ET.Element("mujoco", model=self._cell.name)
        root.append(ET.Comment(_NOTE))
        ET.SubElement(root, "compiler", angle="radian")
        option = ET.SubElement(root, "option", timestep=_words(model.opt.timestep), integrator="implicitfast")
        ET.SubElement(option, "flag", filterparent="disable")
        ET.SubElement(root, "statistic", center=_words(model.stat.center), extent=_words(model.stat.extent))
        self._visual(ET.SubElement(root, "visual"))
        assets = ET.SubElement(root, "asset")
        sky = {key: _words(np.array(value)) for key, value in SKY.items()}
        ET.SubElement(assets, "texture", {"name": "sky", "type": "skybox", "builtin": "gradient"} | sky)
        for k in sorted({int(model.geom_dataid[k]) for k in np.flatnonzero(model.geom_type == _MESH)}):
            ET.SubElement(assets, "mesh", self._mesh(k))
        for k in range(model.nmat):
            ET.SubElement(assets, "material", self._named("material", k) | self._unlike("mat", _MATERIAL, k))
        world = ET.SubElement(root, "worldbody")
        self._fill(world, 0)
        contact = ET.SubElement(root, "contact")
        for signature in model.exclude_signature.tolist():
            first, second = (model.body(number).name for number in (signature >> 16, signature & 0xFFFF))
            ET.SubElement(contact, "exclude", body1=first, body2=second)
        self._actuators(ET.SubElement(root, "actuator"))
        keys = ET.SubElement(root, "keyframe")
        for name, q in keyframes.items():
            joined = _words(np.concatenate([q[arm] for arm in self._cell.arm_names]))
            ET.SubElement(keys, "key", name=name, qpos=joined, ctrl=joined)
        ET.indent(root)
        return ET.tostring(root, encoding="unicode") + "\n"

    def _visual(self, visual: ET.Element) -> None:
        for part, tag in (("global_", "global"), ("headlight",) * 2, ("map",) * 2, ("quality",) * 2):
            here, plain = getattr(self._model.vis, part), getattr(self._plain.vis, part)
            names = [name for name in dir(here) if not name.startswith("_")]
            other = {n: getattr(here, n) for n in names if not np.array_equal(getattr(here, n), getattr(plain, n))}
            if other:
                ET.SubElement(visual, tag, {name: _words(np.float32(value)) for name, value in other.items()})

    def _fill(self, element: ET.Element, body: int) -> None:
        """Adds the joints, geoms, sites, cameras and lights of a body, and its child bodies."""
        model = self._model
        for k in _of(model.jnt_bodyid, body):
            ET.SubElement(element, "joint", self._joint(k))
        for k in _of(model.geom_bodyid, body):
            ET.SubElement(element, "geom", self._geom(k))
        for k in _of(model.site_bodyid, body):
            self._site(element, k)
        for k in _of(model.cam_bodyid, body):
            ET.SubElement(element, "camera", self._named("camera", k) | self._unlike("cam", _CAMERA, k))
        for k in _of(model.light_bodyid, body):
            kind = mujoco.mjtLightType(model.light_type[k]).name.removeprefix("mjLIGHT_").lower()
            ET.SubElement(element, "light", {"type": kind} | self._unlike("light", _LIGHT, k))
        for k in _of(model.body_parentid, body):
            if k != 0:  # the world is its own parent
                self._fill(self._body(element, k), k)

    def _body(self, parent: ET.Element, k: int) -> ET.Element:
        model = self._model
        place = self._named("body", k) | self._unlike("body", ["pos", "quat", "gravcomp"], k)
        out = ET.SubElement(parent, "body", place)
        if model.body_mass[k] > 0:
            inertia = {"pos": model.body_ipos[k], "quat": model.body_iquat[k], "mass": model.body_mass[k]}
            numbers = inertia | {"diaginertia": model.body_inertia[k]}
            ET.SubElement(out, "inertial", {key: _words(value) for key, value in numbers.items()})
        return out

    def _joint(self, k: int) -> dict[str, str]:
        model, dof = self._model, int(self._model.jnt_dofadr[k])
        kind = mujoco.mjtJoint(model.jnt_type[k]).name.removeprefix("mjJNT_").lower()
        out = self._named("joint", k) | {"type": kind} | self._unlike("jnt", _JOINT["jnt"], k)
        out |= self._unlike("dof", _JOINT["dof"], dof)
        if model.jnt_limited[k]:
            out["range"] = _words(model.jnt_range[k])
        if model.jnt_actfrclimited[k]:
            out["actuatorfrcrange"] = _words(model.jnt_actfrcrange[k])
        if model.jnt_actgravcomp[k]:
            out["actuatorgravcomp"] = "true"
        return out

    def _geom(self, k: int) -> dict[str, str]:
        model = self._model
        kind = mujoco.mjtGeom(model.geom_type[k]).name.removeprefix("mjGEOM_").lower()
        if kind not in (*_GEOMS, "mesh"):
            owner = model.body(model.geom_bodyid[k]).name
            raise MmpError(f"body '{owner}' has a geom of type {kind}, which an XML file alone cannot hold")
        out = self._named("geom", k) | {"type": kind}
        if kind == "mesh":
            out["mesh"] = _mesh_name(int(model.geom_dataid[k]))
        else:
            out["size"] = _words(model.geom_size[k][: _GEOMS[kind]])
        if model.geom_matid[k] >= 0:
            out["material"] = model.material(model.geom_matid[k]).name
        return out | self._unlike("geom", _GEOM, k)

    def _mesh(self, k: int) -> dict[str, str]:
        """Returns the attributes of a mesh, whose collisions are those of its convex hull."""
        first, count = self._model.mesh_vertadr[k], self._model.mesh_vertnum[k]
        vertices = self._model.mesh_vert[first : first + count]
        return {"name": _mesh_name(k), "vertex": _words(vertices.ravel()), "inertia": "convex"}

    def _site(self, element: ET.Element, k: int) -> None:
        """Adds a site; a tool point is visible, and a flange without a tool becomes one."""
        here = self._named("site", k) | self._unlike("site", _SITE, k)
        name = here["name"]
        ET.SubElement(element, "site", here | (_MARK if name.endswith(f"/{TOOL_SITE}") else {}))
        if name in self._flanges:
            ET.SubElement(element, "site", here | _MARK | {"name": f"{self._flanges[name]}/{TOOL_SITE}"})

    def _actuators(self, element: ET.Element) -> None:
        model = self._model
        for k in range(model.nu):
            gain, bias = model.actuator_gainprm[k], model.actuator_biasprm[k]
            if bias[1] != -gain[0]:
                raise MmpError(
                    f"actuator '{model.actuator(k).name}' is no position servo, which the servos of arms are"
                )
            out = self._named("actuator", k) | {"joint": model.joint(model.actuator_trnid[k, 0]).name}
            out |= {"kp": _words(gain[0]), "kv": _words(-bias[2])} | self._unlike("actuator", _ACTUATOR, k)
            if model.actuator_ctrllimited[k]:
                out["ctrlrange"] = _words(model.actuator_ctrlrange[k])
            if model.actuator_forcelimited[k]:
                out["forcerange"] = _words(model.actuator_forcerange[k])
            ET.SubElement(element, "position", out)

    def _named(self, kind: str, k: int) -> dict[str, str]:
        name = getattr(self._model, kind)(k).name
        return {"name": name} if name else {}

    def _unlike(self, prefix: str, keys: list[str], k: int) -> dict[str, str]:
        """Returns the attributes of element `k` that differ from MuJoCo's defaults."""
        out = {}
        for key in keys:
            value = getattr(self._model, f"{prefix}_{key}")[k]
            if not np.array_equal(value, getattr(self._plain, f"{prefix}_{key}")[-1]):
                out[key] = _words(value)
        return out


def _mesh_name(k: int) -> str:
    return f"hull{k}"


def _of(owners: np.ndarray, body: int) -> list[int]:
    return np.flatnonzero(owners == body).tolist()


def _words(value: Any) -> str:
    """Returns numbers in the shortest form that reads back the same, in their own precision."""
    return " ".join(_word(number) for number in np.atleast_1d(value))


def _word(number: Any) -> str:
    if isinstance(number, bool | np.bool_):
        return "true" if number else "false"
    return str(number).removesuffix(".0")
