"""Choice of the instances that a report shows pictures of, by the rule that it states."""

from __future__ import annotations

from dataclasses import dataclass

from mmp_cli.reporting.formatting import seconds
from mmp_cli.reporting.sections import Section
from mmp_env.wording import counted

RULE = (
    "Each picture of an instance shows its start, with the goals as ghosts. The time of an instance is that of the "
    "quickest planner. Quickest: the shortest time. Hardest: among those that the fewest planners have solved, the "
    "one with the longest time. Unsolved: among those that no planner has solved, the one with the most root "
    "conflicts, or else the first."
)


@dataclass(frozen=True, kw_only=True)
class Choice:
    """An instance to show: `kind` is part of a file name, `caption` says why it was chosen."""

    kind: str
    instance: str
    caption: str


def choose(section: Section) -> list[Choice]:
    """Returns at most three: the quickest, the hardest solved one, and an unsolved one."""
    best: dict[str, tuple[float, str]] = {}
    solvers: dict[str, set[str]] = {}
    for run in section.runs:
        for line in run.solved:
            if line.planning_time_s is not None:
                entry = line.planning_time_s, run.label
                best[line.instance] = min(best.get(line.instance, entry), entry)
                solvers.setdefault(line.instance, set()).add(run.label)
    out = []
    if best:
        quickest = min(best, key=lambda name: best[name])
        hardest = min(best, key=lambda name: (len(solvers[name]), -best[name][0]))
        by = f"by {len(solvers[hardest])} of {counted(len(section.runs), 'planner')}"
        if hardest == quickest:
            words = "Only solved" if len(best) == 1 else "Quickest and hardest solved"
            out.append(_solved("quickest", quickest, best[quickest], f"{words}, {by}"))
        else:
            out.append(_solved("quickest", quickest, best[quickest], "Quickest"))
            out.append(_solved("hardest", hardest, best[hardest], f"Hardest solved, {by}"))
    if section.solved_by_none:
        name = max(section.solved_by_none, key=lambda name: _root_conflicts(section, name))
        out.append(Choice(kind="unsolved", instance=name, caption=f"Unsolved: instance {_short(name)}."))
    return out


def _solved(kind: str, instance: str, best: tuple[float, str], words: str) -> Choice:
    caption = f"{words}: instance {_short(instance)}, in {seconds(best[0])} by {best[1]}."
    return Choice(kind=kind, instance=instance, caption=caption)


def _short(instance: str) -> str:
    return instance.partition("/")[2] or instance


def _root_conflicts(section: Section, instance: str) -> float:
    counts = [
        line.root_conflicts
        for run in section.runs
        for line in run.lines
        if line.instance == instance and line.root_conflicts is not None
    ]
    return sum(counts) / len(counts) if counts else -1.0
