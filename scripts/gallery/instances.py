"""Choice of the instances in the pictures, by rules that do not depend on how a picture looks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import mmp_planners
from mmp_env import MmpError, draw_instance, make_problem, ring_cell
from mmp_env.events import Event
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.view.search_tree import SearchTree

ARMS = 8
SEEDS = range(50)
"""Seeds of the figures in docs/results/figures.jsonl."""
SMALL = range(3, 11)
_TIME_LIMIT_S = 60.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """A planner's run on the instance of a seed: its events, its tree and its plan."""

    planner: str
    seed: int
    problem: Problem
    events: list[Event]
    tree: SearchTree
    plan: Plan

    @property
    def expanded(self) -> int:
        """Returns the number of expanded nodes."""
        return len(self.tree.expansions)


def search(planner: str, seed: int, arms: int = ARMS, options: Mapping[str, str] | None = None) -> Search:
    """Plans the instance `seed` of a ring of UR5e. Raises `MmpError` if no plan is found."""
    cell = ring_cell(arms)
    problem = make_problem(cell, *draw_instance(cell, seed=seed), name=f"MultiArmCell-{arms}, seed {seed}")
    tree, events = SearchTree(problem, title=planner, keep_paths=True), []

    def watch(event: Event) -> None:
        events.append(event)
        tree(event)

    plan = (
        mmp_planners.make(planner, **(options or {}))
        .plan(problem, seed=seed, time_limit=_TIME_LIMIT_S, watch=watch)
        .plan
    )
    if plan is None:
        raise MmpError(f"{planner} finds no plan for {problem.name} in {_TIME_LIMIT_S:g} s")
    return Search(planner=planner, seed=seed, problem=problem, events=events, tree=tree, plan=plan)


def first_small(seeds: Iterable[int] = SEEDS, arms: int = ARMS) -> Search:
    """Returns the first search of apf-ecbs with one tree of 3 to 10 nodes whose solution comes through the fast track.

    Readers can follow such a small tree, and it has everything that the paper adds.
    """
    for seed in seeds:
        run = search("apf-ecbs", seed, arms)
        tree = run.tree
        small = len(tree.roots) == 1 and len(tree.nodes) in SMALL
        if small and any(node.fast_track for node in tree.solution_path):
            return run
    raise MmpError("none of the seeds has a small tree whose solution comes through the fast track")


def typical(ratio: float, seeds: Iterable[int] = SEEDS, arms: int = ARMS) -> tuple[Search, Search]:
    """Returns ecbs and apf-ecbs on the seed whose ratio of expanded nodes is closest to `ratio`.

    Searches of apf-ecbs that expand no node have no ratio. Raises `MmpError` if there are no others.
    """
    # A generator keeps the best pair only: the events of a search hold all its paths.
    pairs = ((search("ecbs", seed, arms), search("apf-ecbs", seed, arms)) for seed in seeds)
    branched = (pair for pair in pairs if pair[1].expanded > 0)
    best = min(branched, key=lambda pair: abs(pair[0].expanded / pair[1].expanded - ratio), default=None)
    if best is None:
        raise MmpError("apf-ecbs expands a node for none of the seeds")
    return best
