"""Nonsense in the files of a robot or of a tool, by docs/reference/robots.md. It shares no code with the readers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fuzz.json_values import is_direction, is_number, is_positive, is_vector, items, missing, objects, wrong

MOST_JOINTS, MOST_SPHERES, MOST_HULLS, MOST_VERTICES = 64, 20_000, 5_000, 200_000
SPHERE_SETS = ("28", "fine", "exact")


def robot_nonsense(robot: Any) -> Iterator[str]:
    """Yields what is wrong with `robot.json`."""
    if not isinstance(robot, dict):
        yield "a robot that is no object"
        return
    joints, links = robot.get("joints"), robot.get("links")
    if not isinstance(joints, list) or not 1 <= len(joints) <= MOST_JOINTS or len(objects(joints)) < len(joints):
        yield f"joints {str(joints)[:60]}"
        return
    for joint in objects(joints):
        yield from _joint_nonsense(joint)
    if not isinstance(links, list) or len(links) != len(joints) + 1 or len(set(map(str, links))) < len(links):
        yield f"links {str(links)[:60]}"
    for key in ("home", "tucked"):
        if not is_vector(robot.get(key), len(joints)) or not _are_within(robot[key], objects(joints)):
            yield f"{key} {str(robot.get(key))[:60]}"
    yield from _origin_nonsense(robot.get("flange"), "flange")


def tool_nonsense(tool: Any) -> Iterator[str]:
    """Yields what is wrong with `tool.json`."""
    if not isinstance(tool, dict):
        yield "a tool that is no object"
        return
    yield from _origin_nonsense(tool.get("mount"), "mount")
    if not is_vector(tool.get("point"), 3):
        yield f"point {str(tool.get('point'))[:60]}"
    yield from wrong(tool, "opening", is_number(tool.get("opening"), 0.0))


def spheres_nonsense(sets: Any, *, are_by_link: bool | None = None) -> Iterator[str]:
    """Yields what is wrong with `spheres.json`: rows of a position and a radius, by link for a robot."""
    if not isinstance(sets, dict):
        yield "sets of spheres that are no object"
        return
    for name, rows in sets.items():
        if are_by_link is not None and not isinstance(rows, dict if are_by_link else list):
            yield f"the set {name} {str(rows)[:60]}"
            continue
        lists = items(rows) if isinstance(rows, dict) else [rows]
        spheres = [row for each in lists for row in (each if isinstance(each, list) else [each])]
        if len(spheres) > MOST_SPHERES:
            yield f"{len(spheres)} spheres"
        yield from (f"sphere {str(row)[:60]}" for row in spheres if not is_vector(row, 4) or row[3] <= 0)


def hulls_nonsense(hulls: Any) -> Iterator[str]:
    """Yields what is wrong with `hulls.json`."""
    if not isinstance(hulls, dict):
        yield "hulls that are no object"
        return
    pieces = [
        piece
        for name, each in hulls.items()
        if name != "origin"
        for piece in (each if isinstance(each, list) else [each])
    ]
    if len(pieces) > MOST_HULLS:
        yield f"{len(pieces)} hulls"
    for piece in pieces:
        vertices = piece.get("vertices") if isinstance(piece, dict) else None
        if not isinstance(vertices, list) or not vertices or not all(is_vector(vertex, 3) for vertex in vertices):
            yield f"a hull {str(piece)[:60]}"
        elif not is_number(piece.get("radius"), 0.0):
            yield f"the radius {piece.get('radius')} of a hull"


def _joint_nonsense(joint: dict[str, Any]) -> Iterator[str]:
    yield from missing(joint, "name", "axis", "lower", "upper", "velocity")
    if joint.get("type", "hinge") not in ("hinge", "slide"):
        yield f"a joint of type {joint['type']}"
    yield from _origin_nonsense(joint.get("origin"), "origin")
    if not is_direction(joint.get("axis")):
        yield f"axis {str(joint.get('axis'))[:60]}"
    lower, upper = joint.get("lower"), joint.get("upper")
    if not is_number(lower) or not is_number(upper) or lower > upper:
        yield f"limits {lower}, {upper}"
    for key in ("velocity", "acceleration", "jerk"):
        yield from wrong(joint, key, is_positive(joint.get(key)))
    yield from wrong(joint, "effort", is_number(joint.get("effort"), 0.0))


def _are_within(values: list[float], joints: list[dict[str, Any]]) -> bool:
    """Returns whether values are within the limits of their joints, where these are numbers."""
    limits = [(joint.get("lower"), joint.get("upper")) for joint in joints]
    return all(
        low <= value <= high
        for value, (low, high) in zip(values, limits, strict=True)
        if is_number(low) and is_number(high)
    )


def _origin_nonsense(origin: Any, what: str) -> Iterator[str]:
    if not isinstance(origin, dict) or not all(is_vector(origin.get(key), 3) for key in ("xyz", "rpy")):
        yield f"{what} {str(origin)[:60]}"
