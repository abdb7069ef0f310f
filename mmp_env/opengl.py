"""Pictures without a display: chooses an OpenGL library, and says what to install if there is none."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import sys
import warnings
from collections.abc import Iterable, Iterator
from ctypes.util import find_library
from typing import Any

from mmp_env.errors import MmpError, UnknownNameError

MAX_PIXELS = 4096
"""Largest width and height of a picture."""
_LIBRARIES = {"egl": ("EGL", "GL"), "osmesa": ("OSMesa",)}
_PACKAGES = {"egl": "libegl1 libgl1", "osmesa": "libosmesa6"}
_WINDOWED = ("glfw", "glx", "on", "true", "1", "enable", "enabled")
_DISABLED = ("off", "false", "0", "disable", "disabled")


@contextlib.contextmanager
def silent_children() -> Iterator[None]:
    """Delays Ctrl-C, and hides it from processes that start meanwhile, so that none prints a traceback of its own.

    glfw starts such processes at its import to look for its library.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def asked_for() -> str:
    """Returns the backend that `MUJOCO_GL` names, or an empty text.

    Raises `MmpError` with the package to install if its library is missing, or with the known values.
    """
    name = os.environ.get("MUJOCO_GL", "").strip().lower()
    if sys.platform.startswith("linux") and name not in ("", *_LIBRARIES, *_WINDOWED, *_DISABLED):
        raise UnknownNameError("value of MUJOCO_GL", name, [*_LIBRARIES, "glfw", "disable"])
    if (library := missing_library(name)) is not None:
        raise MmpError(f"MUJOCO_GL is {name}, but {library} is missing; `apt install {_PACKAGES[name]}` installs it")
    return name


def missing_library(backend: str) -> str | None:
    """Returns the missing library of a backend, `egl` or `osmesa`; None if all are there."""
    return next((f"lib{name}" for name in _LIBRARIES.get(backend, ()) if not found(name)), None)


@functools.cache
def found(library: str) -> bool:
    return find_library(library) is not None


def has_display() -> bool:
    """Returns whether a window can be opened."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def display_answers() -> bool:
    """Returns whether a window system answers. Without one, MuJoCo's viewer would end the program."""
    if not sys.platform.startswith("linux"):
        return True
    with silent_children():
        import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # Not terminated: MuJoCo's viewer initialises glfw too, and termination would close its windows.
        return bool(glfw.init())


def check_render_mode(mode: str | None) -> None:
    """Raises `MmpError` if this mode, `human` or `rgb_array`, is impossible here."""
    if mode == "human" and not has_display():
        raise MmpError("render_mode 'human' needs a display, and DISPLAY is not set; use 'rgb_array' instead")
    if mode == "rgb_array":
        offscreen_backend()


def possible_render_modes(modes: Iterable[str]) -> list[str]:
    """Returns the render modes that are possible here."""
    out = []
    for mode in modes:
        with contextlib.suppress(MmpError):
            check_render_mode(mode)
            out.append(mode)
    return out


def offscreen_backend() -> str:
    """Returns `egl`, `osmesa` or `window`: the backend that `MUJOCO_GL` names, or the first one available.

    Raises `MmpError` with the package to install, or with the values of `MUJOCO_GL`.
    """
    wanted = asked_for()
    if wanted in _DISABLED:
        raise MmpError(f"MUJOCO_GL is {wanted}, which forbids pictures; unset it, or set it to egl or osmesa")
    if not sys.platform.startswith("linux") or wanted in _WINDOWED:
        return "window"
    if wanted:
        return wanted
    for name in _LIBRARIES:
        if missing_library(name) is None:
            return name
    if has_display():
        return "window"
    raise MmpError(
        "no picture can be made: neither EGL nor OSMesa is installed;"
        f" `apt install {_PACKAGES['egl']}` (or {_PACKAGES['osmesa']}) gets one"
    )


def open_context(width: int, height: int) -> Any:
    """Returns a MuJoCo OpenGL context for pictures of `width` x `height` pixels, not yet current. `free()` releases it.

    The backend is imported here, not by MuJoCo's own import. So the order of imports does not matter, and a library
    without a driver only stops programs that make pictures. Raises `MmpError`.
    """
    backend = offscreen_backend()
    try:
        with silent_children():
            if backend == "egl":
                from mujoco.egl import GLContext
            elif backend == "osmesa":
                from mujoco.osmesa import GLContext
            else:
                from mujoco.gl_context import GLContext
        return GLContext(width, height)
    except Exception as error:  # PyOpenGL and glfw raise various errors without a driver or display
        packages = " or ".join(f"`apt install {names}`" for names in _PACKAGES.values())
        raise MmpError(
            f"no picture can be made: {backend} gives no OpenGL context ({error}); {packages} may help,"
            " and MUJOCO_GL=egl or osmesa chooses between them"
        ) from error
