"""Small good files, and every fault in them that their readers must name, with file, field and value."""

from __future__ import annotations

import json
from typing import Any

from support import tiny_plans

GONE = object()
NAN, INF = float("nan"), float("inf")
TUCKED = [2.6052, -2.2, 2.5, -1.87, -1.5708, 0.0]
ARM = {"name": "one of many", "robot": "ur5e", "position": [0, 0, 0]}
TURNED = [2.1052, -2.2, 2.5, -1.87, -1.5708, 0.0]


def good_cell() -> dict[str, Any]:
    """Returns a cell of two UR5e 1.2 m apart on a table, with one obstacle of each shape out of their reach."""
    return {
        "name": "pair",
        "arms": [
            {"name": "left", "robot": "ur5e", "position": [-0.6, 0.0, 0.0], "yaw": 0.0},
            {"name": "right", "robot": "ur5e", "position": [0.6, 0.0, 0.0], "quaternion": [0.0, 0.0, 0.0, 2.0]},
        ],
        "obstacles": [
            {"name": "table", "shape": "box", "position": [0.0, 0.0, -0.05], "size": [3.0, 3.0, 0.1]},
            {"name": "ball", "shape": "sphere", "position": [0.0, 2.0, 1.0], "radius": 0.1},
            {"name": "post", "shape": "cylinder", "position": [0.0, 2.0, 0.2], "radius": 0.05, "length": 0.4},
            {
                "name": "rail",
                "shape": "capsule",
                "position": [0.0, -2.0, 0.5],
                "yaw": 0.5,
                "radius": 0.02,
                "length": 1.0,
            },
        ],
        "spheres": "28",
    }


def good_instances() -> dict[str, Any]:
    """Returns the cell with two instances. In the second, joint 3 of `left` is 5.5 rad beyond its limit."""
    ends = {"start": {"left": TUCKED, "right": TUCKED}, "goal": {"left": TURNED, "right": TURNED}}
    turn, outside = ({"name": name, **json.loads(json.dumps(ends))} for name in ("turn", "outside"))
    outside["start"]["left"][2] = 5.5
    return {
        "schema": "mmp-instances/1",
        "name": "pairs",
        "source": "made up",
        "cell": good_cell(),
        "instances": [turn, outside],
    }


def good_plan() -> dict[str, Any]:
    """Returns a plan with nothing wrong."""
    return tiny_plans.two_apart()


