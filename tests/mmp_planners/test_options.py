"""Options of the conflict-tree planners: allowed values, refused values, and their effect."""

import math

import numpy as np
import pytest
from support import two_arms

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.events import NodeCreated, SearchStarted
from mmp_env.wording import shown
from mmp_planners import StopPlanning, make
from mmp_planners.apf_ecbs import ApfEcbs, ApfEcbsNf
from mmp_planners.conflict_tree.constraints import AvoidState, EitherArm, Vertex
from mmp_planners.ecbs import Ecbs

PLANNERS = ("ecbs", "xecbs", "gen-ecbs", "apf-ecbs-nf", "apf-ecbs")
ONE_KIND = ("cbs", "ecbs", "xecbs", "apf-ecbs-nf", "apf-ecbs")


def test_a_misspelled_option_is_answered_with_the_nearest():
    with pytest.raises(
        MmpError, match=r"no option 'patients'\. Did you mean 'patience'\? Known: bound, conflict_choice, constraint"
    ):
        make("ecbs", patients=3)


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("w", 0.0),
        ("w", -1.5),
        ("w", math.nan),
        ("w", math.inf),
        ("dt", 0.0),
        ("patience", 0),
        ("pad", -0.1),
        ("eta", 0),
    ],
)
def test_a_number_that_must_be_positive_is(name, option, value):
    with pytest.raises(MmpError, match=f"option '{option}' is .*positive number"):
        make(name, **{option: value})


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("w", [0.5, 0.999])
def test_a_factor_below_one_is_refused(name, w):
    with pytest.raises(MmpError, match=rf"option 'w' is {w}; it must be 1.0 at least"):
        make(name, w=w)


def test_a_kind_that_does_not_exist_is_refused_when_the_planner_is_made():
    with pytest.raises(UnknownNameError, match=r"unknown constraint kind 'vertx'\. Did you mean 'vertex'"):
        make("gen-ecbs", kinds="split+vertx")


def test_without_an_option_for_it_a_planner_has_the_constraint_of_its_paper():
    with pytest.raises(MmpError, match="planner 'cbs-mp' has no option 'constraint'"):
        make("cbs-mp", constraint="vertex")
    problem = two_arms.passing(1.0)
    plans = [make(name).plan(problem, seed=0).plan for name in ("cbs", "cbs-mp")]
    assert all((q == plans[1].positions[arm]).all() for arm, q in plans[0].positions.items())


@pytest.mark.parametrize(
    ("option", "value", "wanted"),
    [
        ("w", "1.5", "a number"),
        ("w", True, "a number"),
        ("patience", 2.0, "an integer"),
        ("patience", True, "an integer"),
        ("restarts", 1, "true or false"),
        ("restarts", "yes", "true or false"),
        ("constraint", 3, "text"),
        ("constraint", None, "text"),
    ],
)
def test_a_value_of_another_type_is_refused_with_the_type(option, value, wanted):
    with pytest.raises(MmpError, match=f"option '{option}' of planner 'ecbs' is {shown(value)}; it takes {wanted}$"):
        make("ecbs", **{option: value})


@pytest.mark.parametrize("digits", [400, 5000])
def test_a_whole_number_beyond_all_floats_is_refused(digits):
    value = 10**digits
    with pytest.raises(MmpError, match=r"option 'w' of planner 'ecbs' is .*; it takes a number up to 1\.8e"):
        make("ecbs", w=value)
    for option in ("restarts", "constraint"):
        with pytest.raises(MmpError, match=f"option '{option}' of planner 'ecbs' is .*; it takes "):
            make("ecbs", **{option: value})
    with pytest.raises(MmpError, match=r"option 'patience' is .*; it must be "):
        make("ecbs", patience=value)
    with pytest.raises(MmpError, match=r"option 'w' is .*; it must be "):
        Ecbs(w=value)


