"""The claims of the paper beside our results: verdicts that follow from the kept benchmarks by one rule."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from measured import kept_sections
from paired import Pair, Ratio, pair

from mmp_cli.reporting.formatting import NOTHING

LITERAL_TRACK = ("apf-ecbs-nf", "literal-track")
"""Labels without a fast track, and with the fast track of the paper."""
CLOSE = 0.05
"""Largest relative difference of two costs that are close to each other."""


@dataclass(frozen=True, kw_only=True)
class Planners:
    """Labels of one benchmark folder: with repulsion, without the fast track, without repulsion, and Gen-ECBS."""

    folder: str
    ours: str
    no_fast_track: str
    ecbs: str
    gen_ecbs: str


COLUMNS = {
    "preset `paper`": Planners(
        folder="preset", ours="paper", no_fast_track="apf-ecbs-nf-paper", ecbs="ecbs-paper", gen_ecbs="gen-ecbs-paper"
    ),
    "our defaults": Planners(
        folder="cells", ours="apf-ecbs", no_fast_track="apf-ecbs-nf", ecbs="ecbs", gen_ecbs="gen-ecbs"
    ),
}
"""Settings that the claims are judged for."""


def claims_table(folder: Path) -> Iterator[list[str]]:
    """Yields each claim, its verdict with each setting, and the figures that explain it. `folder`: docs/results."""
    sections = {words: kept_sections(folder / planners.folder) for words, planners in COLUMNS.items()}
    yield ["claim", *COLUMNS, "reason"]
    for claim in CLAIMS:
        cells = []
        for words, planners in COLUMNS.items():
            pairs = [pair(section, *claim.labels(planners)) for section in sections[words]]
            cells.append(judged(claim, [each for each in pairs if each is not None]))
        yield [claim.words, *cells, claim.reason]
    for words, judge in (
        ("saves nodes", larger("expanded_nodes")),
        ("saves time, mean", larger("planning_time_s")),
        ("saves time, median", larger("planning_time_s", median=True)),
    ):
        claim = Claim(
            words=f"the paper's fast track {words}, with our other defaults",
            labels=lambda _: LITERAL_TRACK,
            judge=judge,
        )
        yield [claim.words, "see above", judged(claim, literal_track(folder)), _TRACK_REASON]


def literal_track(folder: Path) -> list[Pair]:
    """Returns the fast track of the paper beside none, with our other defaults, in each cell where it was run.

    On the cell of four, the runs without a fast track are those of `cells`, on the same instances.
    """
    without, ours = LITERAL_TRACK
    runs = {
        section.name: run for section in kept_sections(folder / "cells") for run in section.runs if run.label == without
    }
    out = []
    for name in ("literal", "track"):
        for section in kept_sections(folder / name) if (folder / name / "results.jsonl.gz").is_file() else ():
            labels = {run.label: run for run in section.runs}
            theirs = labels.get(without, runs.get(section.name))
            if ours in labels and theirs is not None:
                out.append(Pair(section=section, theirs=theirs, ours=labels[ours]))
    return out


def summary(rows: Sequence[Sequence[str]]) -> str:
    """Returns how many claims of the table have the same verdict in all cells, with each setting."""
    sentences = []
    for column, words in enumerate(COLUMNS, start=1):
        cells = [row[column] for row in rows if "**" in row[column]]
        yes, no = (sum(cell.startswith(f"**{word}**") for cell in cells) for word in ("yes", "no"))
        sentences.append(f"With {words}, {yes} of {len(cells)} rows are **yes** in every cell, and {no} **no**.")
    return "\n" + "\n".join(sentences) + "\n"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A claim of the paper: what it says of which planners, how it is judged, and measured reasons with marks."""

    words: str
    labels: Callable[[Planners], tuple[str, str]]
    judge: Callable[[Pair], tuple[str, str]]
    reason: str = "not measured"


def judged(claim: Claim, pairs: Sequence[Pair]) -> str:
    """Returns the verdict of a claim, one word if all cells agree, with the figure of each cell."""
    if not pairs:
        return "not measured"
    words, figures = zip(*map(claim.judge, pairs), strict=True)
    if len(set(words)) == 1:
        return f"**{words[0]}**: {', '.join(figures)}"
    parts = (
        f"{each.section.arms} arms **{word}**: {figure}"
        for each, word, figure in zip(pairs, words, figures, strict=True)
    )
    return "; ".join(parts)


