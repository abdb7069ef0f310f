"""Good files of every kind, and good command lines that read them."""

from __future__ import annotations

import contextlib
import copy
import functools
import io
import json
import struct
import tempfile
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from support import bad_files, report_folders, scenes, small_arms, small_jobs

import mmp_env
import mmp_planners
from fuzz import mesh_samples
from mmp_cli.main import main
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.importing.chain_choice import ChainOptions
from mmp_env.importing.robot_folder import ImportOptions, add_robot
from mmp_env.importing.tool_folder import ToolOptions, add_tool
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.schedule_file import schedule_to_dict

_CONTINUED = ["bench", "instances.json", "--planners", "prioritized", "--workers", "1", "--out", "begun"]
_DATASET = ["dataset", "cell.json", "--count", "1", "--planner", "prioritized", "--out", "episodes"]
_FIXTURES = ["plan", "fixtures.json", "--start", "home", "--goal", "tucked", "--planner", "rrt-connect"]
_OWN = ["plan", "own.json", "--start", "home", "--goal", "tucked", "--planner", "prioritized"]
LINES: dict[str, tuple[str, list[str]]] = {
    "cell": (
        "cell.json",
        ["plan", "cell.json", "--start", "@ends.json", "--goal", "@goal.json", "--planner", "rrt-connect"],
    ),
    "cell yaml": (
        "cell.yaml",
        ["plan", "cell.yaml", "--start", "tucked", "--goal", "home", "--planner", "prioritized"],
    ),
    "instances": ("instances.json", ["plan", "instances.json", "--instance", "turn", "--planner", "auto"]),
    "goals": ("goal.json", ["plan", "cell.json", "--start", "@ends.json", "--goal", "@goal.json", "--planner", "ecbs"]),
    "scene": (
        "scene.xml",
        ["plan", "scene.xml", "--arms", "left=l_,right=r_", "--start", "home", "--goal", "tucked", "--planner", "auto"],
    ),
    "ring": ("", ["plan", "MultiArmCell-2", "--seed", "3", "--planner", "apf-ecbs", "--margin", "0.005", "--json"]),
    "check plan": ("plan.json", ["check", "plan.json"]),
    "check own arms": ("own_arms.json", ["check", "own_arms.json"]),
    "check hashed arms": ("hashed_arms.json", ["check", "hashed_arms.json"]),
    "check schedule": ("schedule.json", ["check", "schedule.json", "--json"]),
    "check episode": ("episode.json", ["check", "episode.json"]),
    "export csv": ("plan.json", ["export", "plan.json", "--to", "out.csv"]),
    "export ros": ("plan.json", ["export", "plan.json", "--to", "out.yaml", "--joint-names", "{arm}_{joint}"]),
    "retime": ("plan.json", ["export", "plan.json", "--to", "out.csv", "--retime", "--rate", "100"]),
    "jobs": ("jobs.json", ["run", "jobs.json", "--out", "out.json", "--seed", "1"]),
    "robot": ("small.urdf", ["robot", "add", "small.urdf", "--name", "small", "--out", "robots"]),
    "robot folder": ("known/small/robot.json", ["robot", "check", "known/small"]),
    "spheres": ("known/small/spheres.json", ["robot", "check", "known/small"]),
    "hulls": ("known/small/hulls.json", ["robot", "check", "known/small"]),
    "robot model": ("known/small/small.xml", ["robot", "check", "known/small"]),
    "robot show": ("known/small/robot.json", ["robot", "show", "known/small", "--image", "out.png"]),
    "own robot": ("known/small/robot.json", _OWN),
    "own tool": ("known/gripper/tool.json", _OWN),
    "mesh obj": ("part.obj", ["robot", "add", "mesh.urdf", "--name", "meshed", "--out", "robots"]),
    "mesh stl": ("part.stl", ["tool", "add", "mesh.xml", "--name", "meshed", "--out", "tools"]),
    "mesh dae": ("box.dae", ["robot", "add", "collada.urdf", "--name", "meshed", "--out", "robots"]),
    "fixtures": ("fixtures.json", _FIXTURES),
    **{f"fixture {name}": (name, _FIXTURES) for name in mesh_samples.FIXTURES},
    "show": ("plan.json", ["show", "plan.json", "--rerun", "out.rrd"]),
    "report": ("results/results.jsonl", ["report", "results"]),
    "settings": ("results/settings.json", ["report", "results", "--title", "x"]),
    "dataset": ("cell.json", ["dataset", "cell.json", "--count", "1", "--out", "data"]),
    "ends": ("ends.json", ["plan", "cell.json", "--start", "@ends.json", "--goal", "@goal.json", "--planner", "ecbs"]),
    "published": ("other.csv", ["report", "results", "--against", "other.csv"]),
    "tool": ("gripper.xml", ["tool", "add", "gripper.xml", "--name", "gripper", "--out", "tools"]),
    "bench": ("instances.json", ["bench", "instances.json", "--planners", "auto", "--workers", "1", "--out", "new"]),
    "continued bench": ("begun/settings.json", _CONTINUED),
    "continued results": ("begun/results.jsonl", _CONTINUED),
    "continued dataset": ("episodes/dataset.json", _DATASET),
    "continued episodes": ("episodes/episodes/00000.npz", [*_DATASET, "--format", "minari"]),
    "list": ("", ["list", "--json"]),
}
"""Name -> the file that is changed, and a command line that is accepted."""
NAMED_IN = {
    "known/small/robot.json": "own.json",
    "known/gripper/tool.json": "own.json",
    "part.obj": "mesh.urdf",
    "part.stl": "mesh.xml",
    "box.dae": "collada.urdf",
    **dict.fromkeys(mesh_samples.FIXTURES, "fixtures.json"),
}
"""File that no command line names -> the file that names it."""
NOT_DRAWN = ("robot show",)
"""Lines that read their files and are refused then, because rendering is off."""
RARELY = {
    **dict.fromkeys(("report", "settings", "published", "bench", "continued results"), 0.05),
    **dict.fromkeys(("continued bench", "continued dataset", "continued episodes"), 0.5),
    **dict.fromkeys(("robot folder", "tool", "hulls", "spheres", "mesh obj", "mesh dae"), 0.4),
    **{f"fixture {name}": 0.1 for name in mesh_samples.FIXTURES},
    "list": 0.2,
}
"""Name -> how often a line is drawn, relative to the others: these take many times as long."""
PATIENCE = {f"fixture {name}": 6.0 for name in mesh_samples.FIXTURES}
"""Name -> longest time of a line, relative to the others: the decomposition of a changed mesh may take a minute."""
TIME_LIMITS_S = {"plan": 0.1, "run": 2.0, "dataset": 0.1, "bench": 0.1}
"""Command -> its time limit [s]. `run` ends with its last job, the others may plan until the limit."""
_GRIPPER = """<mujoco>
  <worldbody>
    <body name="palm"><geom type="box" size="0.04 0.06 0.02" pos="0 0 0.02"/>
      <body name="finger" pos="0 0.02 0.05"><joint name="slide" type="slide" axis="0 1 0" range="0 0.04"/>
        <geom type="box" size="0.01 0.005 0.03"/></body>
      <site name="grasp" pos="0 0 0.1"/>
    </body>
  </worldbody>
</mujoco>
"""
_MESHED = """<mujoco><asset><mesh name="part" file="part.stl"/></asset>
  <worldbody><body name="palm"><geom type="mesh" mesh="part"/><site name="grasp" pos="0 0 0.1"/></body></worldbody>
</mujoco>
"""
_PUBLISHED = "instance,planner,solved,planning_time_s,cost_rad\nring/0,theirs,1,3,14\nring/1,theirs,0,,\n"


