import contextlib
import json
import os
import random
import stat

import pytest
import yaml
from support import bad_files

from mmp_env.errors import InvalidInstanceError, MmpError
from mmp_env.files.cell_file import cell_from_dict, load_cell
from mmp_env.files.cell_source import find_cell
from mmp_env.files.episode_file import load_episode
from mmp_env.files.instance_file import instances_from_dict, load_instances
from mmp_env.files.plan_file import load_plan, plan_from_dict
from mmp_env.files.reading import MAX_JSON_BYTES, MAX_YAML_BYTES, Location, named, read_document
from mmp_env.wording import shown


@pytest.mark.parametrize(
    ("suffix", "texts", "case"),
    [("json", bad_files.TEXTS, case) for case in bad_files.TEXTS]
    + [("yaml", bad_files.YAML_TEXTS, case) for case in bad_files.YAML_TEXTS],
)
def test_a_file_that_holds_no_object_is_named_with_the_reason(tmp_path, suffix, texts, case):
    content, words = texts[case]
    path = tmp_path / f"cell.{suffix}"
    path.write_bytes(content)
    with pytest.raises(MmpError) as error:
        load_cell(path)
    for word in [str(path), *words]:
        assert word in str(error.value)


@pytest.mark.parametrize(("name", "limit"), [("a.json", MAX_JSON_BYTES), ("a.yaml", MAX_YAML_BYTES)])
def test_a_huge_file_is_not_read_to_its_end(tmp_path, name, limit):
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(100 * limit)
    with pytest.raises(MmpError, match=rf"{name} is larger than {limit / 2**20:g} MB"):
        read_document(path)


@pytest.mark.parametrize(("name", "reason"), [("none.json", "No such file"), ("", "Is a directory")])
def test_an_unreadable_file_is_named_with_the_reason(tmp_path, name, reason):
    with pytest.raises(MmpError, match=f"cannot be read: {reason}"):
        read_document(tmp_path / name)


def test_a_device_is_not_read():
    with pytest.raises(MmpError, match="/dev/null cannot be read: it is not a regular file"):
        read_document("/dev/null")


