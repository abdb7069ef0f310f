"""The version of the package: of its sources in a checkout, of the installed distribution otherwise."""

from __future__ import annotations

import importlib.metadata
import tomllib
from pathlib import Path

_NAME = "mmp-env"


def _version() -> str:
    """Returns the version of the checkout's pyproject.toml, or of the installed distribution without a checkout."""
    file = Path(__file__).parents[1] / "pyproject.toml"
    project = tomllib.loads(file.read_text(encoding="utf-8")).get("project", {}) if file.is_file() else {}
    return project["version"] if project.get("name") == _NAME else importlib.metadata.version(_NAME)


__version__ = _version()
