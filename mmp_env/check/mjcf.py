"""Refuses MJCF that would make MuJoCo read files, or asks for more than a robot or tool needs."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from mmp_env.check.fields import UnreadableError

_LONGEST = 16 * 2**20
"""Largest number of characters of an MJCF."""
_KNOWN = (
    *("mujoco", "compiler", "option", "flag", "statistic", "visual", "global", "headlight", "map", "quality"),
    *("rgba", "scale", "default", "asset", "material", "mesh", "worldbody", "body", "frame", "inertial"),
    *("joint", "geom", "site", "camera", "light", "contact", "exclude", "pair", "actuator", "general"),
    *("motor", "position", "keyframe", "key"),
)
_READS = ("file", "plugin", "builtin")
"""Begins of attributes that name a file, a plugin or a made-up mesh."""


def refuse_mjcf(text: str, where: str) -> None:
    """Raises `UnreadableError` for MJCF that is not XML or is not complete in itself."""
    if len(text) > _LONGEST or "<!" in text.replace("<!--", ""):
        raise UnreadableError(f"{where} is too large, or has a declaration '<!'")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError, RecursionError) as error:
        raise UnreadableError(f"{where} is not XML: {error}") from None
    for element in root.iter():
        if element.tag not in _KNOWN:
            raise UnreadableError(f"{where} has the element '{element.tag}', which this checker does not read")
        for key in element.attrib:
            if key.startswith(_READS) or key.endswith("dir"):
                raise UnreadableError(f"{where} has the attribute '{key}'; it must be complete in itself")
