"""Python that runs in a checkout, or on a script that lies there, uses the installed package; sources have no core."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from test_documents import README, blocks

import mmp_env
from mmp_env import core
from mmp_env.checkout import installed_package

ROOT = Path(__file__).parents[1]
INSTALLED = Path(mmp_env.__path__[0])
WHERE = "import mmp_env, mmp_env.model.cell; print(mmp_env.__path__[0], mmp_env.model.cell.__file__, sep='\\n')"


@pytest.fixture
def checkout(tmp_path) -> Path:
    """Returns a copy of the sources, as they are after a clone."""
    folder = tmp_path / "clone"
    for source in ("mmp_env", "planners", "tasks", "scripts"):
        shutil.copytree(ROOT / source, folder / source, ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    return folder


def python(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs Python with this folder as the current one, and every warning shown."""
    env = {key: value for key, value in os.environ.items() if key not in {"PYTHONSAFEPATH", "PYTHONWARNINGS"}}
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=env | environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("how", ["typed", "script", "module"])
def test_the_ten_lines_of_the_readme_run_in_a_checkout(checkout, how):
    (program,) = blocks(README, "python")
    (checkout / "ten_lines.py").write_text(program, encoding="utf-8")
    words = {"typed": ["-c", program], "script": ["ten_lines.py"], "module": ["-m", "ten_lines"]}[how]
    done = python(checkout, *words)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "solved True []\n"
    assert done.stderr == ""


def test_the_ten_lines_of_the_readme_run_as_a_script_of_the_checkout_from_elsewhere(checkout, tmp_path):
    (program,) = blocks(README, "python")
    (checkout / "ten_lines.py").write_text(program, encoding="utf-8")
    done = python(tmp_path, str(checkout / "ten_lines.py"))
    assert (done.returncode, done.stdout, done.stderr) == (0, "solved True []\n", "")


def test_all_modules_are_those_of_the_installed_package(checkout):
    done = python(checkout, "-c", WHERE)
    assert done.stdout.splitlines() == [str(INSTALLED), str(INSTALLED / "model" / "cell.py")]
    assert done.stderr == ""


@pytest.mark.parametrize(
    "source", ["mmp_env/model/cell.py", "planners/mmp_planners/auto.py", "mmp_env/robots/ur5e/robot.json"]
)
def test_sources_that_differ_from_the_installed_ones_are_a_sentence(checkout, source):
    with (checkout / source).open("a", encoding="utf-8") as file:
        file.write("\n")
    done = python(checkout, "-c", WHERE)
    assert done.returncode == 0
    assert done.stdout.splitlines()[0] == str(INSTALLED)
    (sentence,) = [line for line in done.stderr.splitlines() if "Warning" in line]
    assert f"mmp_env is imported from {INSTALLED.parent}" in sentence
    assert f"the sources in {checkout} differ" in sentence
    assert "scripts/demo.sh" in sentence


def test_a_checkout_with_its_own_core_is_used_itself(checkout):
    for variant in INSTALLED.glob("_core_v*.so"):
        (checkout / "mmp_env" / variant.name).symlink_to(variant)
    with (checkout / "mmp_env" / "model" / "cell.py").open("a", encoding="utf-8") as file:
        file.write("\n")
    done = python(checkout, "-c", WHERE)
    assert done.stdout.splitlines() == [str(checkout / "mmp_env"), str(checkout / "mmp_env" / "model" / "cell.py")]
    assert done.stderr == ""


def test_without_an_installed_package_the_sources_stay_and_say_how_a_core_is_built(checkout, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(checkout)])
    assert installed_package([str(checkout / "mmp_env")]) is None
    monkeypatch.setattr(core, "_built", lambda _: False)
    with pytest.raises(ImportError, match=r"the native core is not built: run .*scripts/build_core\.sh"):
        core.usable_variants()
