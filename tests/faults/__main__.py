"""Fails each call of every command once, in every way. scripts/faults.sh runs it."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from faults.commands import COMMANDS, Command
from faults.judges import faults_after, faults_of
from faults.kit import KINDS, Kit, Run

COUNTING = {"memory": "memory", "pipe": "count-output"}
"""Way to fail -> the kind that only counts its calls; other ways count all calls on files. Call -1 never comes."""

FEW, SAMPLED = 300, 40
"""Each allocation of a command with at most `FEW` fails once. A command with more has `SAMPLED` of them fail."""


def points(calls: int, most: int | None) -> list[int]:
    """Returns the numbers of the calls that fail: all of them, or `most` spread over all."""
    if most is None or calls <= most:
        return list(range(calls))
    return sorted({round(k * (calls - 1) / max(most - 1, 1)) for k in range(most)})


def good_run(kit: Kit, command: Command, kind: str, stay: Path) -> Run:
    """Runs a command where nothing fails and counts its calls; its files are kept in the folder `stay`."""
    with kit.folder(command) as (folder, before):
        run = kit.run(command, folder, before, COUNTING.get(kind, "count"))
        folder.rename(stay)
        return replace(run, folder=stay)


def tried(kit: Kit, command: Command, kind: str, at: int, good: Run) -> list[str]:
    """Runs a command with a call that fails, and once more if it left anything. Returns what was wrong."""
    with kit.folder(command) as (folder, before):
        run = kit.run(command, folder, before, kind, at)
        out = faults_of(run, kind, good)
        kept = {name: (folder / name).read_bytes() for name in command.adds if (folder / name).is_file()}
        if run.code != 0 and (run.temporary or set(run.files) != set(before)):
            again = kit.run(command, folder, before, "off")
            out += faults_after(again, good, kept)
        return out


def main(argv: Sequence[str] | None = None) -> int:
    """Tries all points and prints what it found. Returns 1 if there were faults."""
    parser = argparse.ArgumentParser(prog="faults", description=__doc__)
    parser.add_argument("commands", nargs="*", choices=[[], *COMMANDS], help="commands; default: all")
    parser.add_argument("--kinds", default=",".join(KINDS), help=f"ways to fail; default: {','.join(KINDS)}")
    help = f"points of a command and kind; default: all of them, but {SAMPLED} allocations of more than {FEW}"
    parser.add_argument("--most", type=int, help=help)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="runs at once")
    parser.add_argument("--figure", default="faults_handled", metavar="NAME", help="name of the printed figure")
    args = parser.parse_args(argv)
    found, count, points_total = [], Counter[str](), 0
    with tempfile.TemporaryDirectory(prefix="faults-") as home, ThreadPoolExecutor(args.workers) as pool:
        kit = Kit(Path(home))
        for name in args.commands or COMMANDS:
            command = COMMANDS[name]
            for kind in args.kinds.split(","):
                good = good_run(kit, command, kind, Path(home, f"good-{name}-{kind}"))
                if good.code != 0:
                    print(f"{name}: exit code {good.code} where nothing fails: {good.err}")
                    return 1
                most = args.most or (SAMPLED if kind == "memory" and good.calls > FEW else None)
                chosen = points(good.calls, most)
                points_total += good.calls
                attempt = partial(tried, kit, command, kind, good=good)
                for at, faults in zip(chosen, pool.map(attempt, chosen), strict=True):
                    count[kind] += 1
                    for fault in faults:
                        print(f"{name} {kind} {at}: {fault}", flush=True)
                    if faults:
                        found.append(f"{name} {kind} {at}")
                print(f"{name} {kind}: {len(chosen)} of {good.calls} points", flush=True)
    print(f"{dict(count)} of {points_total} points; {len(found)} faults")
    from figure import print_figure  # of scripts/, which the tests of this module do not need

    total = sum(count.values())
    print_figure(args.figure, total - len(found), f"of {total}", points_total=points_total, **count)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
