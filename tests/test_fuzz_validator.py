"""The fuzzer's validator finds faults of every kind in files, and the program refuses each of these files."""

import json

import pytest
from fuzz import inputs, samples, validator
from fuzz.process import Worker
from support import bad_files
from support.bad_files import GONE, spoilt

POSE = {"pose": {"position": [0.1, 0.15, 0.5], "quaternion": [0, 1, 0, 0]}}
STEP = ["jobs", 0, "steps", 0]
JOINT = ["joints", 0]
MESH = {"name": "m", "shape": "mesh", "position": [0, 3, 1]}
CORNERS = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
WRONG = {
    "jobs": {
        "no schema": (["schema"], GONE, "no schema"),
        "another schema": (["schema"], "mmp-jobs/99", "schema mmp-jobs/99"),
        "no cell": (["cell"], GONE, "a cell that is no object"),
        "no jobs": (["jobs"], [], "jobs []"),
        "a job without a name": (["jobs", 0, "name"], GONE, "a job named"),
        "a job of nobody": (["jobs", 0, "arm"], "nobody", "a job of 'nobody'"),
        "a job after an unknown one": (["jobs", 1, "after"], ["x"], "a job after 'x'"),
        "a job after itself": (["jobs", 1, "after"], ["b"], "a job after 'b'"),
        "jobs in a circle": (["jobs", 0, "after"], ["b"], "jobs that wait for each other: ['a', 'b']"),
        "no steps": (["jobs", 0, "steps"], [], "steps []"),
        "two kinds of a step": (STEP, {"move": "home", "wait": 1}, "a step"),
        "a negative wait": (["jobs", 0, "steps", 1, "wait"], -5, "wait -5"),
        "a line of two numbers": (STEP, {"line": [0, 0.1]}, "line [0, 0.1]"),
        "a grasp of an unknown object": (STEP, {"grasp": "x"}, "grasp of 'x'"),
        "a release of an unknown object": (STEP, {"release": "x"}, "release of 'x'"),
        "a pose of two numbers": ([*STEP, "move", "pose", "position"], [0.1, 0.1], "the position [0.1, 0.1] of a pose"),
        "a pose without rotation": ([*STEP, "move", "pose", "free"], GONE, "a pose without quaternion"),
        "a configuration of two joints": ([*STEP, "move"], [0, 1], "a configuration [0, 1]"),
        "a move to an unknown place": ([*STEP, "move"], "hom", "a goal hom"),
        "a start that stays": (["start"], {"arm0": "stay"}, "a start stay"),
        "an object without a place": (["objects", 0, "position"], GONE, "position None"),
        "a box of two edges": (["objects", 0, "size"], [0.05, 0.05], "size [0.05, 0.05]"),
        "an object without a name": (["objects", 0, "name"], GONE, "an object named"),
    },
    "cell": {
        "a position that is a word": (["arms", 0, "position"], "x", "position x"),
        "a held mesh": (["arms", 0, "held"], {**MESH, "pieces": [CORNERS]}, "a mesh that is held"),
        "a mesh of three corners": (["obstacles", 0], {**MESH, "pieces": [CORNERS[:3]]}, "a piece"),
        "a mesh of nothing": (["obstacles", 0], MESH, "neither"),
        "a touch of an unknown arm": (["obstacles", 0, "may_touch"], ["x/link"], "may_touch"),
        "a negative speed": (["obstacles", 0, "speed"], -1, "speed -1"),
    },
    "instances": {
        "a goal without an arm": (["instances", 0, "goal", "right"], GONE, "a goal without the arm right"),
        "a flat pose": (["instances", 0, "goal", "left"], {"pose": {"position": [0, 1], "free": "rotation"}}, "[0, 1]"),
        "no choice": (["instances", 0, "goal", "left"], {"any": []}, "any []"),
        "a negative angle": (
            ["instances", 0, "keep"],
            {"left": {"upright": {"axis": [0, 0, 1], "within": -1}}},
            "within -1",
        ),
        "no axis": (
            ["instances", 0, "keep"],
            {"left": {"upright": {"axis": [0, 0, 0], "within": 1}}},
            "axis [0, 0, 0]",
        ),
        "an axis without an angle": (["instances", 0, "keep"], {"left": {"upright": {"axis": [0, 0, 1]}}}, "no within"),
        "an angle without an axis": (["instances", 0, "keep"], {"left": {"upright": {"within": 1}}}, "no axis"),
    },
    "check plan": {
        "no cell": (["problem", "cell"], GONE, "a cell that is no object"),
        "schema 99": (["schema"], "mmp-plan/99", "schema mmp-plan/99"),
        "a word for a time": (["times"], "x", "times x"),
        "no positions": (["positions"], GONE, "positions of other arms"),
        "no velocity limit": (["problem", "max_velocity"], GONE, "no max_velocity"),
        "a goal asked of two joints": (["problem", "goal_asked"], {"left": [0, 1]}, "a configuration [0, 1]"),
    },
    "check schedule": {
        "no period": (["period_s"], GONE, "no period_s"),
        "a negative period": (["period_s"], -1, "period_s -1"),
        "a row too few": (["trajectories", "arm0", "positions", 0], GONE, "positions of arm0"),
        "an event of nobody": (["events", 0, "arm"], "nobody", "an event"),
        "an event of no kind": (["events", 0, "kind"], "hop", "an event"),
        "an event that ends before": (["events", 0, "until"], -5, "ends before it begins"),
        "an order of one": (["order"], [[["arm0", 0]]], "order"),
        "an order of nobody": (["order"], [[["x", 0], ["arm0", 0]]], "order"),
        "a negative wait": (["jobs", 0, "steps", 1, "wait"], -5, "wait -5"),
        "no margins": (["margins"], GONE, "margins None"),
        "no velocity limit": (["max_velocity"], GONE, "no max_velocity"),
        "no start": (["start"], GONE, "start of other arms"),
    },
    "check episode": {
        "no plans": (["plans"], [], "plans []"),
        "a plan without schema": (["plans", 0, "schema"], GONE, "a plan without its schema"),
        "a plan without a cell": (["plans", 1, "problem", "cell"], GONE, "a cell that is no object"),
    },
    "robot folder": {
        "limits that are turned": ([*JOINT, "lower"], 3.0, "limits 3.0, 2.0"),
        "a negative velocity": ([*JOINT, "velocity"], -1.0, "velocity -1.0"),
        "no velocity": ([*JOINT, "velocity"], 0, "velocity 0"),
        "a negative acceleration": ([*JOINT, "acceleration"], -1.0, "acceleration -1.0"),
        "a negative jerk": ([*JOINT, "jerk"], -1.0, "jerk -1.0"),
        "a negative effort": ([*JOINT, "effort"], -1.0, "effort -1.0"),
        "no axis": ([*JOINT, "axis"], [0, 0, 0], "axis [0, 0, 0]"),
        "a joint of no type": ([*JOINT, "type"], "ball", "a joint of type ball"),
        "an origin of two": ([*JOINT, "origin", "xyz"], [0, 0], "origin"),
        "no joints": (["joints"], [], "joints []"),
        "links too few": (["links"], ["base_link"], "links"),
        "a home of two": (["home"], [0, 0], "home [0, 0]"),
        "a home beyond its limits": (["home", 0], 2.5, "home [2.5"),
        "no tucked": (["tucked"], GONE, "tucked None"),
        "no flange": (["flange"], GONE, "flange None"),
    },
    "own tool": {
        "no mount": (["mount"], GONE, "mount None"),
        "a point of two": (["point"], [0, 0], "point [0, 0]"),
        "a negative opening": (["opening"], -1, "opening -1"),
    },
    "spheres": {
        "no radius": (["28", "hand", 0, 3], 0, "sphere"),
        "a sphere of three": (["fine", "hand", 0, 3], GONE, "sphere"),
    },
    "hulls": {
        "a negative radius": (["hand", 0, "radius"], -1, "the radius -1 of a hull"),
        "a flat vertex": (["hand", 0, "vertices", 0], [0, 0], "a hull"),
        "no vertices": (["hand", 0, "vertices"], [], "a hull"),
    },
    "settings": {
        "a negative time limit": (["time_limit_s"], -1, "time_limit_s -1"),
        "a negative count": (["count"], -3, "count -3"),
        "a negative seed": (["seed"], -1, "seed -1"),
        "a planner without a label": (["planners", 0, "label"], GONE, "no label"),
        "a negative margin": (["margin"], -1, "margin -1"),
    },
    "continued bench": {
        "a negative memory limit": (["memory_limit_mb"], -1, "memory_limit_mb -1"),
    },
    "continued dataset": {
        "a negative number of steps": (["instances", 0, "steps"], -3, "steps -3"),
        "a negative time limit": (["settings", "time_limit"], -1, "time_limit -1"),
        "a negative seed": (["settings", "seed"], -1, "seed -1"),
        "a file without steps": (["instances", 0, "steps"], GONE, "a file without steps"),
    },
    "report": {
        "a status of no kind": (["status"], "won", "status won"),
        "a negative time": (["planning_time_s"], -1, "planning_time_s -1"),
        "a negative cost": (["cost_rad"], -1, "cost_rad -1"),
        "no arms": (["arms"], 0, "arms 0"),
        "a number too large": (["makespan_s"], 1e13, "the number"),
        "no instance": (["instance"], GONE, "no instance"),
    },
}
"""Kind of line -> name of a fault -> its place in the file, the wrong value, and words of the validator."""
CASES = [(kind, name) for kind, faults in WRONG.items() for name in faults]


