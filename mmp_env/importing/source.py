"""Reads a URDF or MJCF file into a compiled MuJoCo model that holds collision geometry only.

MuJoCo parses both formats. This module finds the mesh files, leaves out everything that does not collide, and reads
from a URDF the two facts that MuJoCo drops: velocity limits and mimic joints.
"""

from __future__ import annotations

import contextlib
import hashlib
import xml.etree.ElementTree as ET
import xml.parsers.expat as expat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.files.paths import exists, is_file, is_folder, real_path, refusal
from mmp_env.importing.compiled_source import SourceModel
from mmp_env.importing.finite import require_finite_model
from mmp_env.importing.urdf import repair_inertia, urdf_facts, urdf_text
from mmp_env.meshes.mesh_files import is_read_by_mujoco, read_mesh, refuse_words
from mmp_env.mujoco_import import mujoco, without_log, without_report

MOST_GEOMS = 1000
"""Largest number of collision geoms in a model."""
_MOST_BYTES = 64 * 2**20
_UNBOUND_PREFIX = expat.errors.codes[expat.errors.XML_ERROR_UNBOUND_PREFIX]


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedSource:
    """A model that was parsed and not yet compiled; the fields are those of `SourceModel`, and the `inputs`.

    `inputs` are the files that it is made of and the folders of packages.
    """

    path: Path
    title: str
    spec: Any
    velocity: Mapping[str, float]
    mimics: Mapping[str, str]
    digest: str
    notes: tuple[str, ...]
    inputs: tuple[Path, ...]

    def compiled(self) -> SourceModel:
        """Returns the compiled model. Raises `MmpError` if MuJoCo refuses it."""
        return SourceModel(
            path=self.path,
            title=self.title,
            model=_compiled(self.path, self.spec),
            velocity=self.velocity,
            mimics=self.mimics,
            digest=self.digest,
            notes=self.notes,
        )


def read_source(path: str | Path, package_dirs: Sequence[str | Path] = ()) -> SourceModel:
    """Returns the compiled model of a URDF or MJCF file, see `prepare_source`. Raises `MmpError`."""
    return prepare_source(path, package_dirs).compiled()


def prepare_source(path: str | Path, package_dirs: Sequence[str | Path] = ()) -> PreparedSource:
    """Returns the model of a URDF or MJCF file with the hash of all files that it is made of.

    Args:
        path: A `.urdf` or `.xml` file.
        package_dirs: Folders in which packages of `package://` paths are looked for.

    Raises:
        MmpError: if the file, or one that it names, cannot be read, or if MuJoCo refuses the model.
    """
    path = Path(path)
    if not is_file(path):
        what = "it is not a file" if exists(path) else "there is no such file"
        raise MmpError(f"{path} cannot be read: {what}")
    for folder in package_dirs:
        if not is_folder(folder):
            raise MmpError(f"--package-dir {folder} is not a folder")
    text = _text(path)
    root = _root(path, text)
    urdf = root.tag == "robot"
    if urdf:
        facts = urdf_facts(path, root)
        repaired = [link.get("name", "") for link in root.findall("link") if repair_inertia(link)]
        urdf_xml = urdf_text(path, root, package_dirs)
        spec = _parsed(path, lambda: mujoco.MjSpec.from_string(urdf_xml))
    elif root.tag == "mujoco":
        facts, repaired = ({}, {}), []
        spec = _parsed(path, lambda: mujoco.MjSpec.from_file(str(real_path(path))))
    else:
        raise MmpError(f"{path} is neither URDF nor MJCF: its root element is <{root.tag}>")
    _refuse_what_cannot_be_represented(path, spec)
    _keep_collision_geometry(path, spec)
    files = _prepare_meshes(path, spec)
    title = (root.get("name" if urdf else "model") or path.stem).strip() or "robot"
    files += _included(real_path(path).parent, root)
    notes = [f"links with an inertia that no body has get a small one: {', '.join(repaired)}"]
    return PreparedSource(
        path=path,
        title=title,
        spec=spec,
        velocity=facts[0],
        mimics=facts[1],
        digest=_digest(text, files),
        notes=tuple(notes) if repaired else (),
        inputs=(path, *files, *map(Path, package_dirs)),
    )


def _text(path: Path) -> bytes:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise MmpError(f"{path} has more than {_MOST_BYTES >> 20} MB; a robot description is text without meshes")
    except OSError as error:
        raise refusal(path, "read", error) from None
    return _content(path)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise refusal(path, "read", error) from None


def _root(path: Path, text: bytes) -> ET.Element:
    try:
        root = parsed_xml(text)
    except (ET.ParseError, expat.ExpatError, LookupError, ValueError) as error:
        raise MmpError(f"{path} is not XML: {error}") from None
    if path.suffix.lower() == ".xacro" or any(_is_xacro(element.tag) for element in root.iter()):
        raise MmpError(f"{path} is a xacro file; run `xacro {path.name} > robot.urdf` first")
    return root


def parsed_xml(text: bytes) -> ET.Element:
    """Returns the root of a document, which may use prefixes that it does not declare, as ROS allows.

    Raises:
        ParseError: if it is not XML.
    """
    try:
        return ET.fromstring(text)
    except ET.ParseError as error:
        if error.code != _UNBOUND_PREFIX:
            raise
    builder, parser = ET.TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler = lambda tag, own: builder.start(tag, {k: v for k, v in own.items() if ":" not in k})
    parser.EndElementHandler, parser.CharacterDataHandler = builder.end, builder.data
    parser.Parse(text, True)
    return builder.close()


