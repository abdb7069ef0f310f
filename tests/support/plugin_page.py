"""Builds and installs the plug-in that docs/how-to/add-a-planner.md shows."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "add-a-planner.md").read_text(encoding="utf-8")
_FILE = re.compile(r"^<!-- file: (\S+) -->\n```\w+\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_BUILD = "import sys; from flit_core.buildapi import build_wheel; print(build_wheel(sys.argv[1]))"
_MMP = "from mmp_cli.main import main; raise SystemExit(main())"


def files() -> dict[str, str]:
    """Returns name -> content of the files that the page shows."""
    return dict(_FILE.findall(PAGE))


def install(folder: Path) -> Path:
    """Builds the distribution of the page in `folder`, installs it into a new folder, and returns that.

    A wheel without compiled parts and scripts is installed by unpacking, without pip and network.
    """
    source, site = folder / "mmp-turns", folder / "site"
    source.mkdir()
    for name, text in files().items():
        (source / name).write_text(text, encoding="utf-8")
    built = subprocess.run(
        [sys.executable, "-c", _BUILD, str(folder)], cwd=source, capture_output=True, text=True, check=True
    )
    with zipfile.ZipFile(folder / built.stdout.split()[-1]) as wheel:
        wheel.extractall(site)
    return site


def register(site: Path, planners: dict[str, str]) -> None:
    """Writes entry points, planner -> module:object, of a distribution that is installed in `site`."""
    info = site / "mmp_broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mmp-broken\nVersion: 1.0\n")
    points = "".join(f"{name} = {value}\n" for name, value in planners.items())
    (info / "entry_points.txt").write_text(f"[mmp_env.planners]\n{points}")


def python(site: Path, code: str, *words: object) -> subprocess.CompletedProcess[str]:
    """Runs code in a process that finds the packages in `site`."""
    path = os.pathsep.join(filter(None, [str(site), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(
        command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False, timeout=300
    )


def mmp(site: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """Runs `mmp` in a process that finds the packages in `site`."""
    return python(site, _MMP, *words)