def test_a_block_device_is_not_read_either(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    path.write_text("{}")
    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", lambda *_, **__: os.stat_result([stat.S_IFBLK, *[0] * 9]))
        with pytest.raises(MmpError, match=r"a\.json cannot be read: it is not a regular file"):
            read_document(path)


def test_a_name_that_no_file_can_have_is_an_error_too():
    with pytest.raises(MmpError, match="cannot be read"):
        read_document("a\0b.json")


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    path = tmp_path / "a.json"
    path.write_bytes(b'\xef\xbb\xbf{"a": 1}')
    assert read_document(path) == {"a": 1}


def test_whole_numbers_stay_whole_and_endless_ones_become_infinite(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(f"[12345, {'9' * 1000}, -{'9' * 1000}, 1e999]")
    whole, *endless = read_document(path)
    assert isinstance(whole, int)
    assert endless == [float("inf"), -float("inf"), float("inf")]


@pytest.mark.parametrize("parser", ["CSafeLoader", "SafeLoader"])
def test_yaml_scalars_follow_the_core_schema(tmp_path, monkeypatch, parser):
    monkeypatch.setattr(yaml, "CSafeLoader", getattr(yaml, parser), raising=False)
    path = tmp_path / "a.yaml"
    path.write_text(
        "{none: [null, ~, Null, NULL, ], truth: [true, False, TRUE],\n"
        "whole: [12, -3, +4, 010, 0o17, 0xff], numbers: [1e-3, 1., .5, -2.5E+1, .inf, -.Inf, 12345678901234567890],\n"
        "words: [yes, off, 1:30, 1_000, 0b1, 2026-01-01, '12', \"true\", 1e, ., -, <<, =, null x]}\n"
        "# a comment\n"
    )
    read = read_document(path)
    assert read["none"] == [None] * 4
    assert [value is True for value in read["truth"]] == [True, False, True]
    assert read["whole"] == [12, -3, 4, 10, 15, 255]
    assert {type(value) for value in read["whole"]} == {int}
    assert read["numbers"] == [1e-3, 1.0, 0.5, -25.0, float("inf"), -float("inf"), 12345678901234567890.0]
    assert {type(value) for value in read["numbers"]} == {float}
    words = ["yes", "off", "1:30", "1_000", "0b1", "2026-01-01", "12", "true", "1e", ".", "-", "<<", "=", "null x"]
    assert read["words"] == words


def test_yaml_without_anything_is_null(tmp_path):
    path = tmp_path / "a.yaml"
    for text in ("", "# nothing\n", "---\n", "---\n...\n"):
        path.write_text(text)
        assert read_document(path) is None


@pytest.mark.parametrize("parser", ["CSafeLoader", "SafeLoader"])
def test_every_corrupted_yaml_is_read_or_refused(tmp_path, monkeypatch, parser):
    monkeypatch.setattr(yaml, "CSafeLoader", getattr(yaml, parser), raising=False)
    good = yaml.safe_dump(bad_files.good_cell()).encode()
    rng = random.Random(7)
    parts = [
        b"!",
        b"!!bool ",
        b"&a ",
        b"*a",
        b"<<: ",
        b"? ",
        b"- ",
        b": ",
        b"[",
        b"}",
        b'"\\U00110000"',
        b"%YAML 99999.9\n",
    ]
    parts += [b"---\n", b"...\n", b"\t", b"\x00", b"\xff", b"| ", b">9\n", b"'", b"0x", b"1e999", b"\n\n", b"#"]
    path = tmp_path / "a.yaml"
    for _ in range(400):
        at = rng.randrange(len(good))
        path.write_bytes(good[:at] + rng.choice(parts) + good[at + rng.choice([0, 0, 1, 5, 50]) :])
        with contextlib.suppress(MmpError):
            load_cell(path)


@pytest.mark.parametrize("kind", [b"[]", b"{}", b"[[]]"])
def test_a_file_of_countless_lists_is_refused_before_they_are_made(tmp_path, kind):
    path = tmp_path / "a.json"
    path.write_bytes(b"[" + b",".join([kind] * 2**21) + b"]")
    with pytest.raises(MmpError, match=r"a\.json has more than 2,000,000 lists and objects, the most that are read"):
        read_document(path)


def test_an_error_names_the_place_of_the_value():
    place = Location("a.json") / "arms" / 2 / "yaw"
    with pytest.raises(MmpError, match=r"^a.json: arms\[2\].yaw: too far$"), named(place):
        raise MmpError("too far")
    with pytest.raises(InvalidInstanceError, match=r"^a.json: arms\[2\].yaw: in collision$"), named(place):
        raise InvalidInstanceError("in collision")


def test_values_are_shown_short():
    assert shown(None) == "null"
    assert shown(True) == "true"
    assert len(shown("x" * 10**6)) < 100
    assert len(shown([[1.0] * 1000] * 1000)) < 500


ODD = [
    None,
    True,
    0,
    -1,
    1e308,
    float("nan"),
    10**30,
    10**400,
    -(10**5000),
    [10**400],
    "",
    "\ud800",
    "x" * 1000,
    [],
    {},
    [[]],
    {"": None},
    [None] * 100,
]


def paths(data, prefix=()):
    """Yields every place in nested dicts, and the first in nested lists."""
    for key in data if isinstance(data, dict) else range(len(data[:1])) if isinstance(data, list) else ():
        yield [*prefix, key]
        yield from paths(data[key], (*prefix, key))


@pytest.mark.parametrize(
    ("good", "read"),
    [
        (bad_files.good_cell(), cell_from_dict),
        (bad_files.good_instances(), instances_from_dict),
        (bad_files.good_plan(), plan_from_dict),
    ],
    ids=["cell", "instances", "plan"],
)
def test_every_value_at_every_place_of_a_file_is_read_or_refused(good, read):
    messages = []
    # The cell inside the other two files is tested with the cell file.
    for path in (path for path in paths(good) if "cell" not in path[:-1]):
        for value in [*ODD, bad_files.GONE]:
            try:
                read(bad_files.spoilt(good, path, value), "odd.json")
            except MmpError as error:
                messages.append(str(error))
    assert len(messages) > 150
    assert all(message.startswith("odd.json") for message in messages)
    assert max(map(len, messages)) < 700


def test_a_pipe_and_a_name_without_suffix_hold_yaml_or_json(tmp_path):
    for text in ("# by hand\nleft: [0, 1]\n", '{"left": [0, 1]}', '"left": [0, 1]'):
        (tmp_path / "ends").write_text(text)
        reader, writer = os.pipe()
        os.write(writer, text.encode())
        os.close(writer)
        try:
            assert read_document(f"/dev/fd/{reader}") == read_document(tmp_path / "ends") == {"left": [0, 1]}
        finally:
            os.close(reader)


@pytest.mark.parametrize(
    ("text", "words"),
    [('{"left": [0', "is not JSON"), ("left: [0", "not YAML"), ("# " + "a" * MAX_YAML_BYTES, "0.25 MB")],
)
def test_bad_text_without_suffix_is_refused_as_what_it_looks_like(tmp_path, text, words):
    (tmp_path / "ends").write_text(text)
    with pytest.raises(MmpError, match=words):
        read_document(tmp_path / "ends")


@pytest.mark.parametrize(
    ("load", "takes"),
    [
        (load_cell, "a cell file"),
        (find_cell, "a cell file or an instance file"),
        (load_instances, "an instance file"),
        (load_plan, "a plan"),
        (load_episode, "an episode"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_file_of_another_kind_is_called_by_its_name(tmp_path, load, takes):
    files = {
        "a cell file": bad_files.good_cell(),
        "an instance file": bad_files.good_instances(),
        "a plan": bad_files.good_plan(),
        "an episode": {"schema": "mmp-episode/1", "plans": []},
    }
    path = tmp_path / "some.json"
    for kind, data in files.items():
        if kind not in takes:
            path.write_text(json.dumps(data))
            with pytest.raises(MmpError, match=f"some.json is {kind}; {load.__name__} takes {takes}$"):
                load(path)


@pytest.mark.parametrize("suffix", ["json", "yaml"])
def test_whole_numbers_up_to_the_largest_seed_stay_whole(tmp_path, suffix):
    path = tmp_path / f"some.{suffix}"
    for number in (2**63 - 1, -(10**17)):
        path.write_text(f'{{"seed": {number}}}')
        assert read_document(path) == {"seed": number}
