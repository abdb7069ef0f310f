"""URDF as text that MuJoCo reads, and what MuJoCo leaves out: velocity limits and mimic joints."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.files.paths import is_file, is_folder, real_path

_LEAST_INERTIA, _GYRATION_M = 1e-14, 0.01
"""Least eigenvalue of an inertia [kg m^2]; radius of gyration [m] of one that takes the place of an impossible one."""
_PACKAGE = "package://"


_FILE = "file://"


def urdf_facts(path: Path, root: ET.Element) -> tuple[dict[str, float], dict[str, str]]:
    """Returns velocity limits and mimic joints by name.

    Raises `MmpError` for a joint without the limits that URDF demands, numbers of a limit that are none, two joints of
    one name, a closed loop, and a mass that no body has.
    """
    for link in root.findall("link"):
        mass = link.find("inertial/mass")
        if mass is not None and not 0 <= _number(mass, "value", math.nan) < math.inf:
            raise MmpError(f"{path}: link '{link.get('name')}' has mass '{mass.get('value')}'; it must be 0 kg or more")
    velocity, mimics, names, parents = {}, {}, set(), {}
    for joint in root.findall("joint"):
        name, kind, limit = joint.get("name", ""), joint.get("type"), joint.find("limit")
        if name in names:
            raise MmpError(f"{path} has two joints with the name '{name}'; names must differ")
        names.add(name)
        child, parent = (
            element.get("link") if (element := joint.find(key)) is not None else None for key in ("child", "parent")
        )
        if child in parents:
            raise MmpError(
                f"{path} has a closed loop: link '{child}' hangs on both '{parents[child]}' and '{parent}';"
                " an arm must be a serial chain"
            )
        parents[child] = parent
        if kind in ("revolute", "prismatic"):
            lower, upper = (_number(limit, key) for key in ("lower", "upper"))
            if limit is not None and lower > upper:
                raise MmpError(f"{path}: joint '{name}' has lower limit {lower:g} and upper limit {upper:g}; swap them")
            if limit is None or not lower < upper:
                raise MmpError(
                    f"{path}: joint '{name}' is {kind} and has no limits; give <limit lower upper effort velocity>"
                    + (", or make it continuous" if kind == "revolute" else "")
                )
        for key in ("lower", "upper", "effort", "velocity"):
            if math.isnan(_number(limit, key, math.nan)):
                told = limit.get(key) if limit is not None else None
                raise MmpError(f"{path}: joint '{name}' has {key} '{told}'; it must be a number")
        if 0 < _number(limit, "velocity") < math.inf:
            velocity[name] = _number(limit, "velocity")
        if (mimic := joint.find("mimic")) is not None:
            mimics[name] = mimic.get("joint", "")
    return velocity, mimics


def _number(element: ET.Element | None, key: str, malformed: float = 0.0) -> float:
    """Returns an attribute as a number: 0 if it is missing, `malformed` if it is no number."""
    try:
        return float(element.get(key, "0")) if element is not None else 0.0
    except ValueError:
        return malformed


def urdf_text(path: Path, root: ET.Element, package_dirs: Sequence[str | Path]) -> str:
    """Returns a URDF whose mesh paths are absolute and whose fixed links keep their names.

    Raises `MmpError` where a package or one of its mesh files cannot be found.
    """
    compiler = {"strippath": "false", "fusestatic": "false", "discardvisual": "true", "balanceinertia": "true"}
    for old in root.findall("mujoco"):
        root.remove(old)  # MuJoCo's own settings in a URDF say where meshes lie, which is resolved here
        _resolve_mesh_folder(old, root)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", compiler)
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        for mesh in link.iter("mesh"):
            mesh.set("filename", str(_resolved(path, mesh.get("filename", ""), package_dirs)))
    return ET.tostring(root, encoding="unicode")


def repair_inertia(link: ET.Element) -> bool:
    """Replaces an inertia that no body has, which MuJoCo refuses, by a small one. The mass stays.

    Returns whether it did.
    """
    inertia, mass = link.find("inertial/inertia"), link.find("inertial/mass")
    if inertia is None:
        return False
    xx, yy, zz, xy, xz, yz = (_number(inertia, key) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.isfinite(matrix).all() and np.linalg.eigvalsh(matrix).min() > _LEAST_INERTIA:
        return False
    value = max(_number(mass, "value") * _GYRATION_M**2, 1e-9)
    inertia.attrib.update(dict.fromkeys(("ixy", "ixz", "iyz"), "0"))
    inertia.attrib.update(dict.fromkeys(("ixx", "iyy", "izz"), f"{value:g}"))
    return True


def _resolve_mesh_folder(settings: ET.Element, root: ET.Element) -> None:
    """Prefixes mesh paths as the `meshdir` of a `<mujoco>` element in a URDF says."""
    compiler = settings.find("compiler")
    folder = compiler.get("meshdir") if compiler is not None else None
    if compiler is None or not (folder or compiler.get("strippath", "true") == "true"):
        return
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if compiler.get("strippath", "true") == "true":
            name = name.rpartition("/")[2]
        mesh.set("filename", f"{folder}/{name}" if folder else name)


def _resolved(path: Path, name: str, package_dirs: Sequence[str | Path]) -> Path:
    """Returns the mesh file that a URDF names. Raises `MmpError` where a package cannot be found."""
    if name.startswith(_FILE):
        return Path(name.removeprefix(_FILE))
    if not name.startswith(_PACKAGE):
        file = Path(name)
        return file if file.is_absolute() else real_path(path).parent / file
    package, _, inside = name.removeprefix(_PACKAGE).partition("/")
    folders = [Path(folder) / package for folder in package_dirs]
    folders += [Path(folder) for folder in package_dirs if real_path(folder).name == package]
    folders += [folder for folder in real_path(path).parents if folder.name == package]
    for folder in folders:
        if is_file(folder / inside):
            return real_path(folder / inside)
    if folders and any(is_folder(folder) for folder in folders):
        raise MmpError(f"{path} names the mesh file {name}, which does not exist in {folders[0]}")
    raise MmpError(
        f"{path} names {name}, and package '{package}' cannot be found; --package-dir names the folder that holds it"
    )
