"""Writing the files of a report: all of them beside their place first, then each is moved there."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from mmp_env.errors import MmpError


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> None:
    """Writes name -> content into the folder, in this order. Raises `MmpError`, and then has left no half file."""
    try:
        # Inside the folder, so that moving stays on one file system.
        temporary = Path(tempfile.mkdtemp(prefix=".mmp-report-", dir=folder))
    except OSError as error:
        raise MmpError(f"{folder} cannot be written to: {error.strerror}") from None
    try:
        for name, content in files.items():
            data = content.encode("utf-8") if isinstance(content, str) else content
            (temporary / name).write_bytes(data)
        for name in files:
            os.replace(temporary / name, folder / name)
    except OSError as error:
        raise MmpError(f"the report cannot be written to {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
