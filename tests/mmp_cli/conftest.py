import json
import shutil
from pathlib import Path

import pytest
from support import bad_files, bench_runs, stand_in_planners

from mmp_cli.main import main
from mmp_env import plugins
from mmp_planners import registry


class Ran:
    """The result of a command line: exit code, stdout and stderr."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    @property
    def result(self):
        """The JSON object in the last line of stdout."""
        return json.loads(self.out.splitlines()[-1])


@pytest.fixture
def mmp(capsys):
    """Runs a command line in this process."""

    def run(*argv):
        capsys.readouterr()
        code = main([str(word) for word in argv])
        return Ran(code, *capsys.readouterr())

    return run


@pytest.fixture
def figures_unrendered(monkeypatch):
    """Replaces the rendering of figures, the slowest part of a report. The figures are still composed."""
    from matplotlib.figure import Figure

    def savefig(self, file, *, format, **_):
        file.write("<svg></svg>" if format == "svg" else b"")

    monkeypatch.setattr(Figure, "savefig", savefig)
    monkeypatch.setattr(Figure, "draw_without_rendering", lambda self: None)


@pytest.fixture
def stand_ins(monkeypatch):
    """Registers the planners of `stand_in_planners` as if they belonged to this package."""
    monkeypatch.setattr(registry, "is_foreign", lambda name: False)
    monkeypatch.setattr(plugins, "entry_points", plugins.entry_points)
    monkeypatch.setattr(stand_in_planners.Straight, "calls", [])
    stand_in_planners.install()
    return stand_in_planners


def written(path, data):
    """Returns the path, with the data there as JSON."""
    path.write_text(json.dumps(data))
    return path


@pytest.fixture
def instances(tmp_path):
    """Returns the path of a good instance file."""
    return written(tmp_path / "pairs.json", bad_files.good_instances())


@pytest.fixture
def cell(tmp_path):
    """Returns the path of a good cell file."""
    return written(tmp_path / "pair.json", bad_files.good_cell())


@pytest.fixture
def plan(tmp_path):
    """Returns the path of a good plan file."""
    return written(tmp_path / "plan.json", bad_files.good_plan())


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """Returns the folder of a complete benchmark, its source and its arguments."""
    path = tmp_path_factory.mktemp("complete")
    source = bench_runs.many_instances(path, 3)
    words = [source, "--planners", "quick,other=quick", "--set", "w=2", "--set", "other.steps=5", "--seed", 4]
    assert bench_runs.bench(path, *words, "--out", path / "out").code == 0
    return path / "out", source, words


@pytest.fixture
def copied(complete, tmp_path):
    """Returns a copy of it, and a function that starts it with other words."""
    folder, source, words = complete
    out = Path(shutil.copytree(folder, tmp_path / "out"))

    def again(*more):
        kept = [
            word
            for pair in zip(words[1::2], words[2::2], strict=True)
            for word in pair
            if pair[0] == "--set" or pair[0] not in more
        ]
        return bench_runs.bench(tmp_path, words[0], *kept, *more, "--out", out)

    return out, source, again
