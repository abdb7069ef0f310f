"""With a complete constraint kind and shortest paths, a solution costs at most w times the optimum.

The arms are pebbles on a small grid, so all motions can be enumerated. A move takes one step; two pebbles never share
or swap places.
"""

import heapq
from itertools import count, product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.arms_on_a_line import PROVED, ArmsOnALine, path, tree

from mmp_env import core
from mmp_planners.planning_context import Path

MOVES = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
_MOTION = path(0).motion


def neighbours(free, place):
    """Returns the places of a pebble one step later."""
    return [to for dx, dy in MOVES if (to := (place[0] + dx, place[1] + dy)) in free]


class Pebbles(ArmsOnALine):
    """Pebbles whose paths cost one unit per step until they stay at the goal; `forbidden` holds the constraints."""

    def __init__(self, free, starts, goals):
        super().__init__(*[()] * len(starts))
        self.free, self.starts, self.goals = free, starts, goals
        self.forbidden = {}  # constraint -> (step, place) or (step, place, next place)

    def low_level(self, arm, constraints, seed, budget=1.0, others=(), experience=None):
        rules = {self.forbidden[c] for c in constraints}
        last = max((rule[0] for rule in rules), default=0)
        lasting = max((rule[0] + 1 for rule in rules if rule[1:] == (self.goals[arm],)), default=0)
        reached = {self.starts[arm]: [self.starts[arm]]}
        for step in range(last + len(self.free) + 2):
            if step >= lasting and self.goals[arm] in reached:
                q = np.array(reached[self.goals[arm]], dtype=float)
                return Path(q=q, motion=_MOTION, length=float(step)), step
            reached = {
                to: [*path, to]
                for place, path in reached.items()
                for to in neighbours(self.free, place)
                if (step + 1, to) not in rules and (step, place, to) not in rules
            }
        return None, last

    def conflicts(self, paths, pairs):
        found = {}
        for a, b in pairs:
            instants = []
            for k in range(max(paths[a].last, paths[b].last) + 1):
                (a0, a1), (b0, b1) = ([tuple(paths[arm].at(t)) for t in (k, k + 1)] for arm in (a, b))
                if a0 == b0:
                    instants.append(float(k))
                elif (a0, a1) == (b1, b0):
                    instants.append(k + 0.5)
            if instants:
                found[a, b] = np.array(instants)
        return found

    def certify(self, plan):
        return PROVED


class NotThere:
    """Forbids the place at that step, or that move if two swap places. Each solution keeps it for one of the two."""

    def forbid(self, context, paths, interval, arm, instant):
        step = int(interval.first)
        places = [tuple(paths[arm].at(k)) for k in ((step,) if interval.first == step else (step, step + 1))]
        constraint = core.Constraint.ball(np.zeros(1), 0.1, 0, 1)
        context.forbidden[constraint] = (step, *places)
        return [constraint]

    def describe(self, context, interval, arm):
        return "not there"


def optimum(free, starts, goals):
    """Returns the least total cost by enumeration, or None if the pebbles cannot arrive."""
    n, order = len(starts), count()
    heap, seen = [(0, next(order), tuple(starts), (False,) * n)], set()
    while heap:
        cost, _, places, parked = heapq.heappop(heap)
        if all(parked):
            return cost
        if (places, parked) in seen:
            continue
        seen.add((places, parked))
        options = []
        for place, goal, is_parked in zip(places, goals, parked, strict=True):
            ends = [(place, True, 0)] if is_parked or place == goal else []
            options.append(ends if is_parked else [*ends, *((to, False, 1) for to in neighbours(free, place))])
        for choice in product(*options):
            after = tuple(to for to, *_ in choice)
            pairs = [(i, j) for i in range(n) for j in range(i)]
            if any(after[i] == after[j] or (after[i], after[j]) == (places[j], places[i]) for i, j in pairs):
                continue
            now = tuple(is_parked for _, is_parked, _ in choice)
            heapq.heappush(heap, (cost + sum(paid for *_, paid in choice), next(order), after, now))
    return None


@st.composite
def boards(draw):
    width, height, n = draw(st.sampled_from([(3, 3, 2), (4, 2, 2), (3, 2, 3)]))
    places = [(x, y) for x in range(width) for y in range(height)]
    walls = draw(st.sets(st.sampled_from(places), max_size=2))
    free = [place for place in places if place not in walls]
    starts, goals = (draw(st.permutations(free))[:n] for _ in range(2))
    return frozenset(free), starts, goals


@pytest.mark.parametrize("w", [1.0, 1.3])
@settings(max_examples=25)
@given(board=boards())
def test_the_solution_costs_at_most_w_times_the_optimum(w, board):
    least = optimum(*board)
    assume(least is not None)
    search = tree(Pebbles(*board), w=w, branching=NotThere(), patience=10**9)
    assert not search.run(0)
    assert least <= search.best.cost <= w * least
    assert search.best.cost == pytest.approx(least) or w > 1


def test_two_pebbles_in_a_corridor_pass_each_other_in_its_bay():
    free = frozenset([(0, 0), (1, 0), (2, 0), (3, 0), (2, 1)])
    starts, goals = [(0, 0), (3, 0)], [(3, 0), (0, 0)]
    search = tree(Pebbles(free, starts, goals), branching=NotThere(), patience=10**9)
    assert not search.run(0)
    assert search.best.cost == optimum(free, starts, goals) == 8
    plan = search.best.plan.positions
    assert {name: tuple(q[-1]) for name, q in plan.items()} == {"a": (3, 0), "b": (0, 0)}
    assert not (plan["a"] == plan["b"]).all(axis=1).any()
