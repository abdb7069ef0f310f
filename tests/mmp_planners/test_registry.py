"""Planners by name, those of other packages included, and messages about broken ones."""

import re
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points

import pytest

import mmp_env
import mmp_planners
from mmp_env import plugins
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.plugins import PLANNERS
from mmp_planners import Planner, PlanResult, Status, registry

OURS = {"ecbs", "apf-ecbs-nf", "apf-ecbs"}


@dataclass(frozen=True, kw_only=True)
class Stranger:
    """Gives up
    at once. It is a stranger's.

    Nobody wants to know more.
    """

    w: float = 1.5
    count: int = 3
    careful: bool = True
    word: str = "none"
    limit: float | None = None
    parts: list[int] = field(default_factory=list, metadata={"doc": "what it is made of"})
    state: int = field(default=0, init=False)

    def plan(self, problem, *, seed=0, time_limit=float("inf"), watch=None):
        return PlanResult(status=Status.TIMEOUT)


class Plain:
    def plan(self, problem, *, seed=0, time_limit=float("inf"), watch=None):
        return PlanResult(status=Status.TIMEOUT)


class WithoutPlan:
    """Has no method `plan`."""


@dataclass
class Unreadable:
    """Has types that exist for type checkers only."""

    cell: "OnlyForTypeCheckers" = None

    def plan(self, problem, *, seed=0, time_limit=float("inf"), watch=None):
        return PlanResult(status=Status.TIMEOUT)


class OtherArguments:
    def plan(self, problem, deadline):
        return PlanResult(status=Status.TIMEOUT)


class NothingOptional:
    def plan(self, problem, *, seed, time_limit, watch):
        return PlanResult(status=Status.TIMEOUT)


@dataclass
class Demanding:
    """Cannot be without a table."""

    table: str

    def plan(self, problem, *, seed=0, time_limit=float("inf"), watch=None):
        return PlanResult(status=Status.TIMEOUT)


@dataclass
class Broke:
    """Has no default that works."""

    money: float = field(default_factory=lambda: 1 / 0)

    def plan(self, problem, *, seed=0, time_limit=float("inf"), watch=None):
        return PlanResult(status=Status.TIMEOUT)


CLASSES = {
    "stranger": Stranger,
    "plain": Plain,
    "without-plan": WithoutPlan,
    "unreadable": Unreadable,
    "other-arguments": OtherArguments,
    "nothing-optional": NothingOptional,
    "demanding": Demanding,
    "broke": Broke,
    "an-object": Plain(),
}
VALUES = {name: f"strangers:{getattr(found, '__name__', 'it')}" for name, found in CLASSES.items()} | {
    "absent": "no_such_package:Planner",
    "nothing-there": "math:NoSuchPlanner",
}


@pytest.fixture
def strangers(monkeypatch):
    """Registers these planners as if another package had installed them."""
    points = [EntryPoint(name, value, PLANNERS.group) for name, value in VALUES.items()]
    monkeypatch.setattr(plugins, "entry_points", lambda group: [*entry_points(group=group), *points])
    load = EntryPoint.load
    monkeypatch.setattr(EntryPoint, "load", lambda self: CLASSES[self.name] if self.name in CLASSES else load(self))


def test_our_planners_are_registered_and_listed_in_order():
    assert set(registry.names()) >= OURS
    assert registry.names() == sorted(registry.names())


def test_an_unknown_planner_is_answered_with_the_nearest_and_the_list():
    for call in (registry.make, registry.describe, registry.load):
        with pytest.raises(
            UnknownNameError, match=r"unknown planner 'apf-ecsb'\. Did you mean 'apf-ecbs'\? Known: .*, ecbs"
        ):
            call("apf-ecsb")


@pytest.mark.usefixtures("strangers")
def test_a_stranger_is_a_planner_like_any_other():
    assert set(registry.names()) >= OURS | VALUES.keys()
    planner = registry.make("stranger", w=2, careful="off", limit=3.0)
    assert isinstance(planner, Planner)
    assert planner == Stranger(w=2.0, careful=False, limit=3.0)
    assert type(planner.w) is float


@pytest.mark.usefixtures("strangers")
def test_a_description_is_the_first_paragraph_and_the_options():
    description = registry.describe("stranger")
    assert description.summary == "Gives up at once. It is a stranger's."
    assert {option.name: (option.type, option.default, option.doc) for option in description.options} == {
        "w": ("float", 1.5, ""),
        "count": ("int", 3, ""),
        "careful": ("bool", True, ""),
        "word": ("str", "none", ""),
        "limit": ("float | None", None, ""),
        "parts": ("list", [], "what it is made of"),
    }


