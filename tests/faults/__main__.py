"""Fails each call of every command once, in every way. scripts/faults.sh runs it."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from faults.commands import COMMANDS, Command
from faults.judges import faults_after, faults_of, is_excused
from faults.kit import AGAIN, KINDS, Kit, Run

COUNTING = {"memory": "memory", "pipe": "count-output", "stderr": "count-stderr"}
"""Kind -> kind in which its calls are counted; the default is `count`, for all calls on files. Call -1 never comes."""
FEW, SAMPLED = 300, 40
"""Largest number of allocations of a command that each fail once; number of those that fail of a command with more."""


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


def repeated(kit: Kit, command: Command, good: Run) -> list[str]:
    """Runs a command once more after a good run. Returns what was wrong."""
    with kit.folder() as (folder, before):
        shutil.copytree(good.folder, folder, dirs_exist_ok=True)
        return faults_after(kit.run(command, folder, before, AGAIN), good)


@dataclass(frozen=True)
class Attempt:
    """One point that was tried: what was wrong, and whether the crash of a library is excused."""

    faults: list[str]
    excused: bool = False


def tried(kit: Kit, command: Command, kind: str, at: int, good: Run) -> Attempt:
    """Runs a command with a call that fails, and once more if it left something that a good run does not leave."""
    with kit.folder(command) as (folder, before):
        run = kit.run(command, folder, before, kind, at)
        out = faults_of(run, kind, good)
        if run.temporary or (run.contents != run.there and (run.code != 0 or command.adds)):
            out += faults_after(kit.run(command, folder, before, AGAIN), good)
        return Attempt(out, is_excused(run, kind))


@dataclass
class Tally:
    """Counts and faults of the attempts so far."""

    tried: Counter[str] = field(default_factory=Counter)
    possible: int = 0
    faulty: int = 0
    excused: int = 0

    def add(self, kind: str, point: str, attempt: Attempt) -> None:
        """Counts an attempt, and prints its faults."""
        for fault in attempt.faults:
            print(f"{point}: {fault}", flush=True)
        self.tried[kind] += 1
        self.faulty += bool(attempt.faults)
        self.excused += attempt.excused


def try_command(kit: Kit, pool: ThreadPoolExecutor, name: str, kinds: Sequence[str], most: int | None) -> Tally:
    """Tries all points of a command, or `most` of each kind. Raises `RuntimeError` if it fails where nothing fails."""
    command, out, goods = COMMANDS[name], Tally(), dict[str, Run]()
    for kind in kinds:
        counting = COUNTING.get(kind, "count")
        if counting not in goods:
            goods[counting] = good_run(kit, command, kind, kit.home / f"good-{name}-{counting}")
        good = goods[counting]
        if good.code != 0:
            raise RuntimeError(f"{name}: exit code {good.code} where nothing fails: {good.err}")
        calls = 1 if kind == "closed" else good.calls
        chosen = points(calls, most or (SAMPLED if kind == "memory" and calls > FEW else None))
        out.possible += calls
        attempt = partial(tried, kit, command, kind, good=good)
        for at, found in zip(chosen, pool.map(attempt, chosen), strict=True):
            out.add(kind, f"{name} {kind} {at}", found)
        print(f"{name} {kind}: {len(chosen)} of {calls} points", flush=True)
    out.possible += 1
    out.add("again", f"{name} again", Attempt(repeated(kit, command, next(iter(goods.values())))))
    return out


def main(argv: Sequence[str] | None = None) -> int:
    """Tries all points and prints what it found. Returns 1 if there were faults."""
    parser = argparse.ArgumentParser(prog="faults", description=__doc__)
    parser.add_argument("commands", nargs="*", choices=[[], *COMMANDS], help="commands; default: all")
    parser.add_argument("--kinds", default=",".join(KINDS), help=f"kinds of failures; default: {','.join(KINDS)}")
    help = f"points of a command and kind; default: all of them, but {SAMPLED} allocations of more than {FEW}"
    parser.add_argument("--most", type=int, help=help)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="runs at once")
    parser.add_argument("--figure", default="faults_handled", metavar="NAME", help="name of the printed figure")
    args = parser.parse_args(argv)
    with tempfile.TemporaryDirectory(prefix="faults-") as home, ThreadPoolExecutor(args.workers) as pool:
        kit = Kit(Path(home))
        try:
            found = [
                try_command(kit, pool, name, args.kinds.split(","), args.most) for name in args.commands or COMMANDS
            ]
        except RuntimeError as error:
            print(error)
            return 1
    count = sum((each.tried for each in found), Counter[str]())
    faulty, excused = sum(each.faulty for each in found), sum(each.excused for each in found)
    possible = sum(each.possible for each in found)
    print(f"{dict(count)} of {possible} points; {faulty} faults, {excused} excused crashes")
    from figure import print_figure  # of scripts/, which the tests of this module do not need

    total = count.total()
    print_figure(args.figure, total - faulty, f"of {total}", points_total=possible, excused=excused, **count)
    return bool(faulty)


if __name__ == "__main__":
    sys.exit(main())
