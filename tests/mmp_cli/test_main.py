import importlib.metadata
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mmp_cli.main import COMMANDS, main
from mmp_env.files.plan_file import load_plan

TESTS = Path(__file__).parent.parent
MMP = [sys.executable, "-c", "from mmp_cli.main import main; raise SystemExit(main())"]


def test_the_help_names_every_command(mmp):
    ran = mmp("--help")
    assert ran.code == 0
    for command in COMMANDS:
        assert f"\n  {command} " in ran.out


def test_no_command_is_bad_usage_and_shows_the_help(mmp):
    ran = mmp()
    assert (ran.code, ran.out) == (2, "")
    assert "commands:" in ran.err


def test_the_version_is_that_of_the_distribution(mmp):
    assert mmp("--version").out == f"mmp-env {importlib.metadata.version('mmp-env')}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_its_options(command, capsys):
    with pytest.raises(SystemExit) as end:
        main([command, "--help"])
    assert end.value.code == 0
    assert f"usage: mmp {command}" in capsys.readouterr().out


def test_the_help_loads_no_package_but_its_own():
    code = "import sys; from mmp_cli.main import main; main(['--help']); print(sorted(sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = run.stdout.splitlines()[-1]
    for heavy in ("numpy", "mujoco", "gymnasium", "rich"):
        assert f"'{heavy}'" not in modules


@pytest.mark.parametrize(
    ("argv", "code"), [(["--version"], 0), (["plan", "MultiArmCel-8"], 2), (["check", "none.json"], 2), ([], 2)]
)
def test_the_process_ends_with_the_code_and_no_traceback(argv, code):
    run = subprocess.run([*MMP, *argv], capture_output=True, text=True, check=False)
    assert run.returncode == code
    assert "Traceback" not in run.stderr


def test_a_reader_that_closes_the_pipe_is_no_error():
    run = subprocess.run(
        ["bash", "-c", '"$0" -c "$1" list | head -n 1', sys.executable, MMP[2]],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.stdout.startswith("robots")
    assert run.stderr == ""


@pytest.mark.parametrize("argv", [["--version"], ["list"]])
def test_output_that_finds_no_room_is_one_sentence_and_no_verdict(argv):
    with Path("/dev/full").open("w") as full:
        run = subprocess.run([*MMP, *argv], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr == "mmp: the output cannot be written: No space left on device\n"


def test_ctrl_c_ends_the_process_with_130_and_a_whole_plan(instances, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(TESTS)!r})\n"
        "from support import stand_in_planners\n"
        "from mmp_cli.main import main\n"
        "stand_in_planners.install()\n"
        "raise SystemExit(main())"
    )
    out = tmp_path / "plan.json"
    words = ["plan", str(instances), "--planner", "waiting", "--out", str(out)]
    with subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr.readline() == "waiting\n"
        process.send_signal(signal.SIGINT)
        process.stderr.read()
    assert process.returncode == 130
    assert len(load_plan(out).times) == 5
