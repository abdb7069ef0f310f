"""The parts of an arm, each of which moves as one piece: its links, the tool, and what it holds."""

from __future__ import annotations

from mmp_env.model.arm import Arm
from mmp_env.model.held import HELD


def part_names(arm: Arm) -> tuple[str, ...]:
    """Names of the parts in the order of the core: links from the base on, tool, `held`."""
    return arm.robot.link_names + ((arm.tool.name,) if arm.tool else ()) + ((HELD,) if arm.held else ())


def untested_pairs(arm: Arm, sphere_set: str) -> set[frozenset[str]]:
    """Names of the parts that may overlap: what the sphere set leaves out, and a held object with what holds it."""
    links = arm.robot.link_names
    out = {frozenset((links[i], links[j])) for i, j in arm.robot.self_ignore[sphere_set]}
    if arm.tool is not None:
        out |= {frozenset((link, arm.tool.name)) for link in arm.tool.self_ignore[sphere_set]}
    if arm.held is not None:
        holding = (links[-1], arm.tool.name) if arm.tool else links[-1:]
        out |= {frozenset((part, HELD)) for part in holding}
    return out
