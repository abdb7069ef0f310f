"""The fault kit tells crashes of the program from those of libraries that do not survive too little memory."""

import signal

from faults.crashes import STACK, crashed_elsewhere
from faults.kit import Kit
from faults.planted import made_run, python

CRASH_IN = (
    'Fatal Python error: Segmentation fault\n\nCurrent thread 0x1 (most recent call first):\n  File "{}", line 1\n'
)
HANDLER = """/faults/failing_calls.so(+0x1)[0x1]
/usr/lib/libc.so.6(+0x3)[0x3]
/usr/lib/libpython3.11.so.1.0(+0x2)[0x2]
/usr/lib/libc.so.6(+0x3)[0x3]
"""
"""Native frames of a handler of signals, which are before those of the crash."""
NO_MEMORY = "/usr/lib/libpython3.11.so.1.0(_PyErr_NoMemory+0x1a)[0x4]\n"


def test_only_crashes_of_other_libraries_without_memory_are_waived(tmp_path):
    native = CRASH_IN.format("/site/mmp_env/x.py") + f"{STACK}\n{HANDLER}"
    python = "/usr/bin/python3.11(PyObject_Call+0x1)[0x4]\n"
    crash = {
        "/usr/lib/libgallium-22.so(+0x1)[0x1]\n/site/mujoco/libmujoco.so.3(mjr_makeContext+0x5)[0x5]\n" + python: True,
        "/site/scipy/spatial/_qhull.cpython-311-x86_64-linux-gnu.so(+0x1)[0x1]\n" + python: True,
        "/site/mmp_env/_core_v3.so(+0x1)[0x1]\n/usr/lib/libGL.so.1(+0x1)[0x1]\n" + python: False,
        "/site/mujoco/libmujoco.so.3(mj_step+0x5)[0x5]\n" + python: False,
        "/site/numpy/_core.so(+0x1)[0x1]\n" + python + "/usr/lib/libgallium-22.so(+0x1)[0x1]\n": False,
        NO_MEMORY + "/site/numpy/_core/_multiarray_umath.so(+0x1)[0x1]\n" + python: True,
        NO_MEMORY + "/site/mmp_env/_core_v3.so(+0x1)[0x1]\n" + python: False,
        python + "/site/numpy/_core/_multiarray_umath.so(+0x1)[0x1]\n" + python: False,
        "/site/numpy/_core/_multiarray_umath.so(+0x1)[0x1]\n" + NO_MEMORY: False,
    }
    for frames, waived in crash.items():
        assert crashed_elsewhere(made_run(tmp_path, code=-signal.SIGSEGV, err=native + frames)) == waived, frames
    drawing = tmp_path / "drawing.py"
    drawing.write_text("    mujoco.mjr_render(rectangle, scene, context)\n")
    files = {"/site/mujoco/egl/__init__.py": True, "/site/mmp_env/view/films.py": False, str(drawing): True}
    for file, waived in files.items():
        other = CRASH_IN.format("/site/mujoco/egl/__init__.py").replace("Current thread", "Thread")
        err = f"{other}\n{CRASH_IN.format(file)}"
        assert crashed_elsewhere(made_run(tmp_path, code=-signal.SIGABRT, err=err)) == waived, file


def test_a_crash_has_its_native_stack(tmp_path):
    kit = Kit(tmp_path)
    with kit.folder() as (folder, before):
        command = python("import ctypes; ctypes.string_at(0)")
        run = kit.run(command, folder, before, "memory")
        assert run.code == -signal.SIGSEGV
        assert STACK in run.err
        assert "Current thread" in run.err
        assert "_ctypes" in run.err.partition(STACK)[2]
        assert not crashed_elsewhere(run)
