"""The claims of the paper beside our results: verdicts that follow from the kept benchmarks by one rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import claim_reasons as reasons
from measured import kept_sections
from paired import Pair, Ratio, pair

from mmp_cli.reporting.formatting import NOTHING

LITERAL_TRACK = ("apf-ecbs-nf", "literal-track")
"""Labels without a fast track, and with the fast track of the paper."""
CLOSE = 0.05
"""Largest relative difference of two costs that are close to each other."""
CHANCE = 0.05
"""Largest probability of an outcome by chance with which a claim on success holds, or does not."""


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
        reason = reasons.LITERAL_TRACK if words == "saves nodes" else reasons.SAME
        claim = Claim(
            words=f"the paper's fast track {words}, with our other defaults",
            labels=lambda _: LITERAL_TRACK,
            judge=judge,
            reason=reason,
        )
        pairs = literal_track(folder) if words == "saves nodes" else literal_track(folder, ("track",))
        yield [claim.words, "see above", judged(claim, pairs), claim.reason]


def literal_track(folder: Path, names: Sequence[str] = ("literal", "track")) -> list[Pair]:
    """Returns the fast track of the paper beside none, with our other defaults, in each cell where it was run.

    On the cell of four (`literal`), the runs without a fast track are those of `cells`, on the same instances. Their
    times were measured at another time, so they do not compare.
    """
    without, ours = LITERAL_TRACK
    runs = {
        section.name: run for section in kept_sections(folder / "cells") for run in section.runs if run.label == without
    }
    out = []
    for name in names:
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
    """Returns yes if the whole interval of a ratio is above 1, no if its upper end is 1 or less, and open otherwise."""
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
    """Judges by a sign test of the instances that only one of both planners solves."""
    theirs, ours = set(each.theirs.by_problem), set(each.ours.by_problem)
    lost, won = len(theirs - ours), len(ours - theirs)
    word = "yes" if significant(won, lost) else "no" if significant(lost, won) else "open" if won + lost else "equal"
    figure = f"{len(ours)} ({len(theirs)}) of {len(each.ours.valid)}"
    return word, f"{figure}, only by one {won} ({lost})" if won + lost else figure


def significant(wins: int, losses: int) -> bool:
    """Returns whether one side wins more often than chance explains.

    If each side won with a probability of one half, at least `wins` of all wins would have a probability of at most
    `CHANCE`.
    """
    count = wins + losses
    return count > 0 and sum(math.comb(count, k) for k in range(wins, count + 1)) <= CHANCE * 2**count


def shown(ratio: Ratio | None) -> str:
    """Returns a ratio with three digits, or a dash."""
    return NOTHING if ratio is None else f"{ratio.value:#.3g}"


CLAIMS = (
    Claim(
        words="fewer expanded nodes than ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("expanded_nodes"),
        reason=reasons.NODES,
    ),
    Claim(
        words="faster than ECBS, mean",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("planning_time_s"),
        reason=reasons.TIME,
    ),
    Claim(
        words="faster than ECBS, median",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("planning_time_s", median=True),
        reason=reasons.SAME,
    ),
    Claim(
        words="solves more than ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=more_solved,
        reason=reasons.SUCCESS,
    ),
    Claim(
        words="the fast track saves nodes",
        labels=lambda planners: (planners.no_fast_track, planners.ours),
        judge=larger("expanded_nodes"),
        reason=reasons.FAST_TRACK,
    ),
    Claim(
        words="the fast track saves time, mean",
        labels=lambda planners: (planners.no_fast_track, planners.ours),
        judge=larger("planning_time_s"),
        reason=reasons.SAME,
    ),
    Claim(
        words="the fast track saves time, median",
        labels=lambda planners: (planners.no_fast_track, planners.ours),
        judge=larger("planning_time_s", median=True),
        reason=reasons.SAME,
    ),
    Claim(
        words="Gen-ECBS expands fewer nodes than ECBS",
        labels=lambda planners: (planners.ecbs, planners.gen_ecbs),
        judge=larger("expanded_nodes"),
        reason=reasons.GEN_ECBS_AND_ECBS,
    ),
    Claim(
        words="Gen-ECBS expands more nodes than APF-ECBS",
        labels=lambda planners: (planners.gen_ecbs, planners.ours),
        judge=larger("expanded_nodes"),
        reason=reasons.GEN_ECBS_AND_OURS,
    ),
    Claim(
        words="shorter makespan than ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=larger("makespan_s"),
        reason=reasons.MAKESPAN,
    ),
    Claim(
        words="cost close to that of ECBS",
        labels=lambda planners: (planners.ecbs, planners.ours),
        judge=closeness,
        reason=reasons.COST,
    ),
)
