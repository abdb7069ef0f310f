"""Puts a reproduction of the paper's experiment into docs/results. Usage: results_page.py FOLDER | --check

FOLDER is what `scripts/reproduce_paper.sh` has written. Of each of its benchmark folders, `cells` and `letter`, the
tables, the figures, the settings and the results (compressed) are kept under docs/results, and the tables that matter
most go into docs/results/README.md, between `<!-- table: NAME -->` and `<!-- end of table -->`. With --check nothing is
written, and the exit code is 1 where the page is not up to date.
"""

from __future__ import annotations

import gzip
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from written_pages import bring_up_to_date, checking_parser, filled

from mmp_cli.standalone import run_script
from mmp_env.errors import MmpError

RESULTS = Path(__file__).parent.parent / "docs" / "results"
PAGE = RESULTS / "README.md"
FOLDERS = ("cells", "letter")
_SHOWN = ("Cells", "Errors", "Success, nodes, time, makespan and cost", "Where all of them solve", "Fast track")
"""Headings of table.md whose tables stand on the page; the rest is linked."""
_PAPER_ECBS_FAILED = {"MultiArmCell-4": 24, "MultiArmCell-6": 52, "MultiArmCell-8": 48}
"""Of the paper's ECBS, after 1800 s [%]."""
_NOT_RUN = "Not run yet: `scripts/reproduce_paper.sh`, then `scripts/results_page.py FOLDER`.\n"


def main() -> None:
    """Keeps a reproduction and brings the page up to date, or says that it is not."""
    parser = checking_parser("results_page.py", __doc__)
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help="what to keep; not with --check")
    args = parser.parse()
    if args.check == (args.folder is not None):
        raise MmpError("give either FOLDER or --check")
    if not args.check:
        for name in FOLDERS:
            keep(args.folder / name, RESULTS / name)
    bring_up_to_date({PAGE: with_tables(PAGE.read_text(encoding="utf-8"), RESULTS)}, check=args.check)


def keep(source: Path, target: Path) -> None:
    """Copies a benchmark folder with its report; the results compressed, always to the same bytes."""
    if not (source / "table.md").is_file():
        raise MmpError(f"{source} has no table.md; `mmp report {source}` writes it")
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for path in sorted(source.iterdir()):
        if path.suffix in (".md", ".svg", ".png") or path.name == "settings.json":
            shutil.copyfile(path, target / path.name)
    content = (source / "results.jsonl").read_bytes()
    (target / "results.jsonl.gz").write_bytes(gzip.compress(content, mtime=0))


def with_tables(page: str, results: Path) -> str:
    """The page with the tables of what is kept under `results`."""
    return filled(page, lambda name: _content(name, results))


def _content(name: str, results: Path) -> str:
    path = results / name.removesuffix("-ecbs") / "table.md"
    if not path.is_file():
        return _NOT_RUN
    table = path.read_text(encoding="utf-8")
    return "\n".join(_beside(table)) + "\n" if name.endswith("-ecbs") else "\n\n".join(_chosen(table)) + "\n"


def _chosen(table: str) -> Iterator[str]:
    """Facts and the tables that are shown, their headings one level further down."""
    for level, heading, body in _blocks(table):
        if level == 1:
            yield body
        elif heading in _SHOWN:
            yield f"{'#' * (level + 1)} {heading}\n\n{body}"
        elif level == 2 and not body:
            yield f"### {heading}"


def _beside(table: str) -> Iterator[str]:
    """Solved by ecbs, in the paper and here."""
    yield "| cell | paper, 1800 s | here |"
    yield "| --- | ---: | ---: |"
    cell = ""
    for level, heading, body in _blocks(table):
        cell = heading if level == 2 else cell
        row = re.search(r"^\| ecbs \| ([^|]*) \|", body, re.MULTILINE)
        if heading == _SHOWN[2] and cell in _PAPER_ECBS_FAILED and row:
            yield f"| {cell} | {100 - _PAPER_ECBS_FAILED[cell]} % | {row[1]} |"


def _blocks(text: str) -> Iterator[tuple[int, str, str]]:
    """Level, heading and what stands below it, up to the next heading of any level."""
    parts = re.split(r"^(#+) (.*)$", text, flags=re.MULTILINE)[1:]
    for hashes, heading, body in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        yield len(hashes), heading, body.strip()


if __name__ == "__main__":
    run_script(main)