def verdict(ratio: Ratio | None) -> str:
    """Returns yes or no if the whole interval of a ratio is above 1 or not, and open if it contains 1."""
    if ratio is None:
        return "open"
    return "yes" if ratio.above else "no" if ratio.high <= 1 else "open"


def larger(field: str, *, median: bool = False) -> Callable[[Pair], tuple[str, str]]:
    """Returns the judge of a claim that our planner has less of a field than the other one."""

    def judge(each: Pair) -> tuple[str, str]:
        ratio = each.ratio(field, median=median)
        return verdict(ratio), shown(ratio)

    return judge


def closeness(each: Pair) -> tuple[str, str]:
    """Judges whether both planners' costs are close."""
    ratio = each.ratio("cost_rad")
    if ratio is None:
        return "open", NOTHING
    inside = ratio.low >= 1 - CLOSE and ratio.high <= 1 + CLOSE
    outside = ratio.high < 1 - CLOSE or ratio.low > 1 + CLOSE
    return "yes" if inside else "no" if outside else "open", shown(ratio)


def more_solved(each: Pair) -> tuple[str, str]:
    """Judges by the counts whether our planner solves more instances."""
    theirs, ours = len(each.theirs.solved), len(each.ours.solved)
    word = "yes" if ours > theirs else "no" if ours < theirs else "equal"
    return word, f"{ours} ({theirs}) of {len(each.ours.valid)}"


def shown(ratio: Ratio | None) -> str:
    """Returns a ratio with three digits, or a dash."""
    return NOTHING if ratio is None else f"{ratio.value:#.3g}"


def _quoted(expression: str, form: str) -> str:
    return f"<!-- figure: {expression} as {form} --><!-- end -->"


def _shortened(planner: str) -> str:
    """Returns the quoted ratios of the costs of a planner without and with `shorten=400`."""
    return ", ".join(_quoted(f"repulsion/{planner} shorten=400/cost_ring-{n}#ratio", ".3f") for n in (4, 6, 8))


_FOUR, _EIGHT = "literal/MultiArmCell-4", "cells/MultiArmCell-8"
_PER_NODE = {
    planner: _quoted(f"{cell}/{planner}/planning_time_mean / {cell}/{planner}/expanded_nodes_mean", "time")
    for cell, planners in ((_EIGHT, ("apf-ecbs", "ecbs")), ("preset/MultiArmCell-8", ("paper", "ecbs-paper")))
    for planner in planners
}
_NODES = {
    label: _quoted(f"{_FOUR}/{label}/expanded_nodes_mean", ".3g")
    for label in ("apf-ecbs", "gradient", "centre", "ecbs")
}
_BY_DISTANCE = _quoted("decisions/MultiArmCell-4/centre-distance/expanded_nodes_mean", ".3g")
_ECBS_COSTS = ", ".join(
    _quoted(f"cells/MultiArmCell-{n}/ecbs/cost_rad_where_both_solve#ratio", ".3f") for n in (4, 6, 8)
)
_TRACK = {label: _quoted(f"{_FOUR}/{label}/fast_track_hits", "of") for label in ("apf-ecbs", "one-arm", "paper")}
_HITS = ", ".join(_quoted(f"cells/MultiArmCell-{n}/apf-ecbs/fast_track_hits", "of") for n in (4, 6, 8))
_GEN_ECBS = ", ".join(
    _quoted(f"repulsion/gen-ecbs repulsion=fast-track/nodes_ring-{n}#ratio", ".3g") for n in (4, 6, 8)
)
_WITHOUT = _quoted("cells/MultiArmCell-4/apf-ecbs-nf/planning_time_mean", "time")
_TRACK_TIMES = {label: _quoted(f"{_FOUR}/{label}/planning_time_mean", "time") for label in ("one-arm", "literal-track")}
_TRACK_REASON = (
    f"`literal-track`, the fast track of the paper: mean time at 4 arms {_TRACK_TIMES['literal-track']}, "
    f"{_TRACK_TIMES['one-arm']} with `one-arm`, {_WITHOUT} without a fast track"
)
_KINDS = {
    kind: _quoted(f"kinds/MultiArmCell-4/{kind}/expanded_nodes_mean", ".3g")
    for kind in ("vertex", "avoid-state", "sphere", "split")
}
_PRESET = {
    label: _quoted(f"preset/MultiArmCell-4/{label}/expanded_nodes_mean", ".3g") for label in ("paper", "gen-ecbs-paper")
}
_AVOID_STATE = _quoted(f"{_FOUR}/paper-avoid-state/expanded_nodes_mean", ".3g")


