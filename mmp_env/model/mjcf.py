"""Refuses MJCF that names files or asks MuJoCo for more than a robot or tool needs."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from mmp_env.errors import MmpError

LONGEST_BYTES = 16 * 2**20
_MOST_ELEMENTS = 20_000
"""Largest MJCF of a robot or tool, in bytes and in elements."""
_ELEMENTS = frozenset(
    (
        *(
            "mujoco",
            "compiler",
            "option",
            "flag",
            "statistic",
            "visual",
            "global",
            "headlight",
            "map",
            "quality",
            "rgba",
        ),
        *("scale", "default", "asset", "material", "mesh", "worldbody", "body", "frame", "inertial", "joint", "geom"),
        *("site", "camera", "light", "contact", "exclude", "pair", "actuator", "general", "motor", "position"),
        *("keyframe", "key"),
    )
)
"""Elements that are allowed. None of them reads a file or repeats its content unless an attribute says so."""
_REFUSED_ATTRIBUTES = re.compile(r"file|plugin|builtin|.*dir$")
_DECLARATION = re.compile(r"<!(?!--)")


def refuse_mjcf(text: str, where: str) -> None:
    """Raises `MmpError` for MJCF that is not XML, is too large, or has elements or attributes that are not allowed.

    Args:
        text: the MJCF.
        where: begin of the messages, such as the name of the file.
    """
    if len(text) > LONGEST_BYTES:
        raise MmpError(f"{where} has {len(text) / 2**20:.1f} MB; at most {LONGEST_BYTES // 2**20} MB are read")
    if _DECLARATION.search(text):
        raise MmpError(f"{where} has a declaration that begins with '<!'; MJCF of a robot or tool has none")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError, RecursionError) as error:
        raise MmpError(f"{where} is not XML: {error}") from None
    if root.tag != "mujoco":
        raise MmpError(f"{where} begins with the element '{root.tag}'; MJCF begins with 'mujoco'")
    for number, element in enumerate(root.iter()):
        if element.tag not in _ELEMENTS:
            raise MmpError(
                f"{where} has the element '{element.tag}'; a robot or tool has {', '.join(sorted(_ELEMENTS))}"
            )
        if named := [key for key in element.attrib if _REFUSED_ATTRIBUTES.match(key)]:
            raise MmpError(
                f"{where} has the attribute '{named[0]}' in an element '{element.tag}'; a robot or tool is complete in"
                " its MJCF and reads no other file"
            )
        if number >= _MOST_ELEMENTS:
            raise MmpError(f"{where} has more than {_MOST_ELEMENTS:,} elements, the most that are read")
