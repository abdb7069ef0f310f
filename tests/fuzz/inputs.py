"""One input of the fuzzer: a command line and its changed files, how it is run and judged, and how it is kept."""

from __future__ import annotations

import base64
import json
import random
import shutil
import tempfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fuzz import changes, judges, samples
from fuzz.process import Fault, Worker


@dataclass(frozen=True)
class Input:
    """A command line of a kind in `samples.LINES`, and the content of the files that are changed."""

    kind: str
    line: list[str]
    files: dict[str, bytes]

    def to_json(self) -> str:
        """Returns the input as text."""
        files = {name: base64.b64encode(content).decode() for name, content in self.files.items()}
        return json.dumps({"kind": self.kind, "line": self.line, "files": files}, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Input:
        """Returns the input of `to_json`."""
        data = json.loads(text)
        files = {name: base64.b64decode(content) for name, content in data["files"].items()}
        return cls(kind=data["kind"], line=data["line"], files=files)


def drawn(good: dict[str, bytes], rng: random.Random) -> Input:
    """Returns a changed input; `good` are the contents of all good files."""
    kinds = list(samples.LINES)
    kind = rng.choices(kinds, [samples.RARELY.get(each, 1.0) for each in kinds])[0]
    name, line = samples.LINES[kind]
    line = with_limits(line)
    files = {name: changes.changed_file(good[name], rng)} if name and rng.random() < 0.8 else {}
    if not files or rng.random() < 0.2:
        line = changes.changed_line(line, rng)
    return Input(kind=kind, line=line, files=files)


def with_limits(line: list[str], limits_s: Mapping[str, float] = samples.TIME_LIMITS_S) -> list[str]:
    """Returns a command line with the time limit of its command [s] and an output file, where it has them."""
    if line[0] in limits_s:
        line = [*line, "--time-limit", str(limits_s[line[0]])]
    return [*line, "--out", "out.json"] if line[0] == "plan" else line


def tried(given: Input, worker: Worker, planted: str | None = None) -> tuple[int | None, list[str]]:
    """Runs an input in a folder of its own. Returns its exit code, None if it crashed or hung, and its faults.

    `planted` names a function of `planted_faults.py` that runs in place of the program.
    """
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        before = samples.write_all(folder)
        for name, content in given.files.items():
            (folder / name).write_bytes(content)
        before |= given.files
        try:
            request = {"line": given.line, "folder": str(folder), "planted": planted}
            answer: dict[str, Any] = worker.ask(request, samples.PATIENCE.get(given.kind, 1.0))
        except Fault as fault:
            return None, [str(fault)]
        run = judges.Run(given.line, answer["code"], answer["out"], answer["err"], folder, before, answer["native"])
        found = judges.faults(run)
        return answer["code"], found or (_refuted(folder, worker) if run.code == 0 else [])
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _refuted(folder: Path, worker: Worker) -> list[str]:
    """Returns what the checker says against a written plan or schedule. It looks at one of four, chosen by content."""
    path = folder / "out.json"
    if not path.is_file() or zlib.crc32(path.read_bytes()) % 4:
        return []
    try:
        answer = worker.ask({"line": ["check", path.name], "folder": str(folder), "planted": None})
    except Fault as fault:
        return [f"check of {path.name}: {fault}"]
    return [f"wrote {path.name}, and then: {answer['out'] or answer['err']}"] if answer["code"] else []


def reduced(given: Input, worker: Worker, faults: list[str]) -> Input:
    """Returns an input with fewer arguments that has the same first fault."""
    out = given
    k = 1
    while k < len(out.line):
        for count in (2, 1):
            line = out.line[:k] + out.line[k + count :]
            fewer = Input(kind=out.kind, line=line, files=out.files)
            if len(line) > 1 and tried(fewer, worker)[1][:1] == faults[:1]:
                out = fewer
                break
        else:
            k += 1
    return out
