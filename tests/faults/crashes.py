"""Finds out where a process crashed: in the program, or in a library that does not survive too little memory."""

from __future__ import annotations

import linecache
import re
import signal

from faults.kit import Run

CRASHES = (-signal.SIGSEGV, -signal.SIGBUS, -signal.SIGABRT)
STACK = "native stack:"
"""Line before the native frames, the innermost one first. failing_memory.cpp prints them."""
_PYTHON = re.compile(r"/(lib)?python3[.\d]*(so[.\d]*)?\(")
_SETS_NO_MEMORY = re.compile(r"\(_?PyErr_NoMemory\+")
_NUMPY = re.compile(r"/_multiarray_umath\S*\(")
_OWN = re.compile(r"/mmp_env/_core_v\S*\(")
_ELSEWHERE = re.compile(r"/(libGL|libEGL|libOSMesa|libgallium|libLLVM|swrast|kms_swrast|\S*_dri|_qhull)\S*\(|\(mjr_")
_PYTHON_FRAME = re.compile(r'Current thread .*most recent call first\):\s+File "([^"]+)", line (\d+)')
_PYTHON_ELSEWHERE = re.compile(r"/(OpenGL|mujoco/(egl|osmesa|glfw|renderer|gl_context))\b")
_RENDERING = re.compile(r"\s*([\w.]+ = )?mujoco\.(mjr_\w+|MjrContext)\(.*\)")
"""A line that calls MuJoCo's rendering and nothing else. OpenGL compiles code that has no native frames."""


def crashed_elsewhere(run: Run) -> bool:
    """Returns True if OpenGL, the rendering of MuJoCo or Qhull crashed, or NumPy while it raised MemoryError.

    For some buffers NumPy raises it without Python's lock. The native stack up to Python decides, or the last frame of
    Python where there is none.
    """
    if run.code not in CRASHES:
        return False
    native = []
    called = ""
    for line in run.err.partition(STACK)[2].splitlines():
        if _PYTHON.search(line):
            if any(map(_is_code, native)):
                break
            native.clear()  # the frames of the handler of signals, which is a part of Python
            called = line
            continue
        native.append(line)
    if any(map(_is_code, native)):
        if _SETS_NO_MEMORY.search(called) and _NUMPY.search(native[0]):
            return True
        return any(map(_ELSEWHERE.search, native)) and not any(map(_OWN.search, native))
    last = _PYTHON_FRAME.search(run.err)
    if last is None:
        return False
    calls_rendering = _RENDERING.fullmatch(linecache.getline(last[1], int(last[2])).rstrip())
    return calls_rendering is not None or _PYTHON_ELSEWHERE.search(last[1]) is not None


def _is_code(frame: str) -> bool:
    """Returns True for a frame of neither Python, the C library, nor the library of failing calls."""
    beside = r"/(libc|ld-linux\S*|libpthread|libstdc\+\+|failing_calls)[-.]"
    return frame.startswith("/") and not _PYTHON.search(frame) and not re.search(beside, frame)
