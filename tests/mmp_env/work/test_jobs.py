"""Jobs made in Python: goals and names of another form are refused."""

import pytest
from support.unchecked import unchecked

from mmp_env import MmpError
from mmp_env.model.goals import NamedGoal
from mmp_env.work.jobs import Job, Move


def test_a_move_to_what_is_no_goal_is_refused():
    with unchecked(), pytest.raises(MmpError, match=r"the goal of a move is 'tucked'; it must be a goal"):
        Move("tucked")


def test_one_name_in_place_of_names_is_refused():
    with unchecked(), pytest.raises(MmpError, match="after of job 'b' is 'a'; it must be names of jobs"):
        Job(name="b", steps=(Move(NamedGoal("home")),), after="a")


def test_a_named_goal_without_a_name_is_refused():
    with unchecked(), pytest.raises(MmpError, match="name of a configuration is 3; it must be text"):
        NamedGoal(3)
