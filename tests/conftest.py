"""Runs every test with checked signatures (shapes and types); tests import `reference` and `support` from this folder.

There is no `__init__.py` beside this file and no conftest at the root: the tests import the installed packages.
"""

import importlib
import os
import sys
import tempfile
from pathlib import Path

import hypothesis
import jaxtyping

# Robots that the user of this machine has added are not those of the tests.
os.environ["XDG_DATA_HOME"] = os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp(prefix="mmp-tests-")
sys.path.insert(0, str(Path(__file__).parent))
importlib.import_module("support.typechecker")  # the hook looks it up in `support`
# This comes before the packages, because the hook acts at import.
jaxtyping.install_import_hook(["mmp_env", "mmp_planners", "mmp_tasks", "mmp_cli"], "support.typechecker.checked")

# No deadline: a busy machine makes no test fail. Examples are the same in every run, so failures repeat.
hypothesis.settings.register_profile("mmp", deadline=None, derandomize=True, database=None)
hypothesis.settings.load_profile("mmp")