def _texts() -> dict[str, str]:
    cell, instances = bad_files.good_cell(), bad_files.good_instances()
    instances["instances"] = instances["instances"][:1]
    ends = instances["instances"][0]
    jobs = {
        "schema": "mmp-jobs/1",
        "name": "two",
        "cell": "ring-2",
        "objects": [{"name": "part", "shape": "box", "size": [0.05, 0.05, 0.1], "position": [0.1, 0.6, 0.05]}],
        "jobs": [
            {"name": "a", "arm": "arm0", "steps": [{"move": small_jobs.pose(0.1, 0.15, 0.5)}, {"wait": 0.1}]},
            {"name": "b", "steps": [{"move": "tucked"}], "after": ["a"]},
        ],
    }
    documents: dict[str, Any] = {
        "cell.json": cell,
        "instances.json": instances,
        "ends.json": ends["start"],
        "goal.json": ends["goal"],
        "plan.json": bad_files.good_plan(),
        "schedule.json": _schedule(jobs),
        "hashed_arms.json": (hashed := _plan_of_own_arms()),
        "own_arms.json": _without_hashes(hashed),
        "jobs.json": jobs,
        "results/settings.json": report_folders.settings("ecbs", "auto"),
        "episode.json": _episode(),
        "fixtures.json": {
            "name": "fixtures",
            "arms": [{"name": "arm", "robot": "ur5e", "position": [0, 0, 0]}],
            "obstacles": [
                {"name": file, "shape": "mesh", "file": file, "scale": 1.0, "position": [1.5, 0.5 * k, 0.5]}
                for k, file in enumerate(mesh_samples.FIXTURES)
            ],
        },
        "own.json": {
            "name": "own",
            "arms": [{"name": "arm", "robot": "known/small", "tool": "known/gripper", "position": [0, 0, 0]}],
        },
    }
    lines = [report_folders.line(f"ring/{k}", label) for k in range(5) for label in ("ecbs", "auto")]
    return {name: json.dumps(document, indent=1) for name, document in documents.items()} | {
        "cell.yaml": _yaml(cell),
        "scene.xml": scenes.scene(),
        "small.urdf": small_arms.urdf(),
        "gripper.xml": _GRIPPER,
        "mesh.urdf": small_arms.urdf(shape='<geometry><mesh filename="part.obj"/></geometry>'),
        "mesh.xml": _MESHED,
        "collada.urdf": small_arms.urdf(shape='<geometry><mesh filename="box.dae"/></geometry>'),
        "other.csv": _PUBLISHED,
        **_added(),
        "results/results.jsonl": "".join(json.dumps(line) + "\n" for line in lines),
    }


