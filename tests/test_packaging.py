"""The wheel as installed, the source distribution, the variants of the core, and the two commands."""

import importlib.metadata
import os
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest

import mmp_env.version
from mmp_env import core
from mmp_env.errors import MmpError

ROOT = Path(__file__).parents[1]
PACKAGES = ("mmp_env", "planners/mmp_planners", "tasks/mmp_tasks", "scripts/mmp_cli")
NOT_SHIPPED = {".so", ".pyc"}


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def installed() -> set[str]:
    return {str(path) for path in importlib.metadata.files("mmp-env") or ()}


def files_of(folder: str) -> list[Path]:
    return [path for path in (ROOT / folder).rglob("*") if path.is_file() and path.suffix not in NOT_SHIPPED]


@pytest.mark.parametrize("package", PACKAGES)
def test_the_wheel_holds_every_file_of_its_packages_as_it_is_in_the_checkout(package, installed):
    parent = (ROOT / package).parent
    for path in files_of(package):
        name = path.relative_to(parent).as_posix()
        assert name in installed
        assert Path(importlib.metadata.distribution("mmp-env").locate_file(name)).read_bytes() == path.read_bytes()


def test_the_wheel_holds_the_packages_and_nothing_else(installed):
    tops = {name.split("/")[0] for name in installed if not name.startswith("..")}
    assert {top for top in tops if not top.endswith(".dist-info")} == {Path(package).name for package in PACKAGES}
    assert {"mmp_env/py.typed", "mmp_env/_core.pyi", "mmp_env/robots/ur5e/ur5e.xml"} <= installed


def test_the_installed_distribution_says_what_pyproject_says(project):
    data = importlib.metadata.metadata("mmp-env")
    assert data["Version"] == project["version"]
    assert data["License-Expression"] == "Apache-2.0"
    assert data["Requires-Python"] == ">=3.11"
    assert set(data.get_all("Provides-Extra")) == {"dm", "rerun", "film", "ray", "learning", "robots", "docs", "dev"}


def test_the_version_is_that_of_the_project(project):
    assert mmp_env.__version__ == project["version"] == importlib.metadata.version("mmp-env")


@pytest.mark.parametrize(
    ("pyproject", "version"),
    [
        ('[project]\nname = "mmp-env"\nversion = "9.8.7"', "9.8.7"),
        ('[project]\nname = "thesis"\nversion = "9.8.7"', importlib.metadata.version("mmp-env")),
        ("[tool.ruff]", importlib.metadata.version("mmp-env")),
        (None, importlib.metadata.version("mmp-env")),
    ],
)
def test_a_checkout_says_its_own_version_whatever_is_installed(tmp_path, pyproject, version):
    (tmp_path / "mmp_env").mkdir()
    module = shutil.copy(mmp_env.version.__file__, tmp_path / "mmp_env")
    if pyproject is not None:
        (tmp_path / "pyproject.toml").write_text(pyproject)
    assert runpy.run_path(module)["__version__"] == version


def test_the_source_distribution_holds_all_that_a_build_needs_and_nothing_built(tmp_path, monkeypatch):
    from scikit_build_core.build import build_sdist

    built = [".git", ".venv", "build", "dist", "__pycache__", "*.so", ".*_cache", ".hypothesis"]
    checkout = Path(shutil.copytree(ROOT, tmp_path / "checkout", ignore=shutil.ignore_patterns(*built)))
    for leftover in (".venv/bin/python", "build/x.o", "dist/x.whl", "mmp_env/_core_v1.so", "mmp_env/__pycache__/a.pyc"):
        (checkout / leftover).parent.mkdir(parents=True, exist_ok=True)
        (checkout / leftover).touch()
    monkeypatch.chdir(checkout)
    name = build_sdist(str(tmp_path))
    with tarfile.open(tmp_path / name) as archive:
        held = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    needed = {path.relative_to(ROOT).as_posix() for folder in (*PACKAGES, "native") for path in files_of(folder)}
    assert needed | {"pyproject.toml", "LICENSE", "README.md", "CHANGELOG.md", "scripts/demo.sh"} <= held
    assert {Path(path).suffix for path in held}.isdisjoint(NOT_SHIPPED)
    assert {path.split("/")[0] for path in held}.isdisjoint({".venv", "build", "dist", ".git"})


