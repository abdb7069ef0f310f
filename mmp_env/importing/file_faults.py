"""Faults of the numbers in a robot folder: changed files, limits, poses out of range."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mmp_env.importing.checked_files import RobotFiles
from mmp_env.importing.fingerprint import KEY, fingerprints

_ROUNDING = 1e-5


def fingerprint_faults(files: RobotFiles) -> Iterator[str]:
    """The files are those of the import."""
    told = files.robot.get(KEY)
    if told is None:
        return
    texts = {name: text for name, text in files.texts.items() if name != "robot.json"}
    found = fingerprints(files.robot, texts)
    for file in sorted(set(told) | set(found)):
        if told.get(file) != found.get(file):
            yield f"{file} was changed after the import"


def limit_faults(files: RobotFiles) -> Iterator[str]:
    """Limits are finite, ordered and positive; poses and drawn configurations lie within them."""
    for joint in files.joints:
        name = joint["name"]
        if not joint["lower"] < joint["upper"]:
            yield f"joint '{name}' has lower limit {joint['lower']} and upper limit {joint['upper']}"
        for key in ("velocity", "acceleration", "jerk", "effort"):
            if not 0 < joint[key] < np.inf:
                yield f"joint '{name}' has {key} {joint[key]}; it must be positive and finite"
        if abs(np.linalg.norm(joint["axis"]) - 1) > 1e-9:
            yield f"the axis of joint '{name}' has no unit length"
    for key in ("home", "tucked"):
        q = np.array(files.robot[key], dtype=float)
        if q.shape != (len(files.joints),) or not ((files.limits[:, 0] < q) & (q < files.limits[:, 1])).all():
            yield f"pose '{key}' is not within the limits of the joints"
    draw = np.array(files.robot.get("draw_limits", files.limits), dtype=float)
    if draw.shape != (len(files.joints), 2) or not (draw[:, 0] < draw[:, 1]).all():
        yield "draw_limits must hold a lower and a larger upper limit for each joint"
        return
    for joint, drawn in zip(files.joints, draw, strict=True):
        span = joint["upper"] - joint["lower"]
        wanted = span if joint.get("type") == "slide" else min(span, 2 * np.pi)
        inside = joint["lower"] - _ROUNDING <= drawn[0] and drawn[1] <= joint["upper"] + _ROUNDING
        if not inside or drawn[1] - drawn[0] < wanted - _ROUNDING:
            yield f"draw_limits of joint '{joint['name']}' must hold its whole range, or one turn within it"