@pytest.fixture(scope="module")
def worker():
    out = Worker()
    yield out
    out.close()


def spoilt_file(kind, fault):
    """Returns the name of the file of a line, and its content with a fault."""
    path, value, _ = WRONG[kind][fault]
    name = samples.LINES[kind][0]
    good = samples.contents()[name].decode()
    if name.endswith(".jsonl"):
        first, _, rest = good.partition("\n")
        return name, (json.dumps(spoilt(json.loads(first), path, value)) + "\n" + rest).encode()
    return name, json.dumps(spoilt(json.loads(good), path, value)).encode()


@pytest.mark.parametrize(("kind", "fault"), CASES)
def test_the_validator_knows_wrong_values(kind, fault):
    name, content = spoilt_file(kind, fault)
    assert any(WRONG[kind][fault][2] in reason for reason in validator.file_nonsense(name, content))


@pytest.mark.parametrize(("kind", "fault"), CASES)
def test_the_program_refuses_what_the_validator_knows(kind, fault, worker):
    name, content = spoilt_file(kind, fault)
    given = inputs.Input(kind=kind, line=inputs.with_limits(samples.LINES[kind][1]), files={name: content})
    code, faults = inputs.tried(given, worker)
    assert (code in (1, 2), faults) == (True, [])


DOCUMENTS = {
    "cell.json": (bad_files.CELLS, bad_files.good_cell),
    "instances.json": (bad_files.INSTANCES, bad_files.good_instances),
    "plan.json": (bad_files.PLANS, bad_files.good_plan),
}
NOT_JUDGED = "overlapping bases"
"""Fault for which the validator would need the geometry of the arms."""
BAD_DOCUMENTS = [(name, case) for name, (faults, _) in DOCUMENTS.items() for case in faults if case != NOT_JUDGED]


