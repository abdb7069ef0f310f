"""Writes measured figures into README.md and docs, as tables and in the text. Usage: readme_table.py [--check]

`measured.py` reads the figures, `quoted.py` writes them into sentences. A table stands between
`<!-- table: NAME -->` and `<!-- end of table -->`. With --check the script writes nothing, and the exit
code is 1 if a page is out of date.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from measured import RESULTS, ROOT, Figures, read_figures
from planner_tables import (
    NOT_MEASURED,
    TASKS,
    as_table,
    gallery_table,
    node_table,
    option_table,
    repulsion_table,
    task_table,
)
from quoted import quoted, seconds
from written_pages import bring_up_to_date, checking_parser, filled

from mmp_cli.main import run_script
from mmp_env.gym.registration import ANY_CELL

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*/*.md")), *sorted((ROOT / "docs").glob("*/*.ipynb")))

WRITTEN_ELSEWHERE = (ROOT / "docs" / "reference" / "planners.md", RESULTS / "README.md")
"""Pages that planners_page.py and results_page.py write."""
_DRAWN_CELLS = ("mixed-4", "ring-4", "ring-4-panda", "ring-6", "ring-8")
_RINGS = tuple(f"MultiArmCell-{arms}" for arms in (2, 4, 6, 8))
ENVIRONMENT = {
    "`step` against as many bare `mj_step` calls": ("env_step", "ratio", ".2f"),
    "`step` [ms], of 0.1 s simulated": ("env_step", "value", ".1f"),
    "`reset` to a given instance, validated [ms]": ("env_reset_given", "value", ".1f"),
    "`reset` that draws its instance [ms]": ("env_reset_drawn", "value", ".1f"),
    "`execute`, for a simulated second [ms]": ("execute_per_simulated_second", "value", ".0f"),
}
"""Figure, key of its line, and format of each row."""
CORE = {
    "cell_check_8x28": "kinematics and least clearance over the 28 pairs of 8 UR5e, in a batch, a state",
    "cell_check_8x28_single_state": "the same, one state at a time",
    "conflicts_8_arms": "all conflicts of 8 motions, proved between the steps",
    "force_field_one_of_8_arms": "the repulsive force on one motion from 7 others",
    "certificate_8_arms": "the certificate of a plan for 8 arms",
    "MultiArmCell-8/env_reset_given": "`reset` of `MultiArmCell-8` to a given instance",
    "MultiArmCell-8/env_step": "`step` of `MultiArmCell-8`",
    "import": "`import mmp_env, mmp_planners` beyond MuJoCo and Gymnasium",
}
"""Description of each figure."""


def main() -> None:
    """Writes the pages, or reports that they are out of date."""
    check = checking_parser("readme_table.py", __doc__).parse().check
    figures = read_figures()
    texts = {page: page.read_text(encoding="utf-8") for page in PAGES}
    pages = {
        page: quoted(filled(text, lambda name: TABLES[name](figures)), figures)
        for page, text in texts.items()
        if page not in WRITTEN_ELSEWHERE
    }
    bring_up_to_date(pages, check=check)


def draw_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the median and largest time to draw an instance."""
    yield ["cell", *(f"`{task}`" for task in TASKS)]
    for cell in _DRAWN_CELLS:
        rows = [figures.get(f"{cell}/{task}/draw") for task in TASKS]
        yield [f"`{cell}`", *(f"{row['value']:.2f}, {row['max']:.2f}" if row else NOT_MEASURED for row in rows)]