@pytest.mark.parametrize(
    ("option", "value", "nearest", "known"),
    [
        ("constraint", "vertx", "vertex", "avoid-path, avoid-state, priority, priority-path"),
        ("step", "normalized", "normalised", "gradient, normalised"),
        ("distance", "center", "centre", "centre, surface"),
        ("fast_track", "literally", "literal", "literal, sound"),
    ],
)
def test_a_choice_that_does_not_exist_is_answered_with_those_that_do(option, value, nearest, known):
    with pytest.raises(UnknownNameError, match=f"'{value}'. Did you mean '{nearest}'. Known: {known}"):
        make("apf-ecbs", **{option: value})


def test_whole_numbers_serve_as_floats_and_on_and_off_as_switches():
    assert make("ecbs", w=2, restarts="off") == Ecbs(w=2.0, restarts=False)
    assert make("apf-ecbs", early_stop="on", fast_track="literal") == ApfEcbs(early_stop=True, fast_track="literal")


def test_a_planner_made_without_the_registry_refuses_the_same_values():
    for kind in (Ecbs, ApfEcbs, ApfEcbsNf):
        with pytest.raises(MmpError, match="option 'w'"):
            kind(w=-1.0)


def test_the_constraint_kind_is_the_one_that_is_named():
    assert make("ecbs", pad=0.5).branching() == EitherArm(kind=AvoidState(pad=0.5))
    assert make("ecbs", constraint="vertex", radius=0.1).branching() == EitherArm(kind=Vertex(radius=0.1))


@pytest.mark.parametrize("name", ONE_KIND)
def test_the_events_contain_the_constraint_kind(name):
    for constraint, word in (("avoid-state", "avoids"), ("sphere", "keeps 0.1 m"), ("split", "leaves")):
        words = []

        def watch(event, into=words):
            if isinstance(event, NodeCreated) and event.constraint:
                into.append(event.constraint)
                if len(into) == 10:
                    raise StopPlanning

        problem = two_arms.passing(1.0)
        make(name, constraint=constraint, restarts=False).plan(problem, seed=0, time_limit=60.0, watch=watch)
        assert words
        assert all(word in said for said in words)


def test_a_finer_grid_has_more_steps_for_the_same_path():
    coarse, fine = (make("ecbs", dt=dt).plan(two_arms.one_moves()).plan for dt in (0.1, 0.05))
    assert (len(coarse.times), len(fine.times)) == (6, 11)
    assert coarse.makespan_s == pytest.approx(fine.makespan_s)


def test_without_restarts_a_search_without_open_nodes_is_exhausted():
    """One iteration of the single-arm planner finds no path around a parked arm, with or without restarts."""
    emitted = []
    hopeless = {"iterations": 1, "shortcuts": 1, "eta": 0.05}
    problem = two_arms.parked_arm_between()
    result = make("ecbs", restarts=False, **hopeless).plan(problem, time_limit=60.0, watch=emitted.append)
    assert (str(result.status), result.plan) == ("exhausted", None)
    assert result.stats["dropped_children"] > 0
    assert sum(isinstance(event, SearchStarted) for event in emitted) == 1
    assert not result.stats["deadline_hit"]
    result = make("ecbs", restarts=True, **hopeless).plan(problem, time_limit=0.3)
    assert (str(result.status), result.stats["deadline_hit"]) == ("timeout", True)
    assert result.stats["restarts"] > 0


@pytest.mark.parametrize(
    ("option", "value", "made"),
    [
        ("w", np.float32(1.25), 1.25),
        ("w", np.float64(1.2), 1.2),
        ("w", np.int64(2), 2.0),
        ("patience", np.int32(7), 7),
        ("restarts", np.False_, False),
    ],
)
def test_a_value_may_be_a_numpy_scalar(option, value, made):
    planner = make("ecbs", **{option: value})
    assert getattr(planner, option) == made
    assert type(getattr(planner, option)) is type(made)


@pytest.mark.parametrize(("option", "value"), [("patience", np.float64(7)), ("w", np.True_), ("w", np.str_("1.5"))])
def test_a_numpy_scalar_of_another_type_is_refused(option, value):
    with pytest.raises(MmpError, match=f"option '{option}' of planner 'ecbs' is"):
        make("ecbs", **{option: value})