def contents() -> dict[str, bytes]:
    """Returns name -> content of all good files."""
    return dict(_contents())


@functools.cache
def _contents() -> dict[str, bytes]:
    out = {name: text.encode() for name, text in _texts().items()}
    corners = [[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 0.05]]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    out["part.obj"] = "\n".join([*lines, ""]).encode()
    rows = [struct.pack("<12fH", 0, 0, 0, *corners[a], *corners[b], *corners[c], 0) for a, b, c in faces]
    out["part.stl"] = bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows)
    return out | mesh_samples.boxes() | _begun(out)


def _begun(files: dict[str, bytes]) -> dict[str, bytes]:
    """Returns the folders of a benchmark and of a dataset that are done. The lines of results have fixed times."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name, contextlib.chdir(name):
        for file in ("instances.json", "cell.json"):
            Path(file).write_bytes(files[file])
        for line in (_CONTINUED, _DATASET):
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                assert main([*line, "--time-limit", str(TIME_LIMITS_S[line[0]])]) == 0
        result = json.dumps(report_folders.line("pair/turn", "prioritized")) + "\n"
        Path("begun/results.jsonl").write_text(result)
        found = [path for folder in ("begun", "episodes") for path in sorted(Path(folder).rglob("*"))]
        return {str(path): path.read_bytes() for path in found if path.is_file()}


def write_all(folder: Path) -> dict[str, bytes]:
    """Writes all good files into a folder. Returns name -> content."""
    out = contents()
    for name, content in out.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return out


def _added() -> dict[str, str]:
    """Returns the files of a robot and of a tool that were added."""
    robot = ImportOptions(name="small", chain=ChainOptions(), package_dirs=())
    tool = ToolOptions(name="gripper", states={}, point=None, package_dirs=())
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        arm, gripper, known = Path(name, "small.urdf"), Path(name, "gripper.xml"), Path(name, "known")
        arm.write_text(small_arms.urdf())
        gripper.write_text(_GRIPPER)
        add_robot(str(arm), known, robot, cache=None, progress=lambda _: None)
        add_tool(str(gripper), known, tool, cache=None, progress=lambda _: None)
        return {str(path.relative_to(name)): path.read_text() for path in sorted(known.glob("*/*"))}


def _episode() -> dict[str, Any]:
    """Returns an episode in which the arms move along the good plan and then back."""
    plan, back = bad_files.good_plan(), bad_files.good_plan()
    back["positions"] = {arm: rows[::-1] for arm, rows in back["positions"].items()}
    back["problem"] |= {"start": back["problem"]["goal"], "goal": back["problem"]["start"]}
    return {"schema": "mmp-episode/1", "name": "there and back", "plans": [plan, back]}


def _plan_of_own_arms() -> dict[str, Any]:
    """Returns a plan of arms that are not built in; it carries their files."""
    cell = mmp_env.cell_from_mujoco(mujoco.MjModel.from_xml_string(scenes.scene()), {"left": "l_", "right": "r_"})
    problem = mmp_env.make_problem(cell, np.zeros(6), np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    found = mmp_planners.make("prioritized").plan(problem, seed=0, time_limit=60.0).plan
    assert found is not None
    return json.loads(json.dumps(plan_to_dict(found)))


def _without_hashes(plan: dict[str, Any]) -> dict[str, Any]:
    """Returns the plan without the hashes of its robots and tools, so that changes of these are read."""
    out = copy.deepcopy(plan)
    for kind in ("robots", "tools"):
        for files in out["problem"]["cell"].get(kind, {}).values():
            del files["sha256"]
    return out


def _schedule(jobs: dict[str, Any]) -> dict[str, Any]:
    found = mmp_planners.schedule(jobs_from_dict(jobs, "jobs.json"), seed=0, time_limit=60.0).schedule
    assert found is not None
    return json.loads(json.dumps(schedule_to_dict(found)))


def _yaml(value: Any, indent: int = 0) -> str:
    """Returns a document as YAML in block style."""
    pad = "  " * indent
    if isinstance(value, dict) and value:
        return "".join(
            f"{pad}{key}:{_inline(item)}" if _is_flat(item) else f"{pad}{key}:\n{_yaml(item, indent + 1)}"
            for key, item in value.items()
        )
    if isinstance(value, list) and value:
        return "".join(
            f"{pad}-{_inline(item)}" if _is_flat(item) else f"{pad}-\n{_yaml(item, indent + 1)}" for item in value
        )
    return f"{pad}{json.dumps(value)}\n"


def _inline(value: Any) -> str:
    return f" {json.dumps(value)}\n"


def _is_flat(value: Any) -> bool:
    return not isinstance(value, dict | list) or all(not isinstance(item, dict | list) for item in value)