CELLS = {
    "an arm without a name": (["arms", 0, "name"], GONE, ["arms[0].name is missing"]),
    "an arm named by a number": (["arms", 1, "name"], 7, ["arms[1].name is 7", "text"]),
    "an arm with an empty name": (["arms", 1, "name"], "", ["arms[1].name is ''", "printable"]),
    "an arm with a path for a name": (["arms", 1, "name"], "a/b", ["arms[1].name is 'a/b'", "'/'"]),
    "an arm with a line break in its name": (["arms", 1, "name"], "a\nb", ["arms[1].name", "printable"]),
    "an endless name": (["arms", 1, "name"], "a" * 10**6, ["arms[1].name", "1 to 100"]),
    "two arms of one name": (["arms", 1, "name"], "left", ["two arms named 'left'"]),
    "two obstacles of one name": (["obstacles", 1, "name"], "table", ["two obstacles named 'table'"]),
    "an unknown robot": (["arms", 0, "robot"], "ur5", ["arms[0].robot", "'ur5'", "Did you mean 'ur5e'?", "panda"]),
    "an unknown tool": (["arms", 0, "tool"], "franka_hand", ["arms[0].tool", "Did you mean 'franka-hand'?"]),
    "a held object without a place": (["arms", 0, "held"], {"shape": "box"}, ["arms[0].held.position is missing"]),
    "a misspelt field": (["arms", 0, "postion"], [0, 0, 0], ["arms[0]", "'postion'", "Did you mean 'position'?"]),
    "a misspelt field of the cell": (["obstacle"], [], ["unknown field 'obstacle'", "Did you mean 'obstacles'?"]),
    "no arms": (["arms"], GONE, ["arms is missing"]),
    "an empty list of arms": (["arms"], [], ["arms is empty"]),
    "arms that are no list": (["arms"], {"left": {}}, ["arms is", "a list"]),
    "an arm that is no object": (["arms", 0], "ur5e", ["arms[0] is 'ur5e'", "an object"]),
    "too many arms": (["arms"], [ARM] * 257, ["arms has 257 entries", "at most 256"]),
    "a position of two numbers": (["arms", 0, "position"], [0, 0], ["arms[0].position is [0, 0]", "length 3"]),
    "a position of text": (["arms", 0, "position"], [0, "x", 0], ["arms[0].position[1] is 'x'", "a number"]),
    "a position of truth": (["arms", 0, "position", 1], True, ["arms[0].position[1] is true", "a number"]),
    "a position that is NaN": (["arms", 0, "position", 2], NAN, ["arms[0].position is", "nan", "-100 to 100 m"]),
    "a position at infinity": (["arms", 0, "position", 2], INF, ["arms[0].position is", "inf", "-100 to 100 m"]),
    "a position far out": (["obstacles", 0, "position", 2], 1e5, ["obstacles[0].position is", "100000.0", "100 m"]),
    "a yaw that is NaN": (["arms", 0, "yaw"], NAN, ["arms[0].yaw is nan", "finite"]),
    "a yaw in degrees": (
        ["arms", 0, "yaw"],
        180,
        ["arms[0].yaw is 180", "-6.283 to 6.283 rad", "180 looks like degrees"],
    ),
    "an obstacle's yaw in degrees": (
        ["obstacles", 3, "yaw"],
        -90.0,
        ["obstacles[3].yaw is -90.0", "-90 looks like degrees"],
    ),
    "the yaw of a held object in degrees": (
        ["arms", 0, "held"],
        {"shape": "sphere", "radius": 0.01, "position": [0, 0, 0.1], "yaw": 70},
        ["arms[0].held.yaw is 70", "70 looks like degrees"],
    ),
    "a yaw of a list": (["arms", 0, "yaw"], [1.0], ["arms[0].yaw is [1.0]", "a number or null"]),
    "a number beyond all bounds": (["arms", 0, "yaw"], 10**400, ["arms[0].yaw is", "number"]),
    "a yaw and a quaternion": (["arms", 1, "yaw"], 1.0, ["arms[1]", "both yaw 1.0 and quaternion"]),
    "a zero quaternion": (["arms", 1, "quaternion"], [0, 0, 0, 0], ["arms[1].quaternion is", "not all zero"]),
    "a quaternion with NaN": (["arms", 1, "quaternion", 0], NAN, ["arms[1].quaternion is", "nan", "finite"]),
    "a quaternion of three": (["arms", 1, "quaternion"], [1, 0, 0], ["arms[1].quaternion is", "length 4"]),
    "overlapping bases": (["arms", 1, "position"], [-0.5, 0.0, 0.0], ["arms[1].position", "'right'", "'left'", "mm"]),
    "an unknown shape": (["obstacles", 1, "shape"], "spher", ["obstacles[1].shape", "Did you mean 'sphere'?"]),
    "an edge of negative length": (["obstacles", 0, "size", 0], -1.0, ["obstacles[0].size is", "-1.0", "1e-06 to 100"]),
    "an edge of no length": (["obstacles", 0, "size", 0], 0, ["obstacles[0].size is", "1e-06 to 100"]),
    "an endless edge": (["obstacles", 0, "size", 0], INF, ["obstacles[0].size is", "inf", "1e-06 to 100"]),
    "a negative radius": (["obstacles", 1, "radius"], -0.1, ["obstacles[1].radius is -0.1", "1e-06 to 100"]),
    "a radius that is NaN": (["obstacles", 1, "radius"], NAN, ["obstacles[1].radius is nan", "1e-06 to 100"]),
    "a negative length": (["obstacles", 3, "length"], -1, ["obstacles[3].length is -1", "1e-06 to 100"]),
    "a box without size": (["obstacles", 0, "size"], GONE, ["obstacles[0].size is missing", "a box needs size"]),
    "a cylinder without length": (
        ["obstacles", 2, "length"],
        GONE,
        ["obstacles[2].length is missing", "radius and length"],
    ),
    "a sphere with a length": (["obstacles", 1, "length"], 1.0, ["obstacles[1].length is 1.0", "radius only"]),
    "an unknown sphere set": (["spheres"], "fin", ["spheres", "'fin'", "Did you mean 'fine'?"]),
    "a sphere set of another number": (["spheres"], 29, ["spheres", "'29'", "28"]),
    "a cell named by a path": (["name"], "a/b", ["name is 'a/b'"]),
}
"""Name of a fault -> its place in the valid cell, the wrong value, and words of the message."""

