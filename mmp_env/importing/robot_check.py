"""The contract test of a robot folder: every fault in one sentence, and what was proved."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from mmp_env.errors import MmpError, in_words
from mmp_env.importing.arm_geometry import ArmGeometry, Kinematics
from mmp_env.importing.cover_fit import Cover, fine_protrusion
from mmp_env.importing.cover_proof import protrusion, prove_cover
from mmp_env.importing.fingerprint import KEY, fingerprints
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import Piece, polytope
from mmp_env.importing.self_pairs import contact_counts, self_clearance
from mmp_env.model.transforms import matrix_from_quaternion, matrix_from_rpy, transform
from mmp_env.mujoco_import import mujoco

SPHERE_SETS = ("28", "fine")
_POSE_TOLERANCE = 1e-6
_INSIDE_M = 1e-6
_TOO_LARGE_M = 0.0021
"""Largest distance [m] from a piece to the geom that it stands for."""
_CONFIGURATIONS, _SELF_SAMPLES, _SPHERE_SAMPLES = 100, 10_000, 2000
_REASONS = ("adjacent", "always", "never")

Progress = Callable[[str], None]


@dataclass(kw_only=True, eq=False)
class RobotReport:
    """Faults of a robot folder, one sentence each, and the properties that hold."""

    faults: list[str] = field(default_factory=list)
    proved: list[str] = field(default_factory=list)
    uncovered_mm: dict[str, float] = field(default_factory=dict)
    protrusion_mm: dict[str, float] = field(default_factory=dict)

    def fields(self) -> dict[str, Any]:
        """Returns the report as JSON values."""
        return {
            "faults": self.faults,
            "proved": self.proved,
            "uncovered_mm": self.uncovered_mm,
            "protrusion_mm": self.protrusion_mm,
        }


def check_robot(folder: Path, progress: Progress = lambda line: None) -> RobotReport:
    """Returns the report on a robot folder. Faults of any kind are in the report; nothing is raised for them."""
    report = RobotReport()
    check = _Check(folder, report)
    steps: list[tuple[str, Callable[[], None]]] = [
        ("fingerprints", check.fingerprints),
        ("limits", check.limits),
        ("names", check.names),
        ("kinematics", check.kinematics),
        ("hulls", check.hulls),
        ("covers", check.covers),
        ("self-collision pairs", check.self_pairs),
        ("poses", check.poses),
    ]
    if not check.read():
        return report
    for name, step in steps:
        progress(name)
        before = len(report.faults)
        try:
            step()
        except (MmpError, ArithmeticError, KeyError, IndexError, TypeError, ValueError) as error:
            report.faults.append(f"{name} cannot be checked: {in_words(error)}")
        if len(report.faults) == before:
            report.proved.append(name)
    return report


class _Check:
    """The files of a folder and the steps of its test."""

    def __init__(self, folder: Path, report: RobotReport) -> None:
        self._folder, self._faults, self._report = folder, report.faults, report
        self._robot: dict[str, Any] = {}
        self._texts: dict[str, str] = {}

    def read(self) -> bool:
        """Reads the files. Returns whether the other steps can be taken."""
        name = self._folder.name
        for file in ("robot.json", "spheres.json", "hulls.json", f"{name}.xml"):
            try:
                self._texts[file] = (self._folder / file).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                if file != "hulls.json":  # robots without hulls have spheres alone
                    self._faults.append(f"{file} cannot be read: {in_words(error)}")
        if self._faults:
            return False
        try:
            self._robot = json.loads(self._texts["robot.json"])
            self._spheres = json.loads(self._texts["spheres.json"])
            self._hulls = json.loads(self._texts.get("hulls.json", "null"))
            self._model = mujoco.MjModel.from_xml_string(self._texts[f"{name}.xml"])
            self._links, self._joints = tuple(self._robot["links"]), self._robot["joints"]
            self._arm = self._arm_geometry()
        except (ValueError, KeyError, TypeError, IndexError, AttributeError, MmpError) as error:
            self._faults.append(f"{name} cannot be read: {in_words(error)}")
            return False
        return True

    def fingerprints(self) -> None:
        """The files are those of the import."""
        told = self._robot.get(KEY)
        if told is None:
            return
        texts = {name: text for name, text in self._texts.items() if name != "robot.json"}
        found = fingerprints(self._robot, texts)
        for file in sorted(set(told) | set(found)):
            if told.get(file) != found.get(file):
                self._fault(f"{file} was changed after the import")

    def limits(self) -> None:
        """Limits are finite, ordered and positive; poses and drawn configurations lie within them."""
        for joint in self._joints:
            name = joint["name"]
            if not joint["lower"] < joint["upper"]:
                self._fault(f"joint '{name}' has lower limit {joint['lower']} and upper limit {joint['upper']}")
            for key in ("velocity", "acceleration", "jerk", "effort"):
                if not 0 < joint[key] < np.inf:
                    self._fault(f"joint '{name}' has {key} {joint[key]}; it must be positive and finite")
            if abs(np.linalg.norm(joint["axis"]) - 1) > 1e-9:
                self._fault(f"the axis of joint '{name}' has no unit length")
        for key in ("home", "tucked"):
            q = np.array(self._robot[key], dtype=float)
            if q.shape != (len(self._joints),) or not ((self._lower < q) & (q < self._upper)).all():
                self._fault(f"pose '{key}' is not within the limits of the joints")
        draw = np.array(self._robot.get("draw_limits", np.column_stack([self._lower, self._upper])), dtype=float)
        if draw.shape != (len(self._joints), 2) or not (draw[:, 0] < draw[:, 1]).all():
            self._fault("draw_limits must hold a lower and a larger upper limit for each joint")

    def names(self) -> None:
        """The MJCF has the agreed names and limits."""
        model, dof = self._model, len(self._joints)
        wanted = {
            "bodies": (list(self._links), [model.body(i).name for i in range(1, model.nbody)]),
            "joints": ([f"joint{k + 1}" for k in range(dof)], [model.joint(i).name for i in range(model.njnt)]),
            "actuators": ([f"servo{k + 1}" for k in range(dof)], [model.actuator(i).name for i in range(model.nu)]),
        }
        for kind, (expected, found) in wanted.items():
            if expected != found:
                self._fault(f"the {kind} of the MJCF are {', '.join(found)}; they must be {', '.join(expected)}")
        if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange") < 0:
            self._fault("the MJCF has no site 'flange'")
        if model.njnt == dof:
            if not np.allclose(model.jnt_range, np.column_stack([self._lower, self._upper]), atol=1e-9):
                self._fault("the MJCF and robot.json have different joint limits")
            slides = model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)
            if list(slides) != list(self._arm.kinematics.slide):
                self._fault("the MJCF and robot.json have different joint types")
        if len(set(self._links)) < len(self._links):
            self._fault("two links have the same name")

    def kinematics(self) -> None:
        """robot.json and the MJCF put every link at the same pose."""
        model, data = self._model, mujoco.MjData(self._model)
        q = np.random.default_rng(0).uniform(self._lower, self._upper, (_CONFIGURATIONS, len(self._joints)))
        poses = self._arm.kinematics.link_poses(q)
        flange = poses[-1] @ _pose(self._robot["flange"])
        wrong = set()
        for row, configuration in enumerate(q):
            data.qpos[:] = configuration
            mujoco.mj_kinematics(model, data)
            for k, link in enumerate(self._links):
                if not _same(data.body(link).xpos, data.body(link).xmat, poses[k, row]):
                    wrong.add(link)
            if not _same(data.site("flange").xpos, data.site("flange").xmat, flange[row]):
                wrong.add("flange")
        for link in [*self._links, "flange"]:
            if link in wrong:
                self._fault(f"robot.json and the MJCF put '{link}' at different poses")

    def hulls(self) -> None:
        """Each geom of the MJCF lies in a piece of its link, which is hardly larger."""
        if self._hulls is None:
            self._fault("hulls.json is missing; the convex pieces are not known")
            return
        if set(self._hulls) != set(self._links):
            self._fault("hulls.json does not name the links of robot.json")
        for k, link in enumerate(self._links):
            geoms = [g for g in range(self._model.ngeom) if self._model.geom_bodyid[g] == self._model.body(link).id]
            pieces = self._arm.pieces[k]
            if len(geoms) != len(pieces):
                self._fault(f"link '{link}' has {len(geoms)} geoms in the MJCF and {len(pieces)} convex pieces")
                continue
            for number, (geom, piece) in enumerate(zip(geoms, pieces, strict=True)):
                outside, larger = self._misfit(geom, piece)
                if outside > _INSIDE_M:
                    self._fault(f"convex piece {number} of '{link}' leaves {outside * 1e3:.3f} mm of its geom outside")
                if larger > _TOO_LARGE_M:
                    self._fault(f"convex piece {number} of '{link}' is {larger * 1e3:.3f} mm larger than its geom")

    def covers(self) -> None:
        """Each sphere set covers the pieces, proved, and protrudes by no more than it may."""
        if set(self._spheres) != set(SPHERE_SETS):
            self._fault(f"the sphere sets are {', '.join(self._spheres)}; they must be {', '.join(SPHERE_SETS)}")
        for name, by_link in self._spheres.items():
            uncovered = largest = 0.0
            for link in by_link:
                if link not in self._links:
                    self._fault(f"set {name} has spheres for '{link}', which is no link")
            for k, link in enumerate(self._links):
                cover, pieces = self._arm.covers[name][k], self._arm.pieces[k]
                if not pieces:
                    continue
                if cover is None:
                    self._fault(f"set {name} has no spheres for '{link}'")
                    uncovered = np.inf
                    continue
                if not (cover.radii > 0).all():
                    self._fault(f"set {name} has a sphere of '{link}' without a positive radius")
                shape = LinkShape(pieces)
                gaps = prove_cover(shape, cover.centers, cover.radii)
                if len(gaps.points):
                    self._fault(f"set {name} leaves up to {gaps.uncovered_mm:.3f} mm of '{link}' uncovered")
                uncovered = max(uncovered, gaps.uncovered_mm)
                out = protrusion(shape, cover.centers, cover.radii) * 1e3
                if not np.isfinite(out):
                    self._fault(f"set {name} has a sphere of '{link}' whose centre lies outside the link")
                elif name == "fine" and out > (allowed := fine_protrusion(shape) * 1e3):
                    self._fault(f"set fine protrudes from '{link}' by {out:.3f} mm; at most {allowed:g} mm are allowed")
                largest = max(largest, out)
            self._report.uncovered_mm[name], self._report.protrusion_mm[name] = uncovered, round(largest, 4)
            told = self._robot.get("protrusion_mm", {}).get(name)
            if told is not None and abs(told - largest) > 1e-3:
                self._fault(f"robot.json says that set {name} protrudes by {told:g} mm; it is {largest:.4f} mm")

    def self_pairs(self) -> None:
        """Pairs that are left out have a reason that holds; all others can touch and can be free."""
        arm, robot = self._arm, self._robot
        reasons = {
            (frozenset((pair["a"], pair["b"])), pair.get("sphere_set")): pair["reason"]
            for pair in robot.get("self_pairs_ignored", [])
        }
        q = arm.draw(_SELF_SAMPLES, 0)
        overlaps, near = contact_counts(arm, self._without_excludes(), q)
        adjacent = {frozenset((arm.links[i], arm.links[j])) for i, j in arm.neighbours()}
        solid = [k for k, own in enumerate(arm.pieces) if own]
        truth: dict[frozenset[str], str] = {}
        for i, j in combinations(solid, 2):
            pair = frozenset((arm.links[i], arm.links[j]))
            touching = overlaps.get((i, j))
            if pair in adjacent:
                truth[pair] = "adjacent"
            elif (i, j) not in near:
                truth[pair] = "never"
            else:
                truth[pair] = "always" if touching is not None and touching.all() else "sometimes"
        poses = arm.kinematics.link_poses(q[:_SPHERE_SAMPLES])
        for (pair, key), reason in reasons.items():
            if not pair <= set(arm.links) or reason not in _REASONS:
                self._fault(f"the ignored pair {_named(pair)} has reason '{reason}', or a link that does not exist")
            elif key is None and truth.get(pair) != reason:
                self._fault(f"{_named(pair)} is ignored as '{reason}', and is '{truth.get(pair, 'without geometry')}'")
        for name, pairs in robot["self_collision_ignore"].items():
            left_out = {frozenset(pair) for pair in pairs}
            expected = {pair for pair, key in reasons if key in (None, name)}
            for pair in left_out - expected if reasons else ():
                self._fault(f"set {name} ignores {_named(pair)} without a reason")
            for pair in expected - left_out:
                self._fault(
                    f"set {name} does not ignore {_named(pair)}, which has the reason '{reasons.get((pair, None))}'"
                )
            for pair, kind in truth.items():
                i, j = sorted(arm.links.index(link) for link in pair)
                covers = arm.covers.get(name)
                in_spheres = covers is not None and _always(poses[i], covers[i], poses[j], covers[j])
                if pair not in left_out and (kind in ("adjacent", "always") or in_spheres):
                    self._fault(f"set {name} tests {_named(pair)}, which always overlap")
                if pair in left_out and kind == "sometimes" and not in_spheres:
                    self._fault(f"set {name} ignores {_named(pair)}, which can be free and can touch")
        self._check_excludes(reasons)

    def poses(self) -> None:
        """`home` and `tucked` are free of self-collision for all sphere sets and in MuJoCo."""
        arm = self._arm
        solid = [k for k, own in enumerate(arm.pieces) if own]
        for key in ("home", "tucked"):
            q = np.array(self._robot[key], dtype=float)[None]
            for name, covers in arm.covers.items():
                left_out = {frozenset(pair) for pair in self._robot["self_collision_ignore"][name]}
                pairs = [p for p in combinations(solid, 2) if frozenset(arm.links[k] for k in p) not in left_out]
                if self_clearance(arm, covers, pairs, q)[0] <= 0:
                    self._fault(f"pose '{key}' is in self-collision for sphere set {name}")
            data = mujoco.MjData(self._model)
            data.qpos[:] = q[0]
            mujoco.mj_forward(self._model, data)
            if data.ncon:
                self._fault(f"pose '{key}' is in self-collision in MuJoCo")

    def _fault(self, sentence: str) -> None:
        self._faults.append(sentence)

    def _arm_geometry(self) -> ArmGeometry:
        joints = self._joints
        self._lower = np.array([joint["lower"] for joint in joints], dtype=float)
        self._upper = np.array([joint["upper"] for joint in joints], dtype=float)
        draw = np.array(self._robot.get("draw_limits", np.column_stack([self._lower, self._upper])), dtype=float)
        hulls = self._hulls or {}
        covers = {name: [_cover(by_link.get(link)) for link in self._links] for name, by_link in self._spheres.items()}
        return ArmGeometry(
            links=self._links,
            kinematics=Kinematics(
                origins=np.array([_pose(joint["origin"]) for joint in joints]),
                axes=np.array([joint["axis"] for joint in joints], dtype=float),
                slide=np.array([joint.get("type") == "slide" for joint in joints]),
            ),
            pieces=tuple(
                tuple(
                    Piece(vertices=np.array(piece["vertices"], dtype=float), radius=float(piece["radius"]))
                    for piece in hulls.get(link, [])
                )
                for link in self._links
            ),
            covers=covers,
            lower=draw[:, 0],
            upper=draw[:, 1],
        )

    def _misfit(self, geom: int, piece: Piece) -> tuple[float, float]:
        """How far [m] a geom sticks out of its piece, and the piece out of the geom, at sampled directions."""
        model = self._model
        turn, place = matrix_from_quaternion(model.geom_quat[geom]), model.geom_pos[geom]
        directions = _directions(piece)
        local = directions @ turn
        size, kind = model.geom_size[geom], int(model.geom_type[geom])
        kinds = mujoco.mjtGeom
        if kind == int(kinds.mjGEOM_MESH):
            mesh = int(model.geom_dataid[geom])
            first = int(model.mesh_vertadr[mesh])
            support = (local @ model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].T.astype(float)).max(
                axis=1
            )
        elif kind == int(kinds.mjGEOM_BOX):
            support = np.abs(local) @ size
        elif kind == int(kinds.mjGEOM_SPHERE):
            support = np.full(len(local), size[0])
        elif kind == int(kinds.mjGEOM_CAPSULE):
            support = size[0] + np.abs(local[:, 2]) * size[1]
        elif kind == int(kinds.mjGEOM_CYLINDER):
            support = np.hypot(local[:, 0], local[:, 1]) * size[0] + np.abs(local[:, 2]) * size[1]
        else:
            support = np.linalg.norm(local * size, axis=1)
        support = support + directions @ place
        own = (directions @ piece.vertices.T).max(axis=1) + piece.radius
        return float((support - own).max()), float((own - support).max())

    def _without_excludes(self) -> str:
        spec = mujoco.MjSpec.from_string(self._texts[f"{self._folder.name}.xml"])
        neighbours = {frozenset((self._links[k], self._links[k + 1])) for k in range(len(self._joints))}
        neighbours |= {frozenset((self._links[i], self._links[j])) for i, j in self._arm.neighbours()}
        for pair in list(spec.excludes):
            if frozenset((pair.bodyname1, pair.bodyname2)) not in neighbours:
                spec.delete(pair)
        return spec.to_xml()

    def _check_excludes(self, reasons: dict[Any, str]) -> None:
        """The MJCF leaves out neighbours, and what all sphere sets leave out."""
        names = {body: self._model.body(body).name for body in range(self._model.nbody)}
        found = {
            frozenset((names[int(sign) >> 16], names[int(sign) & 0xFFFF])) for sign in self._model.exclude_signature
        }
        sets = [{frozenset(pair) for pair in pairs} for pairs in self._robot["self_collision_ignore"].values()]
        wanted = set.intersection(*sets) if sets else set()
        wanted |= {frozenset((self._links[k], self._links[k + 1])) for k in range(len(self._joints))}
        for pair in found ^ wanted:
            verb = "excludes" if pair in found else "does not exclude"
            self._fault(f"the MJCF {verb} contacts of {_named(pair)}, other than robot.json")


def _always(first_poses: Any, first: Cover | None, second_poses: Any, second: Cover | None) -> bool:
    from mmp_env.importing.self_pairs import always_overlap

    return always_overlap(first_poses, first, second_poses, second)


def _directions(piece: Piece) -> np.ndarray:
    """Directions in which a piece and its geom are compared: the normals of the piece, and to its vertices."""
    spread = np.random.default_rng(0).normal(size=(500, 3))
    parts = [spread, np.eye(3), -np.eye(3)]
    if len(piece.vertices) > 3:
        hull = polytope(piece.vertices)
        parts += [hull.planes[:, :3], hull.vertices - hull.vertices.mean(axis=0)]
    out = np.concatenate(parts)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


def _cover(rows: Any) -> Cover | None:
    if not rows:
        return None
    table = np.array(rows, dtype=float).reshape(-1, 4)
    if not np.isfinite(table).all():
        raise MmpError("a sphere has a number that is not finite")
    return Cover(centers=table[:, :3], radii=table[:, 3], protrusion=0.0)


def _pose(data: Any) -> np.ndarray:
    return transform(matrix_from_rpy(data["rpy"]), data["xyz"])


def _same(position: np.ndarray, matrix: np.ndarray, pose: np.ndarray) -> bool:
    return bool(
        np.abs(position - pose[:3, 3]).max() < _POSE_TOLERANCE
        and np.abs(matrix.reshape(3, 3) - pose[:3, :3]).max() < _POSE_TOLERANCE
    )


def _named(pair: Any) -> str:
    return "-".join(sorted(pair))
