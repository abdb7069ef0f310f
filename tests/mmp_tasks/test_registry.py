"""The registry of tasks: names, and tasks of other packages that do not work."""

import re
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import numpy as np
import pytest

from mmp_env import plugins
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.rings import ring_cell
from mmp_env.plugins import TASKS
from mmp_tasks import registry

DOCS = Path(__file__).parents[2] / "docs"


@dataclass(frozen=True)
class Nothing:
    """No task at all.

    It cannot sample.
    """

    size: int = 3


class NoOptions:
    """A task that is no dataclass."""

    def sample(self, cell, rng):
        return {}, {}


STRANGERS = {
    "nothing": f"{__name__}:Nothing",
    "plain": f"{__name__}:NoOptions",
    "missing": "a_module_that_is_not_there:Task",
    "empty": f"{__name__}:NotDefinedHere",
}


@pytest.fixture
def strangers(monkeypatch):
    points = [EntryPoint(name, value, TASKS.group) for name, value in STRANGERS.items()]
    own = {"nothing": Nothing, "plain": NoOptions}
    monkeypatch.setattr(plugins, "entry_points", lambda group: [*entry_points(group=group), *points])
    load = EntryPoint.load
    monkeypatch.setattr(EntryPoint, "load", lambda self: own.get(self.name) or load(self))


def test_an_unknown_task_names_the_nearest_and_all_known():
    with pytest.raises(UnknownNameError, match=r"unknown task 'raech'\. Did you mean 'reach'\? Known: .*reach"):
        registry.make("raech")


@pytest.mark.usefixtures("strangers")
@pytest.mark.parametrize("name", ["missing", "empty"])
def test_a_task_that_cannot_be_loaded_is_named_with_the_reason(name):
    with pytest.raises(MmpError, match=rf"task '{name}' \(.*\) does not load: \w+Error"):
        registry.make(name)


def test_no_other_package_replaces_a_built_in_task(monkeypatch):
    reach = EntryPoint("reach", "no_such_package:Task", TASKS.group)
    for order in (lambda ours: [*ours, reach], lambda ours: [reach, *ours]):
        monkeypatch.setattr(plugins, "entry_points", lambda group, order=order: order(list(entry_points(group=group))))
        assert type(registry.make("reach")).__module__ == "mmp_tasks.reach"


@pytest.mark.usefixtures("strangers")
def test_something_that_cannot_sample_is_no_task():
    with pytest.raises(MmpError, match="task 'nothing' has no method sample"):
        registry.make("nothing")


@pytest.mark.usefixtures("strangers")
def test_a_task_need_not_be_a_dataclass_but_has_no_options_then():
    assert isinstance(registry.make("plain"), NoOptions)
    with pytest.raises(UnknownNameError, match="Known: none"):
        registry.make("plain", size=2)


@pytest.mark.usefixtures("strangers")
def test_a_description_is_the_first_line_of_the_docstring_and_the_defaults():
    assert registry.names() == sorted({*registry.names(), *STRANGERS})
    description = registry.describe("nothing")
    assert (description.summary, description.options) == ("No task at all.", {"size": 3})


def test_the_examples_of_the_documentation_run():
    names = {}
    for page in ("reference/tasks.md", "how-to/add-a-task.md"):
        for code in re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(), re.DOTALL):
            exec(code, names)
    assert set(names["start"]) == set(names["goal"]) == set(ring_cell(8).arm_names)
    start, goal = names["FromTucked"]().sample(ring_cell(2), np.random.default_rng(0))
    assert start.keys() == goal.keys() == {"arm0", "arm1"}