INSTANCES = {
    "no schema": (["schema"], GONE, ["schema is missing", "mmp-instances/1"]),
    "another schema": (["schema"], "mmp-instances/2", ["schema is 'mmp-instances/2'", "'mmp-instances/1'"]),
    "a plan's schema": (["schema"], "mmp-plan/1", ["schema is 'mmp-plan/1'", "'mmp-instances/1'"]),
    "no cell": (["cell"], GONE, ["cell is missing"]),
    "a bad cell": (["cell", "arms", 0, "robot"], "ur5", ["cell.arms[0].robot", "Did you mean 'ur5e'?"]),
    "no instances": (["instances"], [], ["instances is empty"]),
    "two instances of one name": (["instances", 1, "name"], "turn", ["instances[1].name is 'turn'", "second time"]),
    "a misspelt goal": (["instances", 0, "gaol"], {}, ["instances[0]", "'gaol'", "Did you mean 'goal'?"]),
    "a start without an arm": (["instances", 0, "start", "right"], GONE, ["instances[0].start", "no arm 'right'"]),
    "a start of a stranger": (
        ["instances", 0, "start", "rigth"],
        TUCKED,
        ["instances[0].start", "Did you mean 'right'?"],
    ),
    "too few joints": (["instances", 0, "goal", "left"], TUCKED[:5], ["instances[0].goal.left has 5", "6", "ur5e"]),
    "too many joints": (["instances", 0, "goal", "left"], [*TUCKED, 0], ["instances[0].goal.left has 7", "6", "ur5e"]),
    "a joint that is NaN": (["instances", 0, "start", "left", 3], NAN, ["instances[0].start.left[3] is nan", "finite"]),
    "a joint at infinity": (
        ["instances", 0, "start", "left", 3],
        -INF,
        ["instances[0].start.left[3] is -inf", "finite"],
    ),
    "a joint of text": (["instances", 0, "start", "left", 3], "0", ["instances[0].start.left[3] is '0'", "number"]),
    "a joint of truth": (["instances", 0, "start", "left", 3], True, ["instances[0].start.left[3] is true", "number"]),
    "a configuration of one number": (
        ["instances", 0, "start", "left"],
        1.0,
        ["instances[0].start.left is 1.0", "list"],
    ),
}

PLANS = {
    "no schema": (["schema"], GONE, ["schema is missing", "mmp-plan/1"]),
    "another schema": (["schema"], "mmp-instances/1", ["schema is 'mmp-instances/1'", "'mmp-plan/1'"]),
    "no problem": (["problem"], GONE, ["problem is missing"]),
    "a bad cell": (["problem", "cell", "arms", 0, "yaw"], "north", ["problem.cell.arms[0].yaw is 'north'", "a number"]),
    "no margin": (["problem", "margin"], GONE, ["problem.margin is missing"]),
    "a margin of nothing": (["problem", "margin"], 0, ["problem.margin is 0", "positive"]),
    "a margin that is NaN": (["problem", "margin"], NAN, ["problem.margin is nan", "positive"]),
    "a margin of one kind that is no number": (
        ["problem", "margins"],
        {"arms": 0.002, "obstacles": 0.002, "self": True},
        ["problem.margins.self is true", "a number"],
    ),
    "a margin of one kind that is missing": (
        ["problem", "margins"],
        {"arms": 0.002, "self": 0.002},
        ["problem.margins.obstacles is missing"],
    ),
    "two margins between arms": (
        ["problem", "margins"],
        {"arms": 1.5, "obstacles": 0.002, "self": 0.002},
        ["problem.margin is", "margins.arms", "1.5"],
    ),
    "no speed": (["problem", "max_velocity"], 0, ["problem.max_velocity is 0", "positive"]),
    "a negative speed": (
        ["problem", "max_velocity"],
        {"left": [1, 1, 1, 1, 1, -1], "right": [1, 1, 1, 1, 1, 1]},
        ["problem.max_velocity.left[5] is -1", "positive"],
    ),
    "a negative jerk": (["problem", "max_jerk"], -1.0, ["problem.max_jerk is -1.0", "positive"]),
    "a start without an arm": (["problem", "start", "left"], GONE, ["problem.start", "no arm 'left'"]),
    "no times": (["times"], [], ["times is empty"]),
    "a time that is NaN": (["times", 1], NAN, ["times[1] is nan", "finite"]),
    "a time of text": (["times", 1], "1", ["times[1] is '1'", "number"]),
    "positions without an arm": (["positions", "left"], GONE, ["positions has no arm 'left'"]),
    "positions of a stranger": (["positions", "lefty"], [], ["positions", "'lefty'", "Did you mean 'left'?"]),
    "fewer positions than times": (
        ["positions", "left", 0],
        GONE,
        ["positions.left has 2", "3, one for each of the times"],
    ),
    "positions of the wrong length": (["positions", "left", 1], [0, 0], ["positions.left[1] has 2", "6", "ur5e"]),
    "a position that is NaN": (["positions", "left", 1, 2], NAN, ["positions.left[1][2] is nan", "finite"]),
    "positions that are no list": (["positions", "left"], {}, ["positions.left is {}", "list of configurations"]),
    "accelerations without velocities": (
        ["accelerations"],
        {"left": [[0] * 6] * 3, "right": [[0] * 6] * 3},
        ["velocities is missing", "accelerations"],
    ),
    "velocities of the wrong length": (["velocities"], {"left": [], "right": []}, ["velocities.left has 0", "3"]),
    "a misspelt field": (["position"], {}, ["'position'", "Did you mean 'positions'?"]),
}

