"""Turns of the members of a portfolio: shares of the counted work."""

import pytest

from mmp_planners.portfolio.turns import Member, Turn


def worked(members, turns):
    """Returns the work of each member after some turns of 10 units, each of the member that waited least."""
    done = dict.fromkeys(members, 0)
    for _ in range(turns):
        name = min(members, key=lambda name: members[name].waited)
        members[name].count(next(members[name].turns))
        done[name] += 10
    return done


def member(turn, **changes):
    return Member(name="", turns=iter(lambda: turn, None), **changes)


def test_each_member_gets_its_share_of_the_work():
    done = worked({"a": member(Turn(10)), "b": member(Turn(10), share=3.0)}, 400)
    assert done["b"] == pytest.approx(3 * done["a"], abs=30)


def test_a_member_that_begins_later_lets_others_work_first():
    members = {"a": member(Turn(10)), "b": member(Turn(10), waited=100)}
    assert worked(members, 10) == {"a": 100, "b": 0}
    assert worked(members, 10) == {"a": 50, "b": 50}


def test_a_failed_attempt_halves_the_share():
    failing = member(Turn(10, failed=True))
    done = worked({"a": member(Turn(10)), "b": failing}, 20)
    assert failing.share == 0.5 ** (done["b"] / 10)
    assert done["b"] < 60
