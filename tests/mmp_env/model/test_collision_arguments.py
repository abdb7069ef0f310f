"""Wrong arguments of collision queries: one sentence says what is allowed."""

import numpy as np
import pytest
from support.unchecked import unchecked

from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.arm import Obstacle
from mmp_env.model.margins import Margins
from mmp_env.model.rings import ring_cell

CELL = ring_cell(2)
MODEL = CELL.collision
REST = np.zeros((2, 6))
FAR = np.full((2, 6), 1e300)
BALL = Obstacle(
    name="ball", shape="sphere", position=np.zeros(3), quaternion=np.array([1.0, 0.0, 0.0, 0.0]), radius=0.1
)


@pytest.fixture(autouse=True)
def without_the_type_checker():
    with unchecked():
        yield


@pytest.mark.parametrize("margin", [-1, np.nan, np.inf, 1e300, 101, 1e-320, "a", None, True])
def test_a_margin_that_makes_no_sense_is_refused(margin):
    for ask in (
        lambda: MODEL.is_free("arm0", REST, margin=margin),
        lambda: MODEL.edge_free("arm0", REST, REST, margin=margin),
    ):
        with pytest.raises(
            MmpError, match=r"^margin is .*; it must be 0, or a finite number of metres .* 100 at most$"
        ):
            ask()


def test_each_of_some_margins_is_tested():
    with pytest.raises(MmpError, match=r"^margin to obstacles is nan; it must be 0, or a finite number"):
        MODEL.edge_free("arm0", REST, REST, margin=Margins(arms=0.0, obstacles=np.nan, self=0.0))


@pytest.mark.parametrize("margin", [0, 0.0, 1e-12, np.float32(0.01), 100.0])
def test_margins_from_0_to_100_metres_are_allowed(margin):
    assert MODEL.is_free("arm0", REST, margin=margin).tolist() == [margin < 0.0105] * 2
    assert MODEL.edge_free("arm0", REST, REST, margin=margin).tolist() == [margin < 0.0104] * 2


@pytest.mark.parametrize(
    "ask",
    [
        lambda: MODEL.is_free("arm0", FAR),
        lambda: MODEL.static_clearance("arm0", FAR),
        lambda: MODEL.spheres("arm0", FAR),
        lambda: MODEL.tool_points("arm0", FAR),
        lambda: MODEL.motion("arm0", FAR),
        lambda: MODEL.swept_clearance("arm0", FAR, BALL),
        lambda: MODEL.clearance({"arm0": FAR, "arm1": REST}),
        lambda: MODEL.nearest({"arm0": FAR[0], "arm1": REST[0]}),
        lambda: MODEL.pair_clearance("arm0", FAR, "arm1", REST),
    ],
)
def test_configurations_too_far_for_the_core_are_refused(ask):
    with pytest.raises(
        MmpError, match=r"^configurations of arm 'arm0' hold 1e[+]300; they must be from -10000 to 10000$"
    ):
        ask()


def test_configurations_too_far_for_the_core_are_beyond_the_limits():
    assert not MODEL.within_limits("arm0", FAR).any()
    assert not MODEL.edge_free("arm0", REST, FAR).any()


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: MODEL.clearance({}), "q has no configuration for arm 'arm0'"),
        (lambda: MODEL.clearance(None), "q is None; it must be a mapping of arm name -> joints"),
        (lambda: MODEL.nearest({"arm0": REST[0]}), "q has no configuration for arm 'arm1'"),
        (
            lambda: MODEL.nearest({"arm0": REST, "arm1": REST}),
            r"configurations of arm 'arm0' have shape \[2, 6\]; expected \[6\]",
        ),
        (
            lambda: MODEL.nearest({"arm0": REST[0], "arm1": None}),
            r"configurations of arm 'arm1' have shape \[\]; expected \[6\]",
        ),
        (lambda: MODEL.index({}), "arm is {}; it must be the name of an arm"),
        (lambda: MODEL.tilt({}, REST), "arm is {}; it must be the name of an arm"),
        (lambda: MODEL.sphere_links([]), r"arm is \[\]; it must be the name of an arm"),
        (
            lambda: MODEL.is_free("arm0", "zero"),
            r"configurations of arm 'arm0' are 'zero'; they must be numbers of shape",
        ),
        (lambda: MODEL.is_free("arm0", 3.0), r"have shape \[\]; expected \[n, 6\]"),
        (lambda: MODEL.motion("arm0", REST[:, :5]), r"have shape \[2, 5\]; expected \[n, 6\]"),
        (lambda: MODEL.motion("arm0", REST[:0]), "arm 'arm0' has no configurations; a motion needs one at least"),
        (lambda: MODEL.swept_clearance("arm0", REST, None), "body is None; it must be an Obstacle"),
        (
            lambda: MODEL.swept_clearance("arm0", REST, BALL, stray=np.nan),
            "stray is nan; it must be a number from 0 to",
        ),
        (lambda: MODEL.swept_clearance("arm0", REST, BALL, stray=2e6), "stray is 2000000.0; it must be a number from"),
    ],
)
def test_a_wrong_argument_is_one_sentence(ask, said):
    with pytest.raises(MmpError, match=said):
        ask()


def test_an_unknown_arm_is_answered_with_the_nearest_one():
    with pytest.raises(UnknownNameError, match="Did you mean 'arm0'"):
        MODEL.index("amr0")