def test_the_console_script_works_far_from_the_checkout(tmp_path):
    mmp = Path(sys.executable).with_name("mmp")
    done = subprocess.run([mmp, "list"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "apf-ecbs" in done.stdout


def test_the_best_variant_is_taken_unless_another_is_asked_for(monkeypatch):
    monkeypatch.delenv("MMP_CORE", raising=False)
    assert core.preferred_variant() == core.usable_variants()[-1]
    for name in core.usable_variants():
        monkeypatch.setenv("MMP_CORE", name)
        assert core.preferred_variant() == name
        assert core.load_variant(name).__name__ == f"mmp_env._core_{name}"


def test_a_variant_that_does_not_run_here_is_refused_with_those_that_do(monkeypatch):
    monkeypatch.setattr(core, "usable_variants", lambda: ["v1", "v3"])
    monkeypatch.setenv("MMP_CORE", "v4")
    with pytest.raises(MmpError, match=r"v4 does not run on this processor.*usable: v1, v3"):
        core.preferred_variant()
    monkeypatch.setenv("MMP_CORE", "avx2")
    with pytest.raises(MmpError, match=r"unknown MMP_CORE 'avx2'.*Known: v1, v3"):
        core.preferred_variant()


def test_the_core_has_the_names_of_the_variant():
    variant = core.load_variant(core.preferred_variant())
    public = {name: value for name, value in vars(variant).items() if not name.startswith("_")}
    assert public
    assert all(getattr(core, name) is value for name, value in public.items())


def shell(command: str, path: Path | str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs `command` after scripts/environment.sh on a machine whose PATH is `path` alone."""
    script = f"source '{ROOT}/scripts/environment.sh'; {command}"
    return subprocess.run(
        ["/bin/bash", "-c", script, "demo.sh"],
        env={"PATH": str(path), "HOME": str(path), **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def bare_path(tmp_path) -> Path:
    """Returns a folder for PATH with the few system tools that the script starts with."""
    for tool in ("basename", "dirname", "realpath", "id"):
        found = next(Path(folder, tool) for folder in os.defpath.split(":") if Path(folder, tool).exists())
        (tmp_path / tool).symlink_to(found)
    return tmp_path


def test_packages_of_one_script_stay_recorded_when_another_asks_for_others(tmp_path):
    (tmp_path / ".mmp-requirements").write_text("ray>=2.40\nforgotten==1\n")
    command = f"python={sys.executable}; venv={tmp_path}; record_requirements film"
    done = shell(command, os.defpath)
    assert done.returncode == 0, done.stderr
    kept = (tmp_path / ".mmp-requirements").read_text().splitlines()
    assert {"ray>=2.40", "imageio-ffmpeg>=0.5", "numpy>=1.26"} <= set(kept)
    assert "forgotten==1" not in kept


def test_all_that_a_machine_lacks_is_named_with_one_command(bare_path):
    done = shell("find_tools", bare_path)
    assert done.returncode == 1
    assert "lacks Python 3.11 or newer, a C++ compiler" in done.stderr
    assert "apt-get install -y python3 python3-dev python3-venv g++\n" in done.stderr


def test_a_machine_with_python_alone_gets_a_message_about_headers_installer_and_compiler(bare_path):
    python = bare_path / "python3"
    # Stands in for Debian's python3: runs, but has no headers, no ensurepip and no pip.
    python.write_text(
        '#!/bin/sh\ncase "$2" in *version_info*) exit 0 ;; *sysconfig*) echo /nowhere ;; *) exit 1 ;; esac\n'
    )
    python.chmod(0o755)
    done = shell("find_tools", bare_path)
    assert done.returncode == 1
    assert "(Python.h), an installer of Python packages (uv, venv or pip), a C++ compiler" in done.stderr
    assert "apt-get install -y python3-dev python3-venv g++\n" in done.stderr


def test_a_python_that_is_asked_for_and_does_not_run_is_not_replaced_by_another(bare_path):
    (bare_path / "python3").symlink_to(sys.executable)
    done = shell("find_tools", bare_path, PYTHON="/nowhere/python3")
    assert done.returncode == 1
    assert "Python 3.11 or newer at /nowhere/python3" in done.stderr


def test_a_folder_that_is_no_environment_is_not_deleted(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    done = shell("log=/dev/null; make_venv venv", Path("/usr/bin"), MMP_VENV=str(tmp_path / "mine"))
    assert done.returncode == 1
    assert "is no virtual environment" in done.stderr
    assert (tmp_path / "mine" / "thesis.txt").exists()