def _is_xacro(tag: str) -> bool:
    return "ros.org/wiki/xacro" in tag or tag.startswith("xacro:")


@contextlib.contextmanager
def _without_asset_cache() -> Iterator[None]:
    """Keeps MuJoCo from keeping a second copy of all compiled meshes."""
    cache = mujoco.mj_getCache()
    before = mujoco.mj_getCacheCapacity(cache)
    mujoco.mj_setCacheCapacity(cache, 0)
    try:
        yield
    finally:
        mujoco.mj_setCacheCapacity(cache, before)


def _parsed(path: Path, read: Any) -> Any:
    try:
        with without_log():
            return read()
    except ValueError as error:
        raise MmpError(f"{path} cannot be read by MuJoCo: {one_line(error)}") from None


def _refuse_what_cannot_be_represented(path: Path, spec: Any) -> None:
    if list(spec.flexes) or list(getattr(spec, "skins", ())):
        raise MmpError(f"{path} has flexible bodies, which have no rigid collision geometry")
    for geom in spec.geoms:
        if geom.type == mujoco.mjtGeom.mjGEOM_HFIELD and geom.parent.name != "world":
            raise MmpError(f"{path}: geom '{geom.name}' is a height field, which an arm cannot carry")


def _keep_collision_geometry(path: Path, spec: Any) -> None:
    """Removes everything that collides with nothing, looks included. Raises `MmpError` where nothing is left."""
    paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    for items in (spec.sensors, spec.textures, spec.cameras, spec.lights):
        for item in list(items):
            spec.delete(item)
    for geom in list(spec.geoms):
        geom.material = ""
        scenery = geom.parent.name == "world"
        if scenery or not (geom.contype or geom.conaffinity or (geom.name and geom.name in paired)):
            if geom.name in paired:
                for pair in [p for p in spec.pairs if geom.name in (p.geomname1, p.geomname2)]:
                    spec.delete(pair)
            spec.delete(geom)
    for site in spec.sites:
        site.material = ""
    for material in list(spec.materials):
        spec.delete(material)
    geoms = list(spec.geoms)
    if len(geoms) > MOST_GEOMS:
        raise MmpError(f"{path} has {len(geoms)} collision geoms; at most {MOST_GEOMS} can be imported")
    if not geoms:
        raise MmpError(f"{path} has no collision geometry: every geom has contype and conaffinity 0, or there is none")
    used = {geom.meshname for geom in geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)


def _prepare_meshes(path: Path, spec: Any) -> list[Path]:
    """Checks the mesh files, and converts those that MuJoCo cannot read. Returns the files."""
    files = []
    for mesh in spec.meshes:
        if not np.all(np.abs(mesh.scale) > 0) or not np.all(np.isfinite(mesh.scale)):
            raise MmpError(f"{path}: mesh '{mesh.name}' has scale {_vector(mesh.scale)}; no factor may be 0")
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        if not mesh.file:
            continue
        file = _mesh_path(spec, path, mesh.file)
        if not is_file(file):
            raise MmpError(f"{path} names the mesh file {file}, which does not exist")
        files.append(file)
        mesh.file = str(file)
        if file.suffix.lower() in (".obj", ".dae"):
            refuse_words(file, _content(file))
        if not is_read_by_mujoco(file):
            vertices, faces = read_mesh(file)
            mesh.file = ""
            mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
    spec.meshdir = ""
    return files


def _mesh_path(spec: Any, path: Path, name: str) -> Path:
    if spec.strippath:
        name = name.replace("\\", "/").rpartition("/")[2]
    file = Path(name)
    return file if file.is_absolute() else real_path(path).parent / (spec.meshdir or "") / file


def _compiled(path: Path, spec: Any) -> Any:
    spec.compiler.balanceinertia = True
    spec.compiler.boundmass = max(spec.compiler.boundmass, 1e-6)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, 1e-9)
    spec.compiler.discardvisual = False
    spec.compiler.fusestatic = False
    for key in list(spec.keys):
        if len(key.qpos) and not np.all(np.isfinite(key.qpos)):
            spec.delete(key)
    try:
        with without_log(), without_report(beside_threads=True), _without_asset_cache():
            model = spec.compile()
    except ValueError as error:
        raise MmpError(f"{path} is refused by MuJoCo: {one_line(error)}") from None
    require_finite_model(str(path), model)
    return model


def _included(folder: Path, root: ET.Element) -> list[Path]:
    """The files that an MJCF includes, and those that they include; MuJoCo has read them all already."""
    out, names = [], [element.get("file", "") for element in root.iter("include")]
    while names:
        file = folder / names.pop()
        if is_file(file) and file not in out:
            out.append(file)
            names += [element.get("file", "") for element in _root(file, _text(file)).iter("include")]
    return out


def _digest(text: bytes, files: Sequence[Path]) -> str:
    out = hashlib.sha256(text)
    for file in sorted(set(files)):
        out.update(hashlib.sha256(file.read_bytes()).digest())
    return out.hexdigest()


def _vector(values: Any) -> str:
    return "[" + ", ".join(f"{x:g}" for x in values) + "]"


def one_line(error: Exception) -> str:
    """Returns the message of MuJoCo's compiler in one line."""
    text = " ".join(str(error).split())
    for prefix in ("XML Error: ", "Error: "):
        text = text.removeprefix(prefix)
    return text