@pytest.mark.parametrize(("name", "case"), BAD_DOCUMENTS)
def test_the_validator_knows_what_the_readers_refuse(name, case):
    faults, good = DOCUMENTS[name]
    path, value, _ = faults[case]
    assert validator.file_nonsense(name, json.dumps(spoilt(good(), path, value)).encode())


@pytest.mark.parametrize("name", ["cell.json", "cell.yaml"])
def test_the_validator_knows_files_that_are_no_objects(name):
    texts = bad_files.TEXTS if name.endswith(".json") else bad_files.YAML_TEXTS
    assert [case for case, (content, _) in texts.items() if not validator.file_nonsense(name, content)] == []


VIOLATIONS = {
    "a joint out of limits": ("plan.json", ["positions", "left", 1, 0], 9.0, "left beyond its limits"),
    "a joint of a carried robot out of limits": (
        "own_arms.json",
        ["positions", "left", 0, 0],
        3.0,
        "left beyond its limits",
    ),
    "another start": ("plan.json", ["problem", "start", "left", 0], 0.5, "start of left is another one"),
    "another goal": ("plan.json", ["problem", "goal", "left", 0], 0.5, "goal of left is another one"),
    "a motion too fast": ("plan.json", ["times", 1], 0.1, "left too fast"),
    "a late begin": ("plan.json", ["times", 0], 0.1, "the first time 0.1"),
    "a gap": ("episode.json", ["plans", 1, "positions", "left", 0, 0], 0.5, "a plan that begins elsewhere"),
}
"""Name -> a file, a place in it, the wrong value, and words of the validator."""


@pytest.mark.parametrize("case", VIOLATIONS)
def test_the_validator_knows_what_the_checker_must_refute(case, worker):
    name, path, value, words = VIOLATIONS[case]
    content = json.dumps(spoilt(json.loads(samples.contents()[name]), path, value)).encode()
    assert any(words in reason for reason in validator.violations(content))
    given = inputs.Input(kind="check plan", line=["check", name], files={name: content})
    assert inputs.tried(given, worker) == (1, [])
    accepted = inputs.tried(given, worker, "accepts_everything")[1]
    assert any(words in fault for fault in accepted), accepted


def test_the_good_plans_violate_nothing():
    assert [name for name, content in samples.contents().items() if validator.violations(content)] == []


def test_the_validator_knows_a_carried_robot_that_was_changed(worker):
    plan = json.loads(samples.contents()["hashed_arms.json"])
    files = next(iter(plan["problem"]["cell"]["robots"].values()))
    files["robot.json"]["joints"][0]["velocity"] += 1e-6
    content = json.dumps(plan).encode()
    (nonsense,) = validator.file_nonsense("hashed_arms.json", content)
    assert "changed since its sha256 was written" in nonsense
    given = inputs.Input(kind="check plan", line=["check", "hashed_arms.json"], files={"hashed_arms.json": content})
    assert inputs.tried(given, worker) == (2, [])
