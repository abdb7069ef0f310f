"""The options `--tree`, `--rerun`, `--image` and `--video`. They are checked before planning.

Their watchers do not change the planning. A failure is reported afterwards and does not cost the plan.
"""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mmp_cli.arguments import Parser
from mmp_cli.output import complain
from mmp_env.errors import MmpError
from mmp_env.events import Event, Watcher, wants_iterates
from mmp_env.files.paths import real_path
from mmp_planners import StopPlanning

if TYPE_CHECKING:
    from mmp_env.model.plan import Plan
    from mmp_env.model.problem import Problem
    from mmp_env.sim.execution import ExecutionReport
    from mmp_env.view.pictures import Moment

SPAWN = "spawn"
_OPTIONS = {
    "tree": ("FILE", "draw the conflict tree: an SVG file"),
    "rerun": ("FILE", f"record search and plan for the rerun viewer: an .rrd file, or '{SPAWN}' to open the viewer"),
    "image": ("FILE", "a picture of the plan at its start, middle and end: .png, .jpg or .webp"),
    "video": ("FILE", "a film of the plan as it is executed: .mp4, .gif or .webp"),
}

_ROWS = {"tree": "tree", "rerun": "recording", "image": "picture", "video": "film"}
"""Option -> name of its row in the summary."""


def add_visual_options(parser: Parser, *names: str) -> None:
    """Adds the options of those names, by default all of them."""
    for name in names or _OPTIONS:
        metavar, help = _OPTIONS[name]
        parser.add_argument(f"--{name}", metavar=metavar, help=help)
    parser.add_argument(
        "--moments",
        type=_moments,
        metavar="A,B",
        help="moments of --image: start, middle, end, or seconds; default: start,middle,end",
    )
    help = "view of --image and --video: overview, front, back, left, right, top, or azimuth=DEG,elevation=DEG"
    parser.add_argument(
        "--camera",
        type=_camera,
        metavar="VIEW",
        help=f"{help}, perhaps with distance=M,lookat=X/Y/Z; default: overview",
    )


def check_visual_outputs(args: Namespace) -> None:
    """Raises `MmpError` if an output cannot be made: a package, library or display is missing, or a file."""
    wanted = _wanted(args)
    _check_distinct({"out": getattr(args, "out", None), **wanted})
    if args.moments is not None and "image" not in wanted:
        raise MmpError("--moments chooses the moments of --image; give --image FILE too")
    if args.camera is not None and not {"image", "video"} & set(wanted):
        raise MmpError("--camera chooses the view of --image and --video; give one of them too")
    for name in wanted:
        _CHECKS[name](args)


class VisualOutputs:
    """The visual outputs of one run: watchers of its planning, and `finish`, which writes the files.

    `rows` has a row of the summary for each output, `failures` a sentence for each that failed.
    """

    def __init__(self, args: Namespace, problem: Problem, title: str) -> None:
        self.rows: dict[str, str] = {}
        self.failures: list[str] = []
        self._wanted, self._tree, self._recording = _wanted(args), None, None
        self._moments, self._camera = args.moments, args.camera
        self._is_saved = getattr(args, "out", None) is not None
        self._is_finished = False
        if "tree" in self._wanted:
            from mmp_env.view.search_tree import SearchTree

            self._tree = SearchTree(problem, title=title)
        if "rerun" in self._wanted:
            from mmp_env.view.rerun import RerunWatcher

            self._recording = RerunWatcher(problem, self._wanted["rerun"])
        named: dict[str, Any] = {"--tree": self._tree, "--rerun": self._recording}
        self.watchers = [
            _GuardedWatcher(name, viewer, self.failures) for name, viewer in named.items() if viewer is not None
        ]

    def __enter__(self) -> VisualOutputs:
        return self

    def __exit__(self, failure: type[BaseException] | None, *_: object) -> None:
        if self._recording is None or self._is_finished:
            return
        self._recording.close()  # the recording of a run that failed is the most useful one
        if failure is not None and self._wanted["rerun"] != SPAWN:
            ended = "was interrupted" if issubclass(failure, KeyboardInterrupt) else "failed"
            complain(f"the recording {self._wanted['rerun']} ends where the run {ended}")

    def finish(self, plan: Plan | None, execution: ExecutionReport | None, *, interrupted: bool) -> None:
        """Writes tree and recording, and picture and film if there is a plan and no interruption.

        Ctrl-C leaves out the outputs that are not written yet; this method raises it again.
        """
        self._is_finished = True
        try:
            self._make("tree", lambda path: self._draw(plan, path))
            self._make("rerun", lambda path: self._record(plan))
            if plan is not None and not interrupted:
                self._make("image", lambda path: save_image(plan, path, self._moments, self._camera))
                self._make("video", lambda path: save_video(plan, path, execution, self._camera))
        finally:
            self._say_what_is_missing(plan)

    def _say_what_is_missing(self, plan: Plan | None) -> None:
        failed = {failure.partition(":")[0].removeprefix("--") for failure in self.failures}
        for name in self._wanted:
            if _ROWS[name] in self.rows or name in failed:
                continue
            instead = "; mmp show makes it from the plan file" if self._is_saved and name != "tree" else ""
            why = "none, as there is no plan" if plan is None else f"left out, the run was interrupted{instead}"
            self.rows[_ROWS[name]] = why

    def _draw(self, plan: Plan | None, path: str) -> None:
        assert self._tree is not None
        if plan is not None:
            self._tree.add_plan(plan)
        self._tree.save(path)

    def _record(self, plan: Plan | None) -> None:
        assert self._recording is not None
        self._recording.show_plan(plan)
        self._recording.close()

    def _make(self, name: str, make: Callable[[str], None]) -> None:
        if name not in self._wanted:
            return
        path = self._wanted[name]
        try:
            make(path)
        except (MmpError, OSError) as error:
            self.failures.append(f"--{name}: {error}")
        except Exception as error:  # such as an event with values that no viewer expects
            self.failures.append(f"--{name}: it failed with {type(error).__name__}: {error}")
        else:
            self.rows[_ROWS[name]] = "in the viewer" if (name, path) == ("rerun", SPAWN) else path


