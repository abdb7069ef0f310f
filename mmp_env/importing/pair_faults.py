"""Faults of self-collision pairs: pairs left out without a reason that holds, and poses in self-collision."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from jaxtyping import Float

from mmp_env.importing.checked_files import RobotFiles, named
from mmp_env.importing.self_pairs import always_overlap, contact_counts, self_clearance
from mmp_env.mujoco_import import mujoco, without_log

_SELF_SAMPLES, _SPHERE_SAMPLES = 10_000, 2000
_REASONS = ("adjacent", "always", "never")


def pair_faults(files: RobotFiles) -> Iterator[str]:
    """Pairs that are left out have a reason that holds; all others can touch and can be free."""
    arm, robot = files.arm, files.robot
    q = arm.draw(_SELF_SAMPLES, 0)
    truth = _true_kinds(files, q)
    reasons = {
        (frozenset((pair["a"], pair["b"])), pair.get("sphere_set")): pair["reason"]
        for pair in robot.get("self_pairs_ignored", [])
    }
    for (pair, key), reason in reasons.items():
        if not pair <= set(arm.links) or reason not in _REASONS:
            yield f"the ignored pair {named(pair)} has reason '{reason}', or a link that does not exist"
        elif key is None and truth.get(pair) != reason:
            yield f"{named(pair)} is ignored as '{reason}', and is '{truth.get(pair, 'without geometry')}'"
        elif key is not None and reason != "always":
            yield f"{named(pair)} is ignored by set {key} as '{reason}'; only 'always' holds for one set alone"
    poses = arm.kinematics.link_poses(q[:_SPHERE_SAMPLES])
    for name, pairs in robot["self_collision_ignore"].items():
        left_out = {frozenset(pair) for pair in pairs}
        if reasons or "imported" in robot:
            yield from _reason_faults(name, left_out, reasons)
        for pair, kind in truth.items():
            i, j = sorted(arm.links.index(link) for link in pair)
            covers = arm.covers.get("fine" if name == "exact" else name)
            in_spheres = covers is not None and always_overlap(poses[i], covers[i], poses[j], covers[j])
            always = kind in ("adjacent", "always") or (in_spheres and name != "exact")
            if pair not in left_out and always:
                yield f"set {name} tests {named(pair)}, which always overlap"
            if pair in left_out and kind == "sometimes" and not in_spheres:
                yield f"set {name} ignores {named(pair)}, which can be free and can touch"
    yield from _exclude_faults(files, truth)


def _reason_faults(
    name: str, left_out: set[frozenset[str]], reasons: Mapping[tuple[frozenset[str], str | None], str]
) -> Iterator[str]:
    """A sphere set ignores the pairs that have a reason, and no others."""
    expected = {pair for pair, key in reasons if key in (None, name)}
    for pair in sorted(left_out - expected, key=named):
        yield f"set {name} ignores {named(pair)} without a reason"
    for pair in sorted(expected - left_out, key=named):
        reason = reasons.get((pair, None)) or reasons.get((pair, name))
        yield f"set {name} does not ignore {named(pair)}, which has the reason '{reason}'"


def _true_kinds(files: RobotFiles, q: Float[np.ndarray, "n dof"]) -> dict[frozenset[str], str]:
    """Classes of all pairs of links over the configurations: adjacent, never, always or sometimes in contact."""
    arm = files.arm
    overlaps, near = contact_counts(arm, _without_excludes(files), q)
    adjacent = set(arm.neighbours())
    out = {}
    for i, j in combinations(files.solid, 2):
        touching = overlaps.get((i, j))
        kind = "always" if touching is not None and touching.all() else "sometimes"
        kind = "adjacent" if (i, j) in adjacent else "never" if (i, j) not in near else kind
        out[frozenset((arm.links[i], arm.links[j]))] = kind
    return out


def _exclude_faults(files: RobotFiles, truth: Mapping[frozenset[str], str]) -> Iterator[str]:
    """The MJCF leaves out neighbours and what all sphere sets leave out, and no pair that can be free and can touch."""
    names = {body: files.model.body(body).name for body in range(files.model.nbody)}
    found = {frozenset((names[int(sign) >> 16], names[int(sign) & 0xFFFF])) for sign in files.model.exclude_signature}
    sets = [{frozenset(pair) for pair in pairs} for pairs in files.robot["self_collision_ignore"].values()]
    wanted = set.intersection(*sets) if sets else set()
    wanted |= {frozenset((files.links[k], files.links[k + 1])) for k in range(len(files.joints))}
    for pair in sorted(wanted - found, key=named):
        yield f"the MJCF does not exclude contacts of {named(pair)}, other than robot.json"
    for pair in sorted(found - wanted, key=named):
        if truth.get(pair) == "sometimes":
            yield f"the MJCF excludes contacts of {named(pair)}, which can be free and can touch"


def pose_faults(files: RobotFiles) -> Iterator[str]:
    """`home` and `tucked` are free of self-collision for all sphere sets and in MuJoCo."""
    arm = files.arm
    solid = files.solid
    for key in ("home", "tucked"):
        q = np.array(files.robot[key], dtype=float)[None]
        for name, covers in arm.covers.items():
            left_out = {frozenset(pair) for pair in files.robot["self_collision_ignore"][name]}
            pairs = [p for p in combinations(solid, 2) if frozenset(arm.links[k] for k in p) not in left_out]
            if name != "exact" and self_clearance(arm, covers, pairs, q)[0] <= 0:
                yield f"pose '{key}' is in self-collision for sphere set {name}"
        data = mujoco.MjData(files.model)
        data.qpos[:] = q[0]
        mujoco.mj_forward(files.model, data)
        if data.ncon:
            yield f"pose '{key}' is in self-collision in MuJoCo"


def _without_excludes(files: RobotFiles) -> str:
    """The MJCF that excludes contacts of neighbours only; its geoms are the hulls where these stand for meshes."""
    with without_log():
        spec = mujoco.MjSpec.from_string(files.texts[f"{files.name}.xml"])
    neighbours = {frozenset((files.links[k], files.links[k + 1])) for k in range(len(files.joints))}
    neighbours |= {frozenset((files.links[i], files.links[j])) for i, j in files.arm.neighbours()}
    for pair in list(spec.excludes):
        if frozenset((pair.bodyname1, pair.bodyname2)) not in neighbours:
            spec.delete(pair)
    if files.from_meshes:
        for geom in list(spec.geoms):
            spec.delete(geom)
        for link, pieces in zip(files.links, files.arm.pieces, strict=True):
            for k, piece in enumerate(pieces):
                spec.add_mesh(name=f"{link}/{k}", uservert=piece.vertices.ravel())
                spec.body(link).add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{link}/{k}")
    return spec.to_xml()
