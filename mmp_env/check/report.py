"""The report of a check: violations, and the proved clearances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

RULES = (
    "schema",
    "shape",
    "finite",
    "times",
    "length",
    "start",
    "goal",
    "limits",
    "speed",
    "rates",
    "acceleration",
    "jerk",
    "upright",
    "arm-obstacle",
    "self",
    "arm-arm",
)
"""Names of all rules, in the order of their checks."""


_KINDS = {"arms": "between arms", "obstacles": "to obstacles", "self": "between parts of one arm"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Violation:
    """One broken rule.

    `message` is a sentence, `time_s` [s] the worst instant, `arms` the arms involved, `values` the numbers behind it.
    """

    rule: str
    message: str
    time_s: float | None = None
    arms: tuple[str, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.rule}: {self.message}"

    def __repr__(self) -> str:
        return f"<Violation {self}>"

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields as JSON values."""
        return {
            "rule": self.rule,
            "message": self.message,
            "time_s": self.time_s,
            "arms": list(self.arms),
            "values": {key: _number(value) for key, value in self.values.items()},
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckReport:
    """The result of `check_plan` and `check_document`. The report is true if the plan is valid.

    Attributes:
        violations: the broken rules.
        min_clearance_m: the least clearance [m] proved for all instants; None if the proof failed or was not tried.
        found_clearance_m: the least clearance [m] found at an instant. The true least clearance lies between these two.
        where: the two bodies of the least clearance found.
        time_s: the time [s] of the least clearance found.
        spheres: the sphere set of the check, or `geoms` for an exact check.
        margin_m: `problem.margin` of the file [m].
        margins_m: the margins [m] that the plan must keep: `arms`, `obstacles`, `self`.
        proved_m: the clearances [m] proved, by kind of margin; None for a kind without pairs.
        found_m: the least clearances [m] found at an instant, by kind of margin; infinity for a kind without pairs.
        required_m: the least clearance [m] that had to be proved.
        instants: number of configurations of the whole cell that were placed.
        may_touch: moving links and obstacles that may touch, which no check tests.
    """

    violations: tuple[Violation, ...]
    min_clearance_m: float | None = None
    found_clearance_m: float | None = None
    where: str = ""
    time_s: float | None = None
    spheres: str | None = None
    margin_m: float | None = None
    margins_m: Mapping[str, float] | None = None
    proved_m: Mapping[str, float | None] | None = None
    found_m: Mapping[str, float] = field(default_factory=dict)
    required_m: float | None = None
    instants: int = 0
    may_touch: tuple[tuple[str, str], ...] = ()

    @property
    def valid(self) -> bool:
        """Whether the plan breaks no rule; also what the report is as a truth value."""
        return not self.violations

    def __bool__(self) -> bool:
        return self.valid

    @property
    def not_tested(self) -> list[str]:
        """Words on every pair that may touch."""
        return [f"{link} and {obstacle}, which may touch" for link, obstacle in self.may_touch]

    @property
    def sentences(self) -> list[str]:
        """A sentence for every violation."""
        return list(map(str, self.violations))

    def as_dict(self) -> dict[str, Any]:
        """Returns the report as JSON values."""
        return {
            "valid": self.valid,
            "violations": [violation.as_dict() for violation in self.violations],
            "min_clearance_m": self.min_clearance_m,
            "found_clearance_m": self.found_clearance_m,
            "where": self.where,
            "time_s": self.time_s,
            "spheres": self.spheres,
            "margin_m": self.margin_m,
            "margins_m": None if self.margins_m is None else dict(self.margins_m),
            "proved_m": None if self.proved_m is None else dict(self.proved_m),
            "required_m": self.required_m,
            "instants": self.instants,
            **({"may_touch": [list(pair) for pair in self.may_touch]} if self.may_touch else {}),
        }

    def __repr__(self) -> str:
        return f"<CheckReport {self if self.valid else in_short(self.sentences)}>"

    def __str__(self) -> str:
        if not self.valid:
            return "\n".join(self.sentences)
        if self.min_clearance_m is None:  # a lone arm without obstacles or self pairs
            return "valid; nothing to touch"
        if self.spheres == "geoms":
            return (
                f"valid; no two geoms touch, clearance >= {self.min_clearance_m * 1e3:.2f} mm at every instant, least "
                f"between {self.where}; the margins are checked without --exact"
            )
        if self.proved_m and self.margins_m and len(set(self.margins_m.values())) > 1:
            proved = [f"{m * 1e3:.2f} mm {_KINDS[kind]}" for kind, m in self.proved_m.items() if m is not None]
            return f"valid; clearance at every instant >= {', '.join(proved)}"
        return f"valid; clearance >= {self.min_clearance_m * 1e3:.2f} mm at every instant, least between {self.where}"


def in_short(sentences: list[str]) -> str:
    """Returns the first violation, and how many others there are."""
    more = f" (and {len(sentences) - 1} more)" if len(sentences) > 1 else ""
    return f"invalid; {sentences[0]}{more}"


def _number(value: Any) -> Any:
    """Returns a value for JSON, which has no infinity and no NaN: None instead."""
    return None if isinstance(value, float) and not np.isfinite(value) else value
