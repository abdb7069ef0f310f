"""Processes that glfw starts during its import get no Ctrl-C."""

import os
import subprocess
import sys

import pytest

GLFW = """
import subprocess, sys
child = "import signal; signal.raise_signal(signal.SIGINT); print('not interrupted')"
subprocess.run([sys.executable, "-c", child])
init = bool
"""
"""Source of a stand-in for glfw, which starts a process that the terminal interrupts."""
IMPORTS = {
    "MuJoCo": "from mmp_env.mujoco_import import mujoco",
    "glfw": "from mmp_env.opengl import display_answers; assert not display_answers()",
}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="glfw is asked for on Linux")
@pytest.mark.parametrize("what", IMPORTS)
def test_a_child_of_an_import_says_nothing_at_ctrl_c(tmp_path, what):
    (tmp_path / "glfw.py").write_text(GLFW)
    program = (
        f"import signal, sys\nsys.path.insert(0, {str(tmp_path)!r})\n{IMPORTS[what]}\n"
        "assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])"
    )
    environment = {key: value for key, value in os.environ.items() if key != "MUJOCO_GL"}
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment)
    assert (ran.stdout, ran.stderr) == ("not interrupted\n", "")
