"""Measures the figures of README and docs, and writes the pages. Usage: measure.py [PART...]

Stopped and started again on the same commit, it continues. It runs one command at a time, by default with one run at a
time, so that times are those of an idle core. Parts: {parts}.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks import BENCHES, CIRCLES, COUNTS, LINES, PARTS, REPORTED, SHARES
from figure import commit, figure_line
from measured import ROOT

from mmp_cli.arguments import Parser, seconds, whole
from mmp_cli.machine import machine
from mmp_cli.main import run_script
from mmp_env.errors import MmpError, UnknownNameError

SCRIPTS = ROOT / "scripts"
ON_PAGES = 50
"""Number of instances of each cell on the pages of docs."""
MMP = [sys.executable, "-P", "-c", "import sys; from mmp_cli.main import main; sys.exit(main())"]
__doc__ = __doc__.format(parts=", ".join(PARTS)) if __doc__ else None


def main() -> None:
    """Runs the parts in order, and prints and keeps the duration of each."""
    args = arguments()
    chosen = args.parts or [part for part in PARTS if part != "circles" or args.instances]
    for part in [part for part in PARTS if part in chosen]:
        for folder, all_words in commands(part, args):
            condition(args, folder)
            if folder.endswith(".jsonl") and (args.out / folder).exists():
                continue  # complete
            print(f"{part}: {folder}", flush=True)
            begin = time.monotonic()
            try:
                run(all_words, args.out / folder)
            finally:
                took = time.monotonic() - begin
                add_duration(args, part, took)
                print(f"{part}: {folder} took {took:.0f} s", flush=True)


def arguments() -> argparse.Namespace:
    """Returns the arguments of the command line."""
    parser = Parser("measure.py", __doc__, argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", type=_part, metavar="PART", help="default: all")
    parser.add_argument(
        "--out", type=Path, default=Path("build/measured"), metavar="DIR", help="default: build/measured"
    )
    parser.add_argument(
        "--instances", type=Path, metavar="DIR", help="folder of panda-circle-N.json and .published.csv"
    )
    parser.add_argument(
        "--count", type=whole, default=ON_PAGES, metavar="N", help=f"instances of each cell (default: {ON_PAGES})"
    )
    parser.add_argument("--time-limit", type=seconds, default=10.0, metavar="S", help="for each run (default: 10)")
    parser.add_argument("--workers", type=whole, default=1, metavar="N", help="runs at a time (default: 1)")
    args = parser.parse()
    if "circles" in args.parts and not args.instances:
        raise MmpError("the part 'circles' needs --instances, the folder of panda-circle-N.json")
    if "pages" in (args.parts or PARTS) and args.count < ON_PAGES:
        raise MmpError(f"the pages have {ON_PAGES} instances of each cell; --count {args.count} is fewer")
    return args


def _part(text: str) -> str:
    if text not in PARTS:
        raise argparse.ArgumentTypeError(str(UnknownNameError("part", text, PARTS)))
    return text


def commands(part: str, args: argparse.Namespace) -> Iterator[tuple[str, list[list[str]]]]:
    """Yields the name of each output of a part below `--out`, and the commands that make it."""
    for name, scripts in LINES.get(part, {}).items():
        yield f"{name}.jsonl", [script(*words) for words in scripts]
    if part == "small" and args.instances:
        circle = str(args.instances / f"{CIRCLES[-1]}.json")
        yield "portfolio-circle.jsonl", [script("bench_portfolio.py", "--limits", "--instances", circle)]
        yield "anytime-circle.jsonl", [script("bench_anytime.py", "--instances", circle)]
    if part == "pages":
        pages = ("results_page.py", "readme_table.py", "planners_page.py")
        words = {"results_page.py": [str(args.out)]}
        for name in pages:
            yield name, [script(name, *words.get(name, []))]
    for folder, words in BENCHES.get(part, {}).items():
        sources = [str(args.instances / f"{word}.json") if word in CIRCLES else word for word in words]
        of_count, of_limit = SHARES.get(folder, (1.0, 1.0))
        count = max(1, round(min(args.count, COUNTS.get(folder, args.count)) * of_count))
        limits = ["--seed", "0", "--count", str(count), "--time-limit", f"{args.time_limit * of_limit:g}"]
        where = ["--workers", str(args.workers), "--out", str(args.out / folder)]
        yield folder, [[*MMP, "bench", *sources, *limits, *where]]
        if folder in REPORTED:
            title = f"{REPORTED[folder]}, {args.time_limit:g} s per run"
            yield folder, [[*MMP, "report", str(args.out / folder), "--title", title]]
    if part == "circles":
        published = [str(args.instances / f"{name}.published.csv") for name in CIRCLES]
        yield "published.jsonl", [script("bench_published.py", str(args.out / "circles"), *published)]


def add_duration(args: argparse.Namespace, part: str, seconds: float) -> None:
    """Adds a time [s] to the line of a part in `durations.jsonl`: a part may be stopped and go on later."""
    if part == "pages":
        return
    path, name = args.out / "durations.jsonl", f"duration_{part}"
    lines = map(json.loads, path.read_text(encoding="utf-8").splitlines()) if path.exists() else ()
    named = {line["name"]: line for line in lines}
    total = round(named.get(name, {"value": 0.0})["value"] + seconds, 1)
    settings = {"workers": args.workers, "count": args.count, "time_limit_s": args.time_limit}
    named[name] = figure_line(name, total, "s", **settings)
    path.write_text("".join(f"{json.dumps(line)}\n" for line in named.values()), encoding="utf-8")


def script(name: str, *words: str) -> list[str]:
    """Returns the command that runs a script of this folder."""
    return ["bash" if name.endswith(".sh") else sys.executable, str(SCRIPTS / name), *words]


def condition(args: argparse.Namespace, name: str) -> None:
    """Writes down commit and machine. Raises `MmpError` if the folder was begun with others."""
    path = args.out / "conditions" / f"{name}.json"
    now = {"commit": commit(), "workers": args.workers, "real_time": real_time(), "cpu": machine()}
    if name.endswith(".py"):
        return
    if path.exists() and (before := json.loads(path.read_text(encoding="utf-8"))) != now:
        raise MmpError(f"{args.out / name} was begun with {before}, and now it is {now}; give another --out")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(now) + "\n", encoding="utf-8")


def real_time() -> bool:
    """Returns whether we run with real-time priority (`chrt -f 50`), before all other work of the machine."""
    return hasattr(os, "sched_getscheduler") and os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR)


def run(commands: list[list[str]], target: Path) -> None:
    """Runs commands in order. If `target` is a `.jsonl`, the lines in JSON go there once all are complete."""
    if target.suffix != ".jsonl":
        for command in commands:
            ended(target, subprocess.run(command, check=False).returncode)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    begun = target.with_suffix(".begun")
    with begun.open("w", encoding="utf-8") as file:
        for command in commands:
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
                for line in process.stdout or ():
                    (file if line.startswith("{") else sys.stdout).write(line)
            ended(target, process.returncode)
    begun.replace(target)


def ended(target: Path, code: int) -> None:
    """Raises `MmpError` after a command that failed."""
    if code:
        raise MmpError(f"{target.name} ended with exit code {code}; the same command continues from there")


if __name__ == "__main__":
    run_script(main)
