"""Planners without repulsion of their own take that of APF-ECBS as a part."""

import pytest

from mmp_env import draw_problem, find_cell
from mmp_env.errors import MmpError
from mmp_env.events import FastTracked, Repelled
from mmp_planners import make

CROWDED = 4
"""Seed of an instance of ring-4 with conflicts at the root."""


def planned(name, **options):
    events = []
    problem = draw_problem(find_cell("ring-4"), seed=CROWDED)
    result = make(name, **options).plan(problem, seed=1, watch=events.append)
    return result, {type(event) for event in events}


@pytest.mark.parametrize("name", ["cbs", "xecbs", "gen-ecbs"])
def test_repulsion_is_off_moves_paths_or_also_tries_the_fast_track(name):
    plain, without = planned(name)
    paths, with_paths = planned(name, repulsion="paths")
    track, with_track = planned(name, repulsion="fast-track")
    assert plain.plan
    assert paths.plan
    assert track.plan
    assert plain.stats["root_conflicts"] > 0
    assert not {Repelled, FastTracked} & without
    assert {Repelled, FastTracked} & with_paths == {Repelled}
    assert FastTracked in with_track
    assert make(name, repulsion="fast-track").parts(0).fast_track.on_children


def test_planners_with_repulsion_of_their_own_have_no_such_option():
    with pytest.raises(MmpError, match="repulsion"):
        make("apf-ecbs", repulsion="paths")
