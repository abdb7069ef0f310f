"""Contacts as violations: one for every two arms, arm and obstacle, or arm by itself, at its worst."""

from __future__ import annotations

from mmp_env.check.report import Violation
from mmp_env.check.sweep import Contact, Sweep


def contact_violations(result: Sweep) -> list[Violation]:
    """What a sweep found too close, or could not prove apart."""
    groups: dict[tuple, list[Contact]] = {}
    for contact in result.contacts:
        touch = contact.touch
        solid = touch.things[1] if touch.rule == "arm-obstacle" else ""
        groups.setdefault((touch.rule, touch.arms, solid), []).append(contact)
    # What was met at an instant tells more than what was only not excluded.
    worst = [min(group, key=lambda contact: (not contact.found, contact.clearance)) for group in groups.values()]
    pairs = zip(worst, groups.values(), strict=True)
    return [_violation(contact, group) for contact, group in sorted(pairs, key=lambda p: p[0].time)]


def _violation(worst: Contact, group: list[Contact]) -> Violation:
    first, last = (edge(contact.time for contact in group) for edge in (min, max))
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
