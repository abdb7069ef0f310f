"""`mmp show FILE`: opens a recording, plan, episode, benchmark folder or picture, or makes pictures of a plan."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
import webbrowser
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mmp_cli.arguments import Parser
from mmp_cli.output import say
from mmp_cli.visual_outputs import SPAWN, add_visual_options, check_visual_outputs, save_image, save_video
from mmp_env.errors import MmpError
from mmp_env.files.file_kinds import EPISODE, PLAN, read_as
from mmp_env.files.paths import exists, is_folder, real_path, status
from mmp_env.wording import in_seconds

if TYPE_CHECKING:
    from mmp_env.files.episode_file import Episode
    from mmp_env.model.plan import Plan

_PAGES = (".svg", ".png", ".jpg", ".jpeg", ".webp", ".gif", ".mp4", ".html")
_MADE = ("rerun", "image", "video")
_PAUSE_S = 1.0


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser(
        "mmp show", "Opens a recording (.rrd), a plan, an episode, a benchmark folder, a page or a picture in a window."
    )
    out.add_argument("file", metavar="FILE", help="what to open")
    add_visual_options(out, *_MADE)
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for a file that cannot be opened, and if there is no display."""
    path, wanted = Path(args.file), [name for name in _MADE if getattr(args, name) is not None]
    if not exists(path):
        raise MmpError(f"{path} cannot be opened: there is no such file or folder")
    if wanted and (is_folder(path) or path.suffix.lower() in (".rrd", *_PAGES)):
        raise MmpError(f"--{wanted[0]} shows a plan, and {path} is none")
    if is_folder(path):
        _open_report(path)
    elif path.suffix.lower() == ".rrd":
        _open_recording(path)
    elif path.suffix.lower() in _PAGES:
        _open_page(path)
    else:
        _show_motion(args, path, makes_files=bool(wanted) or args.moments is not None or args.camera is not None)
    return 0


def _show_motion(args: Namespace, path: Path, *, makes_files: bool) -> None:
    """Plays a plan or an episode in a window, or makes files of it."""
    from mmp_env.files.episode_file import Episode, plans_from_dict

    if makes_files:
        check_visual_outputs(args)
    takes = "`mmp show` takes plans, episodes, recordings, benchmark folders, pages and pictures"
    read = plans_from_dict(read_as(path, (PLAN, EPISODE), takes), str(path))
    if not makes_files:
        _play(read.plans if isinstance(read, Episode) else (read,), path)
    elif isinstance(read, Episode):
        _film_episode(args, read, path)
    else:
        _make(args, read)


def _film_episode(args: Namespace, episode: Episode, path: Path) -> None:
    for name in ("rerun", "image"):
        if getattr(args, name) is not None:
            raise MmpError(f"--{name} shows one plan, and {path} is an episode; --video makes a film of it")
    from mmp_env.view.episode_film import save_episode_film

    save_episode_film(episode, args.video, camera=args.camera)
    say(args.video)


def _make(args: Namespace, plan: Plan) -> None:
    from mmp_env.model.plan_fit import check_fit

    check_fit(plan, plan.problem.cell)
    if args.rerun is not None:
        from mmp_env.view.rerun import RerunWatcher

        watcher = RerunWatcher(plan.problem, args.rerun)
        watcher.show_plan(plan)
        watcher.close()
    if args.image is not None:
        save_image(plan, args.image, args.moments, args.camera)
    if args.video is not None:
        save_video(plan, args.video, None, args.camera)
    for name in _MADE:
        if getattr(args, name) not in (None, SPAWN):
            say(getattr(args, name))


def _play(plans: Sequence[Plan], path: Path) -> None:
    """Executes the plans again and again in MuJoCo's viewer, until the window is closed.

    Each plan has a window of its own, because objects move into the tools and out of them.
    """
    instead = f"`mmp show {path} --image FILE.png` makes a picture of it, --video a film, --rerun a recording"
    if len(plans) > 1:
        instead = f"`mmp show {path} --video FILE.mp4` makes a film of it"
    _check_display(path, instead)
    duration = in_seconds(sum(plan.makespan_s for plan in plans), 1)
    sentence = f"playing {path}, {duration}; it ends when the window is closed"
    first = plans[0]
    while all(_played(plan, path, instead, sentence if plan is first else "", once=len(plans) > 1) for plan in plans):
        sentence = ""


def _played(plan: Plan, path: Path, instead: str, sentence: str, *, once: bool) -> bool:
    """Plays a plan in a window, `once` or until the window is closed. Returns whether it is still open then."""
    from mmp_env.sim.execution import execute_plan
    from mmp_env.sim.rendering import Window
    from mmp_env.sim.simulation import Simulation

    simulation = Simulation(plan.problem.cell)
    start, goal = (simulation.joined(q) for q in (plan.problem.start, plan.problem.goal))
    simulation.place(start)
    try:
        window = Window(simulation)
    except MmpError as error:
        raise MmpError(f"{path} cannot be played: {error}; {instead}") from error
    with contextlib.closing(window):
        if sentence:
            say(sentence)
            sys.stdout.flush()
        while window.is_open:
            simulation.place(start)
            execute_plan(simulation, plan, lambda: window.show(goal))
            time.sleep(_PAUSE_S)
            if once:
                return window.is_open
    return False


def _open_recording(path: Path) -> None:
    from mmp_env.view.rerun import require

    require()
    _check_display(path, "copy it to a machine that has one, or drop it on https://rerun.io/viewer")
    code = subprocess.run([sys.executable, "-m", "rerun", str(path)], check=False).returncode
    if code != 0:
        raise MmpError(f"{path} cannot be shown: the rerun viewer ended with code {code}")


def _open_report(folder: Path) -> None:
    """Opens the report of a benchmark, and first makes it if it is missing or older than the results."""
    results, page = folder / "results.jsonl", folder / "report.html"
    made, needed = status(page), status(results)
    if needed is not None and (made is None or made.st_mtime < needed.st_mtime):
        from mmp_cli import report

        report.run(report.parser().parse([str(folder)]))
    if not exists(page):
        raise MmpError(f"{folder} is no folder of mmp bench: there is neither results.jsonl nor report.html in it")
    _open_page(page)


def _open_page(path: Path) -> None:
    """Opens a file in the browser, or in the desktop's program for it."""
    if "BROWSER" not in os.environ:  # a browser named there may work without a display
        _check_display(path, "copy it to a machine that has one")
    if not webbrowser.open(real_path(path).as_uri()):
        raise MmpError(f"{path} cannot be opened: no browser was found; the variable BROWSER names one")


def _check_display(path: Path, instead: str) -> None:
    from mmp_env.opengl import has_display

    if not has_display():
        raise MmpError(f"{path} cannot be opened in a window, as there is no display here; {instead}")
