"""Words for numbers in messages."""

import pytest

from mmp_env.wording import how_far_apart


@pytest.mark.parametrize(
    ("metres", "words"),
    [(0.002, "2.0 mm apart"), (-0.0015, "1.5 mm deep"), (1e-5, "touching"), (0.0, "touching"), (-4e-5, "touching")],
)
def test_a_clearance_that_rounds_to_0_mm_is_a_touch(metres, words):
    assert how_far_apart(metres) == words
