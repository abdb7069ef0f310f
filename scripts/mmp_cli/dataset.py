"""`mmp dataset SOURCE --out DIR`: expert episodes of an environment, for learning."""

from __future__ import annotations

import copy
import json
import math
import shlex
from argparse import Namespace
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from mmp_cli.arguments import Parser, add_margin, output, seconds, seed, whole
from mmp_cli.output import complain, one_line, say, shortened
from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.wording import counted

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec

    from mmp_cli.benchmark.sources import Instances
    from mmp_cli.datasets.expert import Episode
    from mmp_cli.datasets.folder import DatasetFolder
    from mmp_env.gym.env import MultiArmCellEnv
    from mmp_env.model.cell import Cell
    from mmp_env.model.problem import Problem
    from mmp_planners import PlanResult

FORMATS = ("npz", "minari")


def parser() -> Parser:
    """Returns the parser of the command."""
    out = Parser(
        "mmp dataset",
        "Writes expert episodes of the environment: plans instances, and follows the plans with actions.",
    )
    out.add_argument("source", metavar="SOURCE", help="environment id, instance file or cell file")
    out.add_argument("--count", type=whole, default=10, metavar="N", help="number of instances; default: 10")
    help = "folder of the dataset; one that was begun with the same settings is continued"
    out.add_argument("--out", type=output, required=True, metavar="DIR", help=help)
    help = "npz: a file of NumPy arrays for each episode; minari: a Minari dataset as well; default: npz"
    out.add_argument("--format", choices=FORMATS, default="npz", help=help)
    out.add_argument("--planner", default="auto", metavar="NAME", help="the expert; default: auto")
    out.add_argument("--seed", type=seed, default=0, metavar="N", help="seed of the first instance; default: 0")
    help = "for planning one instance [s]; default: 10"
    out.add_argument("--time-limit", type=seconds, default=10.0, metavar="S", help=help)
    out.add_argument("--robot", metavar="NAME", help="exchanges the arms of a ring")
    out.add_argument("--task", metavar="NAME", help="draws the instances; default: that of the environment")
    help = "meaning of actions: position, velocity or delta; default: position"
    out.add_argument("--control-mode", default="position", metavar="MODE", help=help)
    add_margin(out)
    out.add_argument("--json", action="store_true", help="print one JSON object instead of the summary")
    return out


def run(args: Namespace) -> int:
    """Runs the command. Raises `MmpError` for bad usage and bad input, before anything is planned."""
    from mmp_cli.benchmark.job import MOST_UNITS
    from mmp_cli.benchmark.sources import read_sources
    from mmp_cli.datasets import minari_format
    from mmp_cli.datasets.folder import exclusive
    from mmp_cli.plan import ready
    from mmp_env.errors import UnknownNameError
    from mmp_env.gym.control import CONTROL_MODES

    if args.count > MOST_UNITS:
        raise MmpError(f"--count {args.count} is too large; a dataset has at most {MOST_UNITS} instances")
    if args.control_mode not in CONTROL_MODES:
        raise UnknownNameError("--control-mode", args.control_mode, CONTROL_MODES)
    if args.format == "minari":
        minari_format.require()
    with ready(args.planner, {}):  # a planner that does not load ends the command before it plans
        pass
    (source,) = read_sources(Namespace(**vars(args) | {"sources": [args.source]}))
    with exclusive(Path(args.out)):
        return _fill(args, source)


def _fill(args: Namespace, source: Instances) -> int:
    """Adds the instances that are missing and reports. Returns the exit code."""
    from mmp_cli.datasets import minari_format
    from mmp_cli.datasets.episode_file import rows_of
    from mmp_cli.datasets.folder import DatasetFolder
    from mmp_cli.datasets.minari_target import VERSION, check_target, minari_name
    from mmp_env.files.paths import exists

    folder = DatasetFolder(Path(args.out), _settings(args, source))
    folder.check_instances(source)
    before, name = len(folder.files), minari_name(source.title)
    if args.format == "minari":
        check_target(folder.path / name)
    with closing(_env(args, source.cell)) as env:  # a cell that MuJoCo refuses ends the command before it plans
        folder.check_episodes(rows_of(env))
    for k, item in enumerate(source.items):
        if item.name in folder.done:
            continue
        outcome, episode = _episode(args, source, k)
        folder.add(item.name, item.seed, outcome, episode)
        complain(f"{len(folder.lines)} of {len(source.items)}: {item.name}: {outcome}")
    identity = None
    if args.format == "minari" and folder.files:
        with closing(_env(args, source.cell)) as env:
            identity = minari_format.write(folder, name, env, _spec(args, folder))
    elif len(folder.files) > before and exists(folder.path / name / VERSION):
        complain(f"the Minari dataset in {folder.path} lacks the new episodes; --format minari makes it again")
    _report(args, folder, identity)
    return 0 if folder.files else 1


