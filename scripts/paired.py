"""Two planners of a kept benchmark, compared on the instances that both solve."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

from resampling import interval

from mmp_cli.reporting.sections import PlannerRuns, Section, commonly_solved

LEAST_BOTH = 5
"""Least number of instances solved by both planners for which a ratio is shown."""


@dataclass(frozen=True, kw_only=True)
class Ratio:
    """Ratio of the means or medians of two planners, theirs to ours, with its 90 % interval."""

    value: float
    low: float
    high: float

    @property
    def above(self) -> bool:
        """Returns whether the whole interval is above 1."""
        return self.low > 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """A planner (`ours`) beside another one (`theirs`) in one cell."""

    section: Section
    theirs: PlannerRuns
    ours: PlannerRuns

    @property
    def both(self) -> tuple[tuple[str, int], ...]:
        """Returns the problems that both solve."""
        return commonly_solved([self.theirs, self.ours])

    def ratio(self, field: str, *, median: bool = False) -> Ratio | None:
        """Returns the ratio of a field, or None where both solve too few instances."""
        if len(self.both) < LEAST_BOTH:
            return None
        theirs, ours = (
            [getattr(run.by_problem[problem], field) for problem in self.both] for run in (self.theirs, self.ours)
        )
        over = statistics.median if median else sum
        # The planner may expand no node at all. Then we divide by 1, as if it had expanded one on one instance.
        least = 1.0 if field == "expanded_nodes" else 0.0
        low, high = interval(theirs, ours, least=least, median=median)
        return Ratio(value=over(theirs) / max(over(ours), least), low=low, high=high)


def pair(section: Section, theirs: str, ours: str) -> Pair | None:
    """Returns the pair of two labels, or None if the cell has no runs of one of them."""
    runs = {run.label: run for run in section.runs}
    if theirs not in runs or ours not in runs:
        return None
    return Pair(section=section, theirs=runs[theirs], ours=runs[ours])