def _waits(key: str) -> str:
    return ", ".join(_quoted(f"waits_ring-{n}{key}", ".1f") for n in (4, 6, 8))


CLAIMS = (
    Claim(
        words="fewer expanded nodes than ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("expanded_nodes"),
        reason=f"the distance and the step, at 4 arms: {_NODES['apf-ecbs']} nodes by default, {_NODES['gradient']} "
        f"with `step=gradient`, {_BY_DISTANCE} with `distance=centre`, {_NODES['centre']} with both, and "
        f"{_NODES['ecbs']} with `ecbs`",
    ),
    Claim(
        words="faster than ECBS, mean",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("planning_time_s"),
        reason=f"at 8 arms a node of `paper` takes {_PER_NODE['paper']} and one of `ecbs-paper` "
        f"{_PER_NODE['ecbs-paper']}; one of `apf-ecbs` {_PER_NODE['apf-ecbs']} and one of `ecbs` {_PER_NODE['ecbs']}, "
        "but there are fewer of the former",
    ),
    Claim(
        words="faster than ECBS, median",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("planning_time_s", median=True),
        reason="the same",
    ),
    Claim(
        words="solves more than ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=more_solved,
        reason=f"at 4 arms the baseline `ecbs` solves {_quoted(f'{_FOUR}/ecbs/solved', 'of')} with our defaults, "
        f"and {_quoted(f'{_FOUR}/ecbs-paper/solved', 'of')} with the settings of the paper",
    ),
    Claim(
        words="the fast track saves nodes",
        labels=lambda planners: (planners.no_fast_track, planners.ours),
        judge=larger("expanded_nodes"),
        reason=f"hits at 4 arms: {_TRACK['apf-ecbs']} attempts with the defaults, {_TRACK['one-arm']} with one arm, "
        f"{_TRACK['paper']} with `paper`",
    ),
    Claim(
        words="the fast track saves time, mean",
        labels=lambda planners: (planners.no_fast_track, planners.ours),
        judge=larger("planning_time_s"),
        reason=f"hits with our defaults at 4, 6 and 8 arms: {_HITS}",
    ),
    Claim(
        words="the fast track saves time, median",
        labels=lambda planners: (planners.no_fast_track, planners.ours),
        judge=larger("planning_time_s", median=True),
        reason="the same",
    ),
    Claim(
        words="Gen-ECBS expands fewer nodes than ECBS",
        labels=lambda planners: (planners.ecbs, planners.gen_ecbs),
        judge=larger("expanded_nodes"),
        reason="Gen-ECBS has several constraint kinds, `ecbs-paper` has `vertex`, and our `ecbs` has `avoid-state`; "
        f"`ecbs` with one kind at 4 arms: {_KINDS['vertex']} nodes with `vertex`, {_KINDS['avoid-state']} with "
        f"`avoid-state`, {_KINDS['sphere']} with `sphere`, {_KINDS['split']} with `split`",
    ),
    Claim(
        words="Gen-ECBS expands more nodes than APF-ECBS",
        labels=lambda planners: (planners.gen_ecbs, planners.ours),
        judge=larger("expanded_nodes"),
        reason=f"repulsion in `gen-ecbs` divides its nodes by {_GEN_ECBS}; at 4 arms `paper` has {_PRESET['paper']} "
        f"nodes with its constraint `vertex`, and {_AVOID_STATE} with `avoid-state` (50 instances); `gen-ecbs-paper` "
        f"has {_PRESET['gen-ecbs-paper']}",
    ),
    Claim(
        words="shorter makespan than ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("makespan_s"),
        reason=f"with our defaults the arm that arrives last waits {_waits('#waits_of_ecbs')} s in plans of `ecbs` and "
        f"{_waits('')} s in those of `apf-ecbs`, but it moves {_waits('#motion_of_ecbs')} s and {_waits('#motion')} s: "
        "repulsion replaces waits by detours",
    ),
    Claim(
        words="cost close to that of ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=closeness,
        reason=f"the cost of `ecbs` divided by that of `apf-ecbs`: {_ECBS_COSTS}; `shorten=400` divides the former by "
        f"{_shortened('ecbs')}, and the latter by {_shortened('apf-ecbs')}",
    ),
)