def _settings(args: Namespace, source: Instances) -> dict[str, object]:
    from mmp_env.version import __version__

    asked = {key: getattr(args, key) for key in ("planner", "time_limit", "control_mode", "task", "robot", "margin")}
    asked["time_limit"] = None if math.isinf(args.time_limit) else args.time_limit  # JSON has no infinity
    return {"source": source.title, "cell": source.digest, "seed": args.seed, **asked, "version": __version__}


def _episode(args: Namespace, source: Instances, k: int) -> tuple[str, Episode | None]:
    """Returns what came of an instance, and its episode if the expert reached the goal."""
    from mmp_cli.datasets.expert import follow
    from mmp_cli.datasets.folder import SUCCESS

    try:
        problem = source.problem(k)
    except InvalidInstanceError as error:
        return f"invalid: {error}", None
    result = _planned(args, problem, source.items[k].seed)
    if result.plan is None:
        fault = result.stats.get("message") if result.status == "error" else None
        return f"no plan: {result.status}" if fault is None else f"error: {shortened(one_line(str(fault)))}", None
    with closing(_env(args, problem.cell)) as env:
        try:
            episode = follow(env, problem, result.plan)
        except MmpError as error:
            return f"not retimed: {error}", None
    if episode.is_success:
        return SUCCESS, episode
    contact = "a contact" if episode.infos["contacts"].any() else "the goal was not reached"
    return f"not followed: {contact}", None


def _planned(args: Namespace, problem: Problem, seed: int) -> PlanResult:
    """Returns the result of the expert. It is `error` if the expert refuses the problem, or is foreign and fails."""
    from mmp_cli.plan import ready
    from mmp_planners import PlanResult, Status, registry
    from mmp_planners.safe_plan import run_planner

    try:
        with ready(args.planner, {}) as planner:
            if registry.is_foreign(args.planner):
                return run_planner(args.planner, planner, problem, seed=seed, time_limit=args.time_limit)
            return planner.plan(problem, seed=seed, time_limit=args.time_limit)
    except MmpError as error:
        return PlanResult(status=Status.ERROR, stats={"message": str(error)})


def _env(args: Namespace, cell: Cell) -> MultiArmCellEnv:
    from mmp_env.gym.env import MultiArmCellEnv

    return MultiArmCellEnv(cell=cell, control_mode=args.control_mode)


def _spec(args: Namespace, folder: DatasetFolder) -> EnvSpec | None:
    """Returns what Gymnasium makes the environment of an environment id with; None for a file, which may change.

    It allows as many steps as the longest episode has.
    """
    import gymnasium

    from mmp_env.gym.registration import CELLS, MAX_EPISODE_STEPS, known_id

    if args.source.removeprefix("mmp_env:") not in CELLS:
        return None
    spec = copy.deepcopy(gymnasium.spec(known_id(args.source)))
    asked = {name: getattr(args, name) for name in ("control_mode", "robot", "task", "margin")}
    spec.kwargs |= {name: value for name, value in asked.items() if value is not None}
    spec.max_episode_steps = max(MAX_EPISODE_STEPS, folder.longest)
    return spec


def _report(args: Namespace, folder: DatasetFolder, identity: str | None) -> None:
    from mmp_env.gym.registration import MAX_EPISODE_STEPS

    if folder.longest > MAX_EPISODE_STEPS:
        complain(
            f"the longest episode has {folder.longest} steps, and an environment of gymnasium.make ends one after"
            f" {MAX_EPISODE_STEPS}; give it max_episode_steps={folder.longest}"
        )
    steps = sum(line.get("steps", 0) for line in folder.lines)
    others = {outcome: count for outcome, count in folder.outcomes.items() if outcome != "success"}
    if args.json:
        result = {"out": str(folder.path), "instances": len(folder.lines), "episodes": len(folder.files)}
        say(json.dumps(result | {"steps": steps, "left_out": others, "minari": identity}))
        return
    say(f"{counted(len(folder.files), 'episode')} with {counted(steps, 'step')} in {folder.path}")
    for outcome, count in others.items():
        say(f"left out: {counted(count, 'instance')}: {outcome}")
    if identity is not None:
        say(f"Minari dataset {identity}: MINARI_DATASETS_PATH={shlex.quote(str(folder.path))} minari show {identity}")
