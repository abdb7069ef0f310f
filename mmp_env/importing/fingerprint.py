"""Fingerprints of a robot folder's files, by which a change after the import is noticed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

KEY = "fingerprints"


def fingerprints(robot: Mapping[str, Any], texts: Mapping[str, str]) -> dict[str, str]:
    """Returns a hash of the content of robot.json, without fingerprints, and of each other file."""
    content = json.dumps({key: value for key, value in robot.items() if key != KEY}, sort_keys=True)
    out = {name: _hash(text) for name, text in sorted(texts.items())}
    return {"robot.json": _hash(json.dumps(json.loads(content), sort_keys=True)), **out}


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