@pytest.mark.usefixtures("strangers")
def test_a_planner_need_not_be_a_dataclass_but_has_no_options_then():
    assert isinstance(registry.make("plain"), Plain)
    assert registry.describe("plain").options == ()
    with pytest.raises(MmpError, match=r"planner 'plain' has no option 'w'\..*Known: none"):
        registry.make("plain", w=1.5)


@pytest.mark.usefixtures("strangers")
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("absent", "planner 'absent' (no_such_package:Planner) does not load: ModuleNotFoundError: No module named"),
        ("nothing-there", "planner 'nothing-there' (math:NoSuchPlanner) does not load: AttributeError"),
        ("without-plan", "planner 'without-plan' (strangers:WithoutPlan) has no method plan"),
        (
            "other-arguments",
            "planner 'other-arguments' (strangers:OtherArguments) has plan(self, problem, deadline), not",
        ),
        ("nothing-optional", "has plan(self, problem, *, seed, time_limit, watch), not plan(self, problem"),
        ("an-object", "planner 'an-object' (strangers:it) is no class but a Plain"),
        ("broke", "planner 'broke' does not say its options: ZeroDivisionError"),
    ],
)
def test_a_broken_plug_in_is_named_with_the_reason(name, reason):
    for call in (registry.make, registry.describe):
        with pytest.raises(MmpError, match=re.escape(reason)):
            call(name)


@pytest.mark.usefixtures("strangers")
def test_a_planner_that_cannot_be_made_is_named_and_still_described():
    assert [option.name for option in registry.describe("demanding").options] == ["table"]
    with pytest.raises(MmpError, match=r"planner 'demanding' cannot be made: TypeError: .*table"):
        registry.make("demanding")


@pytest.mark.usefixtures("strangers")
def test_no_other_package_replaces_a_built_in_task(monkeypatch):
    find = plugins.entry_points
    ecbs = EntryPoint("ecbs", "no_such_package:Planner", PLANNERS.group)
    for points in (lambda group: [*find(group=group), ecbs], lambda group: [ecbs, *find(group=group)]):
        monkeypatch.setattr(plugins, "entry_points", points)
        assert registry.load("ecbs").__module__ == "mmp_planners.ecbs"


def test_two_strangers_of_one_name_are_an_error_that_names_both(monkeypatch):
    namesakes = [EntryPoint("namesake", f"package_{k}:Planner", PLANNERS.group) for k in (1, 2)]
    monkeypatch.setattr(plugins, "entry_points", lambda group: [*entry_points(group=group), *namesakes])
    assert "namesake" in registry.names()
    for call in (registry.make, registry.describe, registry.is_foreign):
        with pytest.raises(MmpError, match=r"two packages have a planner 'namesake': .*package_1:.*package_2:"):
            call("namesake")
    assert registry.make("ecbs")


@pytest.mark.usefixtures("strangers")
def test_a_broken_plug_in_harms_no_other():
    assert set(registry.names()) >= OURS
    for name in OURS | {"stranger", "plain"}:
        assert registry.describe(name).name == name
        assert isinstance(registry.make(name), Planner)


@pytest.mark.usefixtures("strangers")
def test_types_that_exist_for_type_checkers_only_are_shown_as_they_are_written():
    assert [option.type for option in registry.describe("unreadable").options] == ["OnlyForTypeCheckers"]
    assert isinstance(registry.make("unreadable"), Unreadable)


def test_all_of_our_planners_describe_themselves():
    for name in OURS:
        description = registry.describe(name)
        options = {option.name: option for option in description.options}
        assert description.summary
        assert (options["w"].type, options["w"].default) == ("float", 1.5)
        assert all(option.doc for option in description.options)
        assert {"dt", "constraint", "restarts", "patience"} <= options.keys()


def test_the_package_has_the_version_of_the_environment():
    assert mmp_planners.__version__ == mmp_env.__version__
    with pytest.raises(AttributeError, match="no attribute 'version'"):
        _ = mmp_planners.version


@pytest.mark.parametrize("status", Status)
def test_every_status_says_what_to_do_next_in_a_sentence(status):
    assert re.fullmatch(r"[A-Z][^.]+(mmp_env\.[^.]+)*\.", status.advice)
