"""Execution of an episode: its plans in a row, each from where the arms are at the end of the one before."""

from __future__ import annotations

from dataclasses import dataclass

from mmp_env.brief import brief
from mmp_env.files.episode_file import Episode
from mmp_env.sim.execution import ExecutionReport, execute_plan
from mmp_env.sim.simulation import Simulation
from mmp_env.wording import counted, in_seconds


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeExecution:
    """The result of an executed episode: one report per plan."""

    reports: tuple[ExecutionReport, ...]

    @brief
    def __repr__(self) -> str:
        goals = "every goal reached" if self.reached else "not every goal reached"
        plans = counted(len(self.reports), "plan")
        return f"of {plans}: {goals}, {counted(self.contacts, 'contact')}, {in_seconds(self.duration_s)}"

    @property
    def reached(self) -> bool:
        """Whether every plan began at its start and ended at its goal."""
        return all(report.reached and not report.moved_to_start for report in self.reports)

    @property
    def contacts(self) -> int:
        """Number of contacts in all plans."""
        return sum(len(report.contacts) for report in self.reports)

    @property
    def duration_s(self) -> float:
        """Simulated time of all plans [s]."""
        return sum(report.duration_s for report in self.reports)


def execute_episode(episode: Episode) -> EpisodeExecution:
    """Plays the plans of an episode in a row, and returns their reports.

    Each plan has its own scene, because objects move into the tools and out of them. Raises like `execute_plan`.
    """
    reports, standing = [], None
    for plan in episode.plans:
        simulation = Simulation(plan.problem.cell)
        simulation.place(simulation.joined(plan.problem.start if standing is None else standing))
        report = execute_plan(simulation, plan)
        standing = simulation.split(simulation.positions)
        reports.append(report)
    return EpisodeExecution(reports=tuple(reports))
