"""Faults of self-collision pairs: pairs left out without a reason that holds, and poses in self-collision."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from mmp_env.importing.checked_files import RobotFiles, named
from mmp_env.importing.self_pairs import always_overlap, contact_counts, self_clearance
from mmp_env.mujoco_import import mujoco

_SELF_SAMPLES, _SPHERE_SAMPLES = 10_000, 2000
_REASONS = ("adjacent", "always", "never")


def pair_faults(files: RobotFiles) -> Iterator[str]:
    """Pairs that are left out have a reason that holds; all others can touch and can be free."""
    arm, robot = files.arm, files.robot
    reasons = {
        (frozenset((pair["a"], pair["b"])), pair.get("sphere_set")): pair["reason"]
        for pair in robot.get("self_pairs_ignored", [])
    }
    q = arm.draw(_SELF_SAMPLES, 0)
    overlaps, near = contact_counts(arm, _without_excludes(files), q)
    adjacent = {frozenset((arm.links[i], arm.links[j])) for i, j in arm.neighbours()}
    solid = files.solid
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
            yield f"the ignored pair {named(pair)} has reason '{reason}', or a link that does not exist"
        elif key is None and truth.get(pair) != reason:
            yield f"{named(pair)} is ignored as '{reason}', and is '{truth.get(pair, 'without geometry')}'"
    for name, pairs in robot["self_collision_ignore"].items():
        left_out = {frozenset(pair) for pair in pairs}
        expected = {pair for pair, key in reasons if key in (None, name)}
        for pair in left_out - expected if reasons else ():
            yield f"set {name} ignores {named(pair)} without a reason"
        for pair in expected - left_out:
            yield f"set {name} does not ignore {named(pair)}, which has the reason '{reasons.get((pair, None))}'"
        for pair, kind in truth.items():
            i, j = sorted(arm.links.index(link) for link in pair)
            covers = arm.covers.get(name)
            in_spheres = covers is not None and always_overlap(poses[i], covers[i], poses[j], covers[j])
            if pair not in left_out and (kind in ("adjacent", "always") or in_spheres):
                yield f"set {name} tests {named(pair)}, which always overlap"
            if pair in left_out and kind == "sometimes" and not in_spheres:
                yield f"set {name} ignores {named(pair)}, which can be free and can touch"


def pose_faults(files: RobotFiles) -> Iterator[str]:
    """`home` and `tucked` are free of self-collision for all sphere sets and in MuJoCo."""
    arm = files.arm
    solid = files.solid
    for key in ("home", "tucked"):
        q = np.array(files.robot[key], dtype=float)[None]
        for name, covers in arm.covers.items():
            left_out = {frozenset(pair) for pair in files.robot["self_collision_ignore"][name]}
            pairs = [p for p in combinations(solid, 2) if frozenset(arm.links[k] for k in p) not in left_out]
            if self_clearance(arm, covers, pairs, q)[0] <= 0:
                yield f"pose '{key}' is in self-collision for sphere set {name}"
        data = mujoco.MjData(files.model)
        data.qpos[:] = q[0]
        mujoco.mj_forward(files.model, data)
        if data.ncon:
            yield f"pose '{key}' is in self-collision in MuJoCo"


def _without_excludes(files: RobotFiles) -> str:
    spec = mujoco.MjSpec.from_string(files.texts[f"{files.name}.xml"])
    neighbours = {frozenset((files.links[k], files.links[k + 1])) for k in range(len(files.joints))}
    neighbours |= {frozenset((files.links[i], files.links[j])) for i, j in files.arm.neighbours()}
    for pair in list(spec.excludes):
        if frozenset((pair.bodyname1, pair.bodyname2)) not in neighbours:
            spec.delete(pair)
    return spec.to_xml()
