"""Robots that are not built in travel with cells and plans."""

import copy
import json
import pickle
import re

import numpy as np
import pytest
from support.small_arms import box_mesh, mjcf, urdf, with_mesh

import mmp_env
from mmp_env.check import check_document, models
from mmp_env.errors import MmpError
from mmp_env.export import export_plan
from mmp_env.files.cell_file import cell_from_dict, cell_to_dict
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_env.importing.robot_folder import ImportOptions, add_robot
from mmp_env.model import description
from mmp_env.model.plan import Plan
from mmp_env.sim.execution import execute_plan
from mmp_env.sim.simulation import Simulation


def place(name, robot, x):
    return {"name": name, "robot": robot, "position": [x, 0.0, 0.0]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two robots called `arm`, in folders `a` and `b`, and one called `ur5e`; all differ."""
    root = tmp_path_factory.mktemp("robots")
    (root / "a.urdf").write_text(urdf())
    (root / "c.xml").write_text(mjcf())
    with_mesh(root / "b.xml", *box_mesh((0.06, 0.05, 0.04)))
    for source, out, name in (("a.urdf", "a", "arm"), ("b.xml", "b", "arm"), ("c.xml", "c", "ur5e")):
        add_robot(root / source, root / out, ImportOptions(name=name), cache=None, progress=lambda line: None)
    return root


@pytest.fixture(scope="module")
def foreign(folder):
    """A cell of these robots and a built-in one."""
    arms = [place("one", "./a/arm", 0.0), place("two", "./b/arm", 1.0), place("three", "./c/ur5e", 2.0)]
    data = {"spheres": "fine", "arms": [*arms, place("again", "./a/arm", 3.0), place("panda", "panda", 5.0)]}
    return cell_from_dict(data, str(folder / "cell.json"))


def small_steps(cell):
    """Returns a plan on which all arms turn a little from home."""
    start = {arm.name: arm.robot.home for arm in cell.arms}
    goal = {name: q + 0.05 * np.eye(len(q))[0] for name, q in start.items()}
    positions = {name: np.stack([start[name], goal[name]]) for name in start}
    return Plan(problem=mmp_env.make_problem(cell, start, goal), times=np.array([0.0, 1.0]), positions=positions)


def test_robots_of_one_name_and_other_content_have_different_keys(foreign, folder):
    data = cell_to_dict(foreign)
    assert [arm["robot"] for arm in data["arms"]] == ["arm", "arm-2", "ur5e-2", "arm", "panda"]
    assert list(data["robots"]) == ["arm", "arm-2", "ur5e-2"]
    assert set(data["robots"]["ur5e-2"]) == {"robot.json", "spheres.json", "hulls.json", "ur5e.xml", "sha256"}
    assert str(folder) not in json.dumps(data)


def test_a_written_cell_reads_back_the_same_without_any_folder(foreign, monkeypatch):
    monkeypatch.setattr("mmp_env.model.robot_reading.find_robot", lambda name: pytest.fail(f"{name} was looked up"))
    data = json.loads(json.dumps(cell_to_dict(foreign)))
    data["arms"].pop()  # the panda is built in
    cell = cell_from_dict(data, "cell.json")
    assert cell_to_dict(cell) == data
    assert [arm.robot.name for arm in cell.arms] == ["arm", "arm", "ur5e", "arm"]
    assert cell.arms[0].robot is cell.arms[3].robot
    assert pickle.loads(pickle.dumps(cell)).arms[1].robot.files == cell.arms[1].robot.files


@pytest.mark.parametrize("spheres", ["fine", "exact"])
def test_a_plan_is_checked_executed_and_exported_after_its_robots_are_gone(foreign, spheres, tmp_path):
    data = plan_to_dict(small_steps(mmp_env.find_cell(foreign, spheres=spheres)))
    plan = plan_from_dict(json.loads(json.dumps(data)))
    for exact in (False, True):
        assert mmp_env.check_plan(plan, exact=exact).valid
    report = execute_plan(Simulation(plan.problem.cell), plan)
    assert report.reached
    assert not report.contacts
    for name in ("plan.csv", "plan.npz", "plan.xml"):
        export_plan(plan, tmp_path / name)
    mmp_env.save_plan(plan, tmp_path / "plan.json")
    first = (tmp_path / "plan.json").read_bytes()
    mmp_env.save_plan(mmp_env.load_plan(tmp_path / "plan.json"), tmp_path / "plan.json")
    assert (tmp_path / "plan.json").read_bytes() == first


def test_reading_a_plan_leaves_no_robot_behind_when_the_plan_is_gone(foreign):
    import gc
    import weakref

    plan = plan_from_dict(plan_to_dict(small_steps(foreign)))
    robot = weakref.ref(plan.problem.cell.arms[0].robot)
    del plan
    gc.collect()
    assert robot() is None


def set_at(*path):
    """Returns a function that sets the value at a path of keys in a robot, or deletes it if there is no value."""
    *path, key, value = path

    def change(robot):
        for step in path:
            robot = robot[step]
        if value is ...:
            del robot[key]
        else:
            robot[key] = value

    return change


def replaced(old, new):
    def change(robot):
        assert old in robot["arm.xml"]
        robot["arm.xml"] = robot["arm.xml"].replace(old, new, 1)

    return change


FAULTS = {
    "no robot.json": (set_at("robot.json", ...), "robots.arm: robot.json is missing"),
    "no spheres": (set_at("spheres.json", ...), "spheres.json is missing"),
    "no MJCF": (set_at("arm.xml", ...), "has 0 files NAME.xml; it must have one"),
    "two MJCFs": (set_at("other.xml", "<mujoco/>"), "has 2 files NAME.xml"),
    "another file": (set_at("notes.txt", "x"), "'notes.txt' is not a file of a robot called 'arm'"),
    "text for numbers": (set_at("robot.json", "text"), "robot.json is 'text'; it must be an object"),
    "a number for MJCF": (set_at("arm.xml", 3), "arm.xml is 3; it must be text"),
    "nan": (set_at("robot.json", "joints", 1, "lower", float("nan")), "robot.json: joints[1].lower is nan"),
    "misspelled field": (
        set_at("robot.json", "ring_sphere", "fine"),
        "robot.json: unknown field 'ring_sphere'. Did you mean 'ring_spheres'?",
    ),
    "misspelled field of a joint": (
        set_at("robot.json", "joints", 1, "typ", "slide"),
        "robot.json: joints[1]: unknown field 'typ'. Did you mean 'type'?",
    ),
    "field of no import": (set_at("robot.json", "imported", "tips", 0), "robot.json: imported: unknown field 'tips'"),
    "field of no origin": (
        set_at("robot.json", "joints", 1, "origin", "quat", 0),
        "robot.json: joints[1].origin: unknown field 'quat'",
    ),
    "field of no pose": (set_at("robot.json", "flange", "quat", 0), "robot.json: flange: unknown field 'quat'"),
    "field of no hull": (set_at("hulls.json", "fore", 0, "edges", 0), "hulls.json: fore[0]: unknown field 'edges'"),
    "huge": (set_at("robot.json", "home", 0, 10**400), "robot.json: home[0] is a number of 401 digits"),
    "home beyond a limit": (set_at("robot.json", "home", 0, 9.0), "home[0] is 9.0; joint 'turn' goes from"),
    "truth": (set_at("robot.json", "joints", 0, "effort", True), "joints[0].effort is true"),
    "no axis": (set_at("robot.json", "joints", 0, "axis", ...), "joints[0].axis is missing"),
    "long axis": (set_at("robot.json", "joints", 0, "axis", [0, 0, 2]), "it must have length 1"),
    "one link less": (set_at("robot.json", "links", 3, ...), "links has 3 entries; it must have 4"),
    "a link twice": (set_at("robot.json", "links", 3, "fore"), "links[3] is 'fore'; links have different names"),
    "spheres of no link": (set_at("spheres.json", "28", "leg", [[0, 0, 0, 1]]), "28 names 'leg', which is not a link"),
    "three numbers": (set_at("spheres.json", "fine", "fore", 0, [0, 0, 1]), "fine.fore[0] is [0, 0, 1]; it must be a"),
    "no radius": (set_at("spheres.json", "fine", "fore", 0, 3, 0), "fine.fore[0][3] is 0; a radius must be above 0"),
    "a hull of no link": (set_at("hulls.json", "leg", []), "hulls.json: 'leg' is not a link"),
    "an infinite vertex": (
        set_at("hulls.json", "fore", 0, "vertices", 0, 0, float("inf")),
        "hulls.json: fore[0].vertices[0][0] is inf",
    ),
    "no XML": (replaced("<mujoco", "<mujoc"), "arm.xml is not XML"),
    "an include": (replaced("<worldbody>", '<include file="/etc/hostname"/><worldbody>'), "has the element 'include'"),
    "a mesh file": (replaced("<asset>", '<asset><mesh file="/etc/x.stl"/>'), "has the attribute 'file' in an element"),
    "an entity": (replaced("<mujoco", '<!DOCTYPE a [<!ENTITY b "c">]><mujoco'), "has a declaration that begins with"),
    "no joint": (replaced('name="joint2"', 'name="elbow"'), "arm.xml is not MJCF that MuJoCo can read"),
    "another link": (replaced('body name="fore"', 'body name="leg"'), "arm.xml"),
    "a wrong type": (replaced("<inertial", '<inertial mass="x"'), "arm.xml is not"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_robot_is_one_sentence_with_file_and_field(foreign, fault):
    change, words = FAULTS[fault]
    plan = plan_to_dict(small_steps(foreign))
    change(plan["problem"]["cell"]["robots"]["arm"])
    with pytest.raises(MmpError) as error:
        plan_from_dict(plan, "plan.json")
    assert str(error.value).startswith("plan.json: problem.cell.robots.arm")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("fault", FAULTS)
def test_the_checker_raises_for_no_fault_of_a_robot(foreign, fault):
    plan = copy.deepcopy(plan_to_dict(small_steps(foreign)))
    FAULTS[fault][0](plan["problem"]["cell"]["robots"]["arm"])
    for spheres in ("fine", "exact"):
        plan["problem"]["cell"]["spheres"] = spheres
        check_document(plan)


@pytest.mark.parametrize("fault", [name for name, (_, words) in FAULTS.items() if "unknown field" in words])
@pytest.mark.parametrize("exact", [False, True])
def test_the_checker_refuses_an_unknown_field_that_the_reader_refuses(foreign, fault, exact):
    plan = copy.deepcopy(plan_to_dict(small_steps(foreign)))
    assert mmp_env.check_plan(plan, exact=exact).valid
    FAULTS[fault][0](plan["problem"]["cell"]["robots"]["arm"])
    (violation,) = mmp_env.check_plan(plan, exact=exact).violations
    assert violation.rule == "schema"
    assert "which this checker does not know" in str(violation)


def test_the_checker_knows_the_fields_that_the_reader_knows():
    assert set(models._FIELDS["robots"]) == set(description._ROBOT_FIELDS)
    assert set(models._FIELDS["tools"]) == set(description._TOOL_FIELDS)
    assert models._INNER_FIELDS["imported"] == description._IMPORT_FIELDS
    assert models._JOINT_FIELDS == description._JOINT_FIELDS


@pytest.mark.parametrize("name", ["panda", "none", "a/b", ""])
def test_the_name_of_a_built_in_robot_and_bad_names_are_refused(foreign, name):
    data = cell_to_dict(foreign)
    data["robots"][name] = data["robots"]["arm"]
    with pytest.raises(MmpError, match=r"cell.json: robots"):
        cell_from_dict(data, "cell.json")


def test_a_carried_robot_comes_before_one_that_the_user_added(foreign, folder, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    options = ImportOptions(name="arm")
    add_robot(folder / "c.xml", tmp_path / "mmp-env" / "robots", options, cache=None, progress=lambda line: None)
    cell = cell_from_dict(cell_to_dict(foreign), "cell.json")
    assert cell.arms[0].robot.mjcf == foreign.arms[0].robot.mjcf
    assert mmp_env.load_robot("arm").mjcf != cell.arms[0].robot.mjcf


def test_a_cell_without_hulls_of_one_robot_has_fine_spheres_unless_it_says_otherwise(foreign):
    plan = plan_to_dict(small_steps(foreign))
    cell = plan["problem"]["cell"]
    del cell["spheres"]
    assert cell_from_dict(cell, "cell.json").spheres == "exact"
    assert check_document(plan).spheres == "exact"
    del cell["robots"]["arm"]["hulls.json"], cell["robots"]["arm"]["sha256"]
    assert cell_from_dict(cell, "cell.json").spheres == "fine"
    assert check_document(plan).spheres == "fine"
    with pytest.raises(MmpError, match="robot 'arm' of arm 'one' has no hulls"):
        cell_from_dict(cell | {"spheres": "exact"}, "cell.json")


def test_a_ring_of_an_imported_robot_has_exact_geometry_and_one_of_built_in_robots_28_spheres(folder, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(folder / "data"))
    (folder / "data" / "mmp-env").mkdir(parents=True)
    (folder / "data" / "mmp-env" / "robots").symlink_to(folder / "a")
    assert mmp_env.find_cell("ring-2", robot="arm").spheres == "exact"
    assert mmp_env.find_cell("ring-2").spheres == "28"
    assert mmp_env.find_cell("ring-2", robot="arm", spheres="fine").spheres == "fine"


@pytest.mark.parametrize("change", ["hulls.json", "spheres.json", "robot.json", "arm.xml", "sha256"])
def test_a_carried_robot_that_was_changed_is_refused(foreign, change):
    data = json.loads(json.dumps(plan_to_dict(small_steps(foreign))))
    files = data["problem"]["cell"]["robots"]["arm"]
    if change.endswith(".json"):
        files[change] = json.loads(re.sub(r"0\.\d+", "0.5", json.dumps(files[change]), count=1))
    else:
        files[change] = re.sub(r"\d", lambda digit: "21"[digit[0] == "2"], files[change], count=1)
    with pytest.raises(MmpError, match=r"cell.robots.arm was changed after the file was written"):
        plan_from_dict(copy.deepcopy(data))
    (violation,) = check_document(data).violations
    assert violation.rule == "schema"
    assert "'arm' among the robots of the cell was changed after the file was written" in violation.message
    del files["sha256"]  # as in files of before, and of those who change it on purpose
    assert change == "sha256" or "was changed" not in str(check_document(data).violations)


def test_the_hash_of_a_carried_robot_does_not_depend_on_how_numbers_are_written(foreign):
    data = json.loads(json.dumps(plan_to_dict(small_steps(foreign))))
    whole = json.loads(json.dumps(data).replace(".0,", ","), object_pairs_hook=lambda pairs: dict(reversed(pairs)))
    assert whole["problem"]["cell"]["robots"]["arm"] == data["problem"]["cell"]["robots"]["arm"]
    assert check_document(whole).valid
    assert plan_to_dict(plan_from_dict(whole))["problem"]["cell"]["robots"] == data["problem"]["cell"]["robots"]
