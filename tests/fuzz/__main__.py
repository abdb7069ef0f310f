"""Changes files and options, and calls the core with hostile arrays, until time is up. scripts/fuzz.sh runs it."""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from figure import print_figure

from fuzz import core_arrays, inputs, kept_calls, samples
from fuzz.process import LONGEST_S, Fault, Worker

CALLS = 2000
"""Calls of the core in one request."""
CORE_SHARE = 0.15
"""Usual share of the time for calls of the core."""
PROGRESS_S = 60.0
"""Time between two lines of progress [s]."""


@dataclass(frozen=True)
class Settings:
    """Seed and end of a run, the folder for inputs that failed, and how time is shared."""

    seed: int
    end_s: float
    keep: Path
    longest_s: float
    core_share: float


class Fuzzing:
    """Counts of the inputs that were tried, and the faults. One thread for each worker process uses it.

    `good` has the contents of all good files.
    """

    def __init__(self, settings: Settings, good: dict[str, bytes]) -> None:
        self._settings, self._good = settings, good
        self.codes: Counter[tuple[str, int | None]] = Counter()
        self.calls = self.returned = 0
        self.found: list[str] = []

    def run(self, number: int) -> None:
        """Tries inputs in a worker process until time is up."""
        worker, lines, batches, in_core = Worker(self._settings.longest_s), 0, 0, 0.0
        begin = time.monotonic()
        while time.monotonic() < self._settings.end_s:
            seed = f"{self._settings.seed}/{number}"
            if in_core <= self._settings.core_share * (time.monotonic() - begin):
                started, batches = time.monotonic(), batches + 1
                self._call_core(worker, f"{seed}/core/{batches}")
                in_core += time.monotonic() - started
            else:
                lines += 1
                seed = f"{seed}/line/{lines}"
                self._try(worker, inputs.drawn(self._good, random.Random(seed)), seed)
        worker.close()

    @property
    def progress(self) -> str:
        """The numbers of command lines, calls and faults so far."""
        lines = sum(list(self.codes.values()))  # a worker may add a code at any time
        return f"{lines} command lines, {self.calls} calls of the core, {len(self.found)} faults"

    def codes_of(self, kind: str | None = None) -> Counter[int | None]:
        """Returns exit code -> number of the command lines of a kind, or of all."""
        out = Counter[int | None]()
        for (name, code), count in self.codes.items():
            out[code] += count if kind in (None, name) else 0
        return out

    def _try(self, worker: Worker, given: inputs.Input, seed: str) -> None:
        code, faults = inputs.tried(given, worker)
        self.codes[given.kind, code] += 1
        if faults:
            given = inputs.reduced(given, worker, faults)
            self._report(f"{'; '.join(faults)}\n  mmp {' '.join(given.line)}", seed, given.to_json())

    def _call_core(self, worker: Worker, seed: str) -> None:
        try:
            answer = worker.ask({"seed": seed, "calls": CALLS})
            self.calls, self.returned = self.calls + answer["calls"], self.returned + answer["returned"]
            for number, fault in answer["faults"].items():
                self._report_call(fault, seed, int(number))
        except Fault as fault:
            self._report_call(str(fault), seed, worker.number)

    def _report_call(self, fault: str, seed: str, number: int) -> None:
        name, arguments = core_arrays.call_of(seed, number)
        self._report(f"{fault}, in {name}", f"{seed}/{number}", kept_calls.to_json(name, arguments))

    def _report(self, text: str, seed: str, content: str) -> None:
        path = self._settings.keep / f"{seed.replace('/', '-')}.json"
        path.write_text(content)
        self.found.append(text)
        print(f"FAULT {text}\n  kept as {path}", flush=True)


def main() -> int:
    """Returns 0 if no fault was found, 1 otherwise."""
    parser = argparse.ArgumentParser(prog="fuzz.sh", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="default: 1")
    parser.add_argument("--workers", type=int, default=2, help="worker processes (default: 2)")
    help = "the same inputs, in the same order, for the same seed and number of workers (default: from the clock)"
    parser.add_argument("--seed", type=int, default=int(time.time()), help=help)
    help = "folder for the inputs that fail, one file each, to be moved to tests/fuzz/regressions (default: a new one)"
    parser.add_argument("--keep", type=Path, help=help)
    help = f"longest time for a command line (default: {LONGEST_S:g})"
    parser.add_argument("--longest", type=float, default=LONGEST_S, metavar="S", help=help)
    help = f"share of the time for calls of the core (default: {CORE_SHARE:g})"
    parser.add_argument("--core-share", type=float, default=CORE_SHARE, metavar="X", help=help)
    parser.add_argument("--figure", default="fuzz_command_lines", metavar="NAME", help="name of the printed figure")
    args = parser.parse_args()
    print(f"--seed {args.seed} --workers {args.workers} gives these inputs again", flush=True)
    keep = args.keep or Path(tempfile.mkdtemp(prefix="fuzz-kept-"))
    keep.mkdir(parents=True, exist_ok=True)
    print(f"inputs that fail are kept in {keep.resolve()}", flush=True)
    good = samples.contents()  # takes seconds, which do not count
    end_s = time.monotonic() + 60 * args.minutes
    fuzzing = Fuzzing(Settings(args.seed, end_s, keep, args.longest, args.core_share), good)
    with ThreadPoolExecutor(args.workers) as threads:
        workers = [threads.submit(fuzzing.run, k) for k in range(args.workers)]
        while wait(workers, PROGRESS_S).not_done:
            print(fuzzing.progress, file=sys.stderr)
        for done in workers:
            done.result()
    print_summary(fuzzing, args.figure, args.seed)
    return min(len(fuzzing.found), 1)


def print_summary(fuzzing: Fuzzing, figure: str, seed: int) -> None:
    """Prints the numbers of each kind of input and of all, and the figure of them."""
    for kind in samples.LINES:
        print(_row(kind, fuzzing.codes_of(kind)))
    codes = fuzzing.codes_of()
    print(_row("together", codes))
    print(f"{'core':18} {fuzzing.calls:7} calls, {fuzzing.returned:6} returned")
    more = {"accepted": codes[0], "exit_1": codes[1], "exit_2": codes[2], "core_calls": fuzzing.calls}
    more |= {"core_returned": fuzzing.returned, "faults": len(fuzzing.found), "seed": seed}
    print_figure(figure, codes.total(), "command lines", **more)


def _row(kind: str, codes: Counter[int | None]) -> str:
    """Returns a line of the summary. An input is accepted if its exit code is 0."""
    counts = f"exit code 0: {codes[0]:6} (accepted), 1: {codes[1]:6}, 2: {codes[2]:6}"
    return f"{kind:18} {codes.total():7} command lines, {counts}"


if __name__ == "__main__":
    sys.exit(main())
