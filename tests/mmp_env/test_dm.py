"""Errors of `mmp_env.dm` without dm_control, and its parts that need none."""

import subprocess
import sys
import types

import numpy as np
import pytest
from gymnasium.utils.seeding import np_random
from support.unchecked import unchecked

from mmp_env import dm
from mmp_env.dm import control_suite
from mmp_env.dm.random_source import generator
from mmp_env.errors import MmpError


@pytest.fixture(autouse=True)
def _asked_anew():
    control_suite.require.cache_clear()
    yield
    control_suite.require.cache_clear()


def test_a_missing_dm_control_is_an_error_that_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "dm_control", None)
    monkeypatch.setattr(sys, "version_info", (3, 12, 0))
    with pytest.raises(MmpError, match=r"dm_control cannot be imported .*; get it with: pip install 'mmp-env\[dm\]'"):
        dm.load("MultiArmCell-2")


def test_a_python_too_new_for_dm_control_is_an_error_that_names_versions(monkeypatch):
    monkeypatch.setitem(sys.modules, "dm_control", None)
    monkeypatch.setattr(sys, "version_info", (3, 13, 0))
    with pytest.raises(MmpError, match=r"it needs Python 3\.11 or 3\.12, and there: pip install"):
        dm.load("MultiArmCell-2")


def test_a_dm_control_that_fails_with_this_mujoco_differs_from_a_missing_one(monkeypatch):
    class Physics:
        @staticmethod
        def from_xml_string(text):
            raise AttributeError("'MjModel' object has no attribute 'flex_vertedge'")

    newest = types.SimpleNamespace(mujoco=types.SimpleNamespace(__version__="4.0.0"))
    package = types.ModuleType("dm_control")
    package.mujoco = types.SimpleNamespace(Physics=Physics, wrapper=newest)
    monkeypatch.setitem(sys.modules, "dm_control", package)
    with pytest.raises(MmpError, match=r"does not work with MuJoCo 4\.0\.0 .*flex_vertedge.*mmp-env\[dm\]"):
        dm.load("MultiArmCell-2")


def test_importing_the_package_imports_no_dm_control():
    program = "import sys, mmp_env.dm; print(*sorted(m for m in sys.modules if m.startswith(('dm_', 'mujoco'))))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_seed_gives_the_generator_of_gymnasium():
    assert generator(7).random() == np_random(7)[0].random()
    assert generator(np.int64(7)).random() == np_random(7)[0].random()


def test_a_generator_is_used_unchanged_and_equal_random_states_give_equal_seeds():
    stream = np.random.default_rng(0)
    assert generator(stream) is stream
    first, second, third = (generator(np.random.RandomState(seed)).random() for seed in (1, 1, 2))
    assert first == second != third
    assert generator(None).random() != generator(None).random()


@pytest.mark.parametrize("random", [-1, 1.5, True, "7"])
def test_anything_else_is_refused(random):
    with pytest.raises(MmpError, match="it must be a whole number from 0, a numpy Generator or RandomState, or None"):
        generator(random)


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("terminate_on_contact", "no", "terminate_on_contact is 'no'; it must be True or False"),
        ("self_contacts", 1, "self_contacts is 1; it must be True or False"),
        ("control_rate_hz", "10", "control_rate_hz is '10'; it must be a finite number"),
        ("time_limit", -1, "time_limit is -1; it must be a number of seconds above 0, inf for none"),
    ],
)
def test_an_option_of_the_wrong_type_is_refused_before_anything_is_loaded(option, value, said):
    with unchecked(), pytest.raises(MmpError, match=said):
        dm.load(**{option: value})
