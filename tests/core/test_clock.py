"""The clock of long calls: a reserve lets it expire earlier."""

import numpy as np
import pytest

from mmp_env import core


def test_a_reserve_lets_the_clock_expire_earlier_and_the_last_one_holds():
    clock = core.Clock(1000.0)
    clock.reserve(400.0)
    assert 590.0 < clock.remaining <= 600.0
    clock.reserve(1000.0)
    assert clock.expired
    clock.reserve(0.0)
    assert not clock.expired
    clock.reserve(-1.0)
    assert 990.0 < clock.remaining <= 1000.0


def test_a_clock_without_deadline_does_not_expire():
    clock = core.Clock(np.inf)
    clock.reserve(np.inf)
    assert not clock.expired
    with pytest.raises(ValueError, match="seconds must be a number"):
        clock.reserve(np.nan)