def environment_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the times of the environment, and their ratio to plain physics."""
    yield ["", *(f"`{ring.removeprefix('MultiArmCell')}`" for ring in _RINGS)]
    for words, (name, key, form) in ENVIRONMENT.items():
        rows = [figures.get(f"{ring}/{name}") for ring in _RINGS]
        yield [words, *(_in_ms(row, key, form) if row else NOT_MEASURED for row in rows)]


def _in_ms(row: dict[str, Any], key: str, form: str) -> str:
    return format(row[key] / (1e3 if key == "value" and row["unit"] == "us" else 1.0), form)


_RETIME_HEAD = (
    "ratio, median / largest",
    "processor time [ms], median / largest",
    "largest deviation [rad]",
    "valid",
    "goals reached, contacts",
    "tracking error [rad]",
    "torque",
)


def retime_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the results of retimed plans and their executions."""
    yield ["", *_RETIME_HEAD]
    names = [f"retime_{ring}" for ring in _RINGS[1:]] + [f"retime_MultiArmCell-mixed-4_{task}" for task in TASKS]
    for name in names:

        def value(what: str, form: str, name: str = name) -> str:
            return format(figures[f"{name}_{what}"]["value"], form)

        valid = figures[f"{name}_valid"]
        yield [
            "`-" + name.removeprefix("retime_MultiArmCell-").replace("_", "`, ") + ("" if "_" in name[7:] else "`"),
            f"{value('ratio_median', '.3f')} / {value('ratio_max', '.3f')}",
            f"{value('cpu_ms_median', '.0f')} / {value('cpu_ms_max', '.0f')}",
            value("deviation_rad_max", ".3f"),
            f"{valid['value']} of {valid['of']}",
            f"{value('executed_after_reached', 'd')}, {value('executed_after_contacts', 'd')}",
            value("executed_after_tracking_max", ".5f"),
            value("executed_after_torque_share_max", ".2f"),
        ]


def recording_table(figures: Figures) -> Iterator[list[str]]:
    """Yields size and time of recordings."""
    yield ["search", "expanded nodes", "file", "added to planning"]
    for name, row in figures.items():
        what, _, planner = name.partition("/")
        if what == "recording_size":
            added = figures[f"recording_time_added/{planner}"]["value"]
            yield [f"`{planner}`", str(row["expanded_nodes"]), f"{row['value']:.1f} MB", f"{added:.1f} s"]


def lateness_table(figures: Figures) -> Iterator[list[str]]:
    """Yields how late each planner returned, how many runs the limit ended, and the longest such limit."""
    ended = ("runs that the limit ended", "longest such limit [s]")
    yield ["planner", "8 Pandas: 99th percentile, largest [ms]", *ended, "64 arms: largest [ms]", *ended]
    for name, pandas in figures.items():
        head, _, planner = name.partition("ring-8-panda_")
        if head == "lateness_" and (crowd := figures.get(f"lateness_crowd_{planner}")):
            late = (f"{pandas['value']:.1f}, {pandas['worst_ms']:.1f}", f"{crowd['worst_ms']:.1f}")
            yield [f"`{planner}`", late[0], *_ended(pandas), late[1], *_ended(crowd)]


def _ended(row: dict[str, Any]) -> tuple[str, str]:
    count = f"{row['reached_limit']} of {row['runs']}" if "reached_limit" in row else NOT_MEASURED
    return count, format(row["longest_limit_s"], "g") if "longest_limit_s" in row else NOT_MEASURED


def core_table(figures: Figures) -> Iterator[list[str]]:
    """Yields the times of small operations, and how they compare."""
    yield ["operation", "time", "compared"]
    scale = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
    for name, words in CORE.items():
        figure = figures.get(name)
        if figure is not None:
            compared = ""
            if "ratio" in figure:
                # Against MuJoCo's own collision test a ratio says how many times faster, elsewhere how much longer.
                relation = "times as fast as" if figure["ratio_to"].startswith("mj_kin") else "times the time of"
                compared = f"{figure['ratio']:.2g} {relation} `{figure['ratio_to']}`"
            yield [words, seconds(figure["value"] * scale[figure["unit"]]), compared]


def cpu_line(figures: Figures) -> Iterator[list[str]]:
    """Yields the processors of the measurements in cells with an id."""
    yield sorted({figure["cpu"] for name, figure in figures.items() if name.startswith(ANY_CELL) and "cpu" in figure})


TABLES = {
    "gallery": gallery_table,
    "nodes": lambda figures: as_table(node_table(figures)),
    "tasks": lambda figures: as_table(task_table(figures)),
    "draws": lambda figures: as_table(draw_table(figures)),
    "environment": lambda figures: as_table(environment_table(figures)),
    "retime": lambda figures: as_table(retime_table(figures)),
    "recordings": lambda figures: as_table(recording_table(figures)),
    "repulsion": lambda figures: as_table(repulsion_table(figures)),
    "options": lambda figures: as_table(option_table(figures)),
    "lateness": lambda figures: as_table(lateness_table(figures)),
    "core": lambda figures: as_table(core_table(figures)),
    "cpu": lambda figures: "; ".join(next(cpu_line(figures))) + "\n",
}

if __name__ == "__main__":
    run_script(main)
