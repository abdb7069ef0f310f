"""A compiled model from which arms are taken, with the facts that MuJoCo does not keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceModel:
    """A compiled model. `path` is the file it was read from, or a name for messages where there is no file.

    `velocity` maps joints to velocity limits [rad/s or m/s] where the source has any; `mimics` maps joints to the joint
    that they copy. `digest` is a hash of all files that were read. `notes` are sentences on what was changed.
    """

    path: Path
    title: str
    model: Any
    velocity: Mapping[str, float] = field(default_factory=dict)
    mimics: Mapping[str, str] = field(default_factory=dict)
    digest: str = ""
    notes: tuple[str, ...] = ()
