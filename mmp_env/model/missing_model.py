"""Says why there is no robot or tool of a name, or at a path."""

from __future__ import annotations

import os
from collections.abc import Sequence

from mmp_env.errors import HOW_TO_ADD, MmpError, UnknownNameError, misspelled
from mmp_env.robot_folders import is_path
from mmp_env.wording import shown


def no_such_model(kind: str, name: str, names: Sequence[str], description: str) -> MmpError:
    """Returns the error for a robot or tool of which there is no folder, by name or by path."""
    if not is_path(name):
        return UnknownNameError(kind, name, names, suggest=misspelled, advice=HOW_TO_ADD[kind])
    if os.path.isdir(name):
        return MmpError(f"{kind} {shown(name)} has no {description}; {HOW_TO_ADD[kind]}")
    if os.path.exists(name):
        return MmpError(f"{kind} {shown(name)} is a file; `mmp {kind} add` makes a folder of it")
    return MmpError(f"{kind} {shown(name)}: there is no such folder; {HOW_TO_ADD[kind]}")