class CombinedWatcher:
    """Several watchers as one; each gets every event."""

    def __init__(self, *watchers: Watcher) -> None:
        self._watchers = watchers
        self.wants_iterates = any(wants_iterates(watch) for watch in watchers)

    def __call__(self, event: Event) -> None:
        for watch in self._watchers:
            watch(event)


class _GuardedWatcher:
    """A watcher whose failure is recorded, instead of appearing as a failure of the planner."""

    def __init__(self, name: str, viewer: Watcher, failures: list[str]) -> None:
        self._name, self._viewer, self._failures = name, viewer, failures
        self._failed = False
        self.wants_iterates = wants_iterates(viewer)

    def __call__(self, event: Event) -> None:
        if self._failed:
            return
        try:
            self._viewer(event)
        except StopPlanning:
            raise
        except Exception as error:
            self._failed = True
            self._failures.append(f"{self._name}: it stopped at {type(error).__name__}: {error}")


def save_image(plan: Plan, path: str, moments: Sequence[Moment] | None, camera: str | None) -> None:
    """Writes a picture of the moments, by default start, middle and end. Raises `MmpError`."""
    from mmp_env.view.pictures import MOMENTS, save_picture

    save_picture(plan, path, moments=moments or tuple(MOMENTS), camera=camera)


def save_video(plan: Plan, path: str, report: ExecutionReport | None, camera: str | None) -> None:
    """Writes a film of the execution, which it runs if there is none; a terminal shows the progress.

    Raises `MmpError`.
    """
    from rich.console import Console

    from mmp_cli.execution import execute
    from mmp_env.view.films import save_film

    report = report or execute(plan)
    with Console(stderr=True).status("film") as line:
        save_film(
            plan,
            path,
            report,
            camera=camera,
            progress=lambda done, total: line.update(f"film: frame {done} of {total}"),
        )


def _moments(text: str) -> list[Moment]:
    """Returns the moments in a list of names and seconds, separated by commas."""
    out: list[Moment] = []
    for word in text.split(","):
        try:
            out.append(float(word))
        except ValueError:
            out.append(word.strip())
    return out


def _camera(text: str) -> str:
    """Returns the view of a camera as it is given, if it is one."""
    from mmp_env.sim.camera_view import as_camera_view

    try:
        as_camera_view(text)
    except MmpError as error:  # argparse drops the message of a ValueError
        raise ArgumentTypeError(str(error)) from None
    return text


def _wanted(args: Namespace) -> dict[str, str]:
    given = {name: getattr(args, name, None) for name in _OPTIONS}
    return {name: path for name, path in given.items() if path is not None}


def _check_distinct(paths: Mapping[str, str | None]) -> None:
    seen: dict[Path, str] = {}
    for name, path in paths.items():
        if path is None or (name, path) == ("rerun", SPAWN):
            continue
        other = seen.setdefault(real_path(path), name)
        if other != name:
            raise MmpError(f"--{other} and --{name} both name {path}; give each a file of its own")


def _check_tree(args: Namespace) -> None:
    from mmp_env.files.writing import check_writable

    if Path(args.tree).suffix.lower() != ".svg":
        raise MmpError(f"--tree draws an SVG file, and '{args.tree}' does not end in .svg")
    check_writable(args.tree)


def _check_rerun(args: Namespace) -> None:
    from mmp_env.view.rerun.sdk import check

    check(args.rerun)


def _check_image(args: Namespace) -> None:
    from mmp_env.view.pictures import MOMENTS, check_picture

    check_picture(args.image, args.moments or tuple(MOMENTS))


def _check_video(args: Namespace) -> None:
    from mmp_env.view.films import check_film

    check_film(args.video)


_CHECKS = {"tree": _check_tree, "rerun": _check_rerun, "image": _check_image, "video": _check_video}
