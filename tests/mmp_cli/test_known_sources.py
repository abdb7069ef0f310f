"""Sources of a benchmark folder together with those of another start."""

from pathlib import Path

import pytest

from mmp_cli.benchmark.known_sources import KnownSource, changed_sources, grown_sources, known_sources
from mmp_env.errors import MmpError

FOLDER = Path("out")


def file(source, *instances, cell="c"):
    """A file whose instances have their text as name; an instance with a mark has another content."""
    names = [f"{cell}/{instance.rstrip('*')}" for instance in instances]
    return KnownSource(source, f"digest of {cell}: {instances}", names, [f"{cell}{each}" for each in instances])


def drawn(source):
    return KnownSource(source, f"digest of {source}", [f"{source}/"], [])


def test_a_longer_file_takes_the_place_of_the_former_one_and_a_new_source_comes_last():
    there = [drawn("ring-2"), file("a", "x", "y"), file("b", "z", cell="d")]
    here = [file("new", "v", cell="e"), file("a", "x", "y", "w"), drawn("ring-2")]
    assert changed_sources(there, here) == []
    assert grown_sources(there, here, FOLDER) == [drawn("ring-2"), here[1], there[2], here[0]]


def test_the_former_file_changes_nothing():
    there = [file("a", "x", "y", "w")]
    assert grown_sources(there, [file("a", "x")], FOLDER) == there
    assert changed_sources(there, [file("a", "x")]) == []


@pytest.mark.parametrize(
    "here", [file("a", "x*", "y", "w"), file("a", "w", "x", "y"), file("a", "x", "y", cell="changed"), drawn("a")]
)
def test_other_content_of_the_same_name_is_a_change(here):
    assert changed_sources([file("a", "x", "y")], [here]) == ["a"]


@pytest.mark.parametrize("added", [(), ("w",)])
def test_the_content_of_another_source_is_a_change(added):
    there = [file("a", "x"), file("b", "z", cell="d")]
    assert changed_sources(there, [file("a", "z", *added, cell="d")]) == ["a"]


def test_two_files_that_get_instances_of_the_same_name_are_refused():
    there = [file("a", "x"), file("b", "z")]
    with pytest.raises(MmpError, match="already has instances 'c/y'"):
        grown_sources(there, [file("a", "x", "y"), file("b", "z", "y*")], FOLDER)


def test_two_new_sources_with_instances_of_the_same_name_are_refused():
    with pytest.raises(MmpError, match="already has instances 'ring-2/"):
        grown_sources([], [drawn("ring-2"), file("a", "7", cell="ring-2")], FOLDER)


def test_a_folder_of_an_earlier_version_gets_the_hashes_of_the_same_file():
    a = file("a", "x")
    there = known_sources({"sources": ["a"], "digests": [a.digest]})
    assert there == [KnownSource("a", a.digest, [], [])]
    assert grown_sources(there, [a], FOLDER) == [a]