TEXTS = {
    "nothing": (b"", ["not JSON", "line 1"]),
    "a torn file": (b'{"schema": "mmp-instances/1", "cell": {"ar', ["not JSON", "column"]),
    "a comma too many": (b'{"arms": [],}', ["not JSON", "line 1, column 13"]),
    "a field twice": (b'{"arms": [], "arms": []}', ["'arms' twice"]),
    "binary": (bytes(range(256)), ["not text in UTF-8", "0x80 at 128"]),
    "zeros": (bytes(1000), ["not JSON"]),
    "another encoding": ("{}".encode("utf-16"), ["not text in UTF-8", "0xff at 0"]),
    "lists in lists": (b"[" * 200_000, ["nested too deeply"]),
    "objects in objects": (b'{"arms":' * 200_000, ["nested too deeply"]),
    "a list": (b"[1, 2]", ["[1, 2]", "an object"]),
    "a number": (b"3", ["3", "an object"]),
    "null": (b"null", ["null", "an object"]),
}
"""Name of a fault -> content of a file that is no JSON object, and words of the message."""

YAML_TEXTS = {
    "nothing": (b"", ["null", "an object"]),
    "a tab": (b"arms:\n\t- name: a", ["not YAML", "line 2, column 1"]),
    "a field twice": (b"arms: []\narms: []", ["'arms' twice"]),
    "a number for a field": (b"1: 2", ["field name 1 must be text"]),
    "binary": (bytes(range(256)), ["not text in UTF-8"]),
    "control characters": (b"arms: \x01", ["not YAML"]),
    "lists in lists": (b"[" * 500, ["nested too deeply"]),
    "dashes": (b"- " * 500, ["nested too deeply"]),
    "aliases upon aliases": (b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]", ["line 2", "aliases", "not supported"]),
    "a Python object": (b"arms: !!python/object/apply:os.getcwd []", ["line 1", "'!!python/object"]),
    "a truth that is none": (b"arms: !!bool abc", ["line 1", "tag '!!bool' is not supported"]),
    "a number that is none": (b'name: !!int ""', ["line 1", "tag '!!int' is not supported"]),
    "a time that is none": (b"name: !!timestamp x", ["line 1", "tag '!!timestamp' is not supported"]),
    "an object that is a list": (b"arms: []\nobstacles: !!map [1]", ["line 2", "tag '!!map' is not supported"]),
    "an empty tag": (b"name: ! x", ["line 1", "tag '!' is not supported"]),
    "a tag of somebody": (b"%TAG ! tag:x.org:\n---\nname: !y x", ["line 3", "tag 'tag:x.org:y' is not supported"]),
    "a list for a field": (b"[a]: b", ["line 1", "field name must be text"]),
    "an object for a field": (b"? {a: b}\n: c", ["line 1", "field name must be text"]),
    "an alias for a field": (b"&a x: 1\n*a : 2", ["line 2", "aliases", "not supported"]),
    "merged objects": (b"<<: {arms: []}", ["unknown field '<<'"]),
    "a character beyond Unicode": (b'name: "\\U00110000"', ["not YAML", "line 1"]),
    "a character far beyond Unicode": (b'name: "\\UFFFFFFFF"', ["not YAML", "line 1"]),
    "half of a character": (b'{arms: [], name: "\\ud800"}', ["not YAML"]),
    "two documents": (b"arms: []\n---\narms: []", ["not YAML", "another document"]),
    "a date that is none": (b"arms: 2026-99-99", ["arms is '2026-99-99'", "a list"]),
}


def spoilt(good: dict[str, Any], path: list[Any], value: Any) -> dict[str, Any]:
    """Returns the valid data with `value` at `path`, or without the field at `path`."""
    # The copy through JSON shares no list with the valid data.
    good = json.loads(json.dumps(good))
    *parents, last = path
    inner: Any = good
    for key in parents:
        inner = inner[key]
    if value is GONE:
        del inner[last]
    else:
        inner[last] = value
    return good


def text(data: Any) -> str:
    """Returns the data as Python writes JSON, with NaN and infinities."""
    return json.dumps(data)
