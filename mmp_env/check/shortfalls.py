"""Shortfalls as violations: one for every two arms, arm and obstacle, or single arm, at its worst instant."""

from __future__ import annotations

from mmp_env.check.report import Violation
from mmp_env.check.sweep import Shortfall, Sweep


def shortfall_violations(result: Sweep) -> list[Violation]:
    """Returns a violation for each group of pairs that a sweep found too close, or could not prove apart."""
    groups: dict[tuple, list[Shortfall]] = {}
    for shortfall in result.shortfalls:
        touch = shortfall.touch
        solid = touch.things[1] if touch.rule == "arm-obstacle" else ""
        groups.setdefault((touch.rule, touch.arms, solid), []).append(shortfall)
    # A clearance found at an instant says more than one that was only not excluded.
    worst = [min(group, key=lambda shortfall: (not shortfall.found, shortfall.clearance)) for group in groups.values()]
    pairs = zip(worst, groups.values(), strict=True)
    return [_violation(shortfall, group) for shortfall, group in sorted(pairs, key=lambda p: p[0].time)]


def _violation(worst: Shortfall, group: list[Shortfall]) -> Violation:
    first, last = (edge(shortfall.time for shortfall in group) for edge in (min, max))
    one, other = worst.touch.things
    span = "" if first == last else f" (too close from {first:.3f} to {last:.3f} s)"
    if not worst.found and worst.clearance < 0:
        text = f"not proved: {one} and {other} may overlap by {-worst.clearance * 1e3:.2f} mm"
    elif not worst.found:
        text = f"not proved: {one} and {other} may come as close as {worst.clearance * 1e3:.4f} mm"
    elif worst.clearance < 0:
        text = f"{one} and {other} overlap by {-worst.clearance * 1e3:.2f} mm"
    else:
        text = f"{one} and {other} come as close as {worst.clearance * 1e3:.4f} mm"
    return Violation(
        rule=worst.touch.rule,
        message=f"{text} at {worst.time:.3f} s{span}; {worst.required * 1e3:.4f} mm are required",
        time_s=worst.time,
        arms=worst.touch.arms,
        values={
            "things": [one, other],
            "clearance_m": worst.clearance,
            "required_m": worst.required,
            "from_s": first,
            "to_s": last,
            "found": worst.found,
        },
    )
