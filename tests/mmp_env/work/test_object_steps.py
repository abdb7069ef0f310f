"""Files of jobs with objects: what is read, and which faults are answered with one sentence."""

from __future__ import annotations

import numpy as np
import pytest

from mmp_env.errors import MmpError
from mmp_env.work.jobs import job_to_data
from mmp_env.work.jobs_file import jobs_from_dict
from mmp_env.work.object_steps import Grasp, Release
from tests.support.object_jobs import DOWN, UP, above, box, carry, handing_over, work


def test_objects_and_their_steps_are_read():
    jobs = jobs_from_dict(handing_over(), "jobs.json")
    assert [each.name for each in jobs.objects] == ["red", "blue", "green"]
    assert jobs.objects[0].position == pytest.approx([0.15, 0.25, 0.05])
    assert jobs.jobs[0].steps[2] == Grasp("red")
    assert jobs.jobs[0].steps[6] == Release("red")
    assert job_to_data(jobs.jobs[0])["steps"] == handing_over()["jobs"][0]["steps"]


def test_the_pose_of_an_object_may_also_be_in_its_own_fields():
    flat = {"name": "red", "shape": "box", "size": [0.05, 0.05, 0.1], "position": [0.1, 0.2, 0.05], "yaw": 0.5}
    nested = {
        "name": "red",
        "shape": "box",
        "size": [0.05, 0.05, 0.1],
        "pose": {"position": [0.1, 0.2, 0.05], "yaw": 0.5},
    }
    read = [jobs_from_dict(work(TAKE, objects=[each]), "jobs.json").objects[0] for each in (flat, nested)]
    assert np.array_equal(read[0].quaternion, read[1].quaternion)
    assert np.array_equal(read[0].position, read[1].position)


TAKE = {"name": "take", "arm": "arm0", "steps": [above(0.1, 0.2), DOWN, {"grasp": "red"}, UP]}
PUT = {"name": "put", "arm": "arm0", "steps": [{"release": "red"}], "after": ["take"]}
PANDA = {
    "arms": [{"name": "arm0", "robot": "panda", "position": [0, 0, 0]}],
    "obstacles": [{"name": "table", "shape": "box", "size": [2, 2, 0.1], "position": [0, 0, -0.05]}],
}
WIDE = {"name": "red", "shape": "box", "size": [0.1, 0.1, 0.1], "position": [0.5, 0, 0.05]}


def test_an_object_may_be_held_from_one_job_to_another():
    assert len(jobs_from_dict(work(TAKE, PUT), "jobs.json").jobs) == 2


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (work(carry("a", "rod", (0, 0), (0, 0))), "step 2 of job 'a': unknown object 'rod'. Did you mean 'red'?"),
        (
            work(carry("a", "red", (0, 0), (0, 0)), carry("b", "red", (0, 0), (0, 0))),
            "jobs 'a' and 'b' both use object 'red', and neither comes after the other; give one of them an 'after'",
        ),
        (
            work({"name": "a", "steps": [{"grasp": "red"}, {"grasp": "blue"}]}),
            "step 1 of job 'a' grasps 'blue', but the gripper is full: it holds 'red'",
        ),
        (
            work(TAKE, {"name": "b", "arm": "arm1", "steps": [{"grasp": "red"}], "after": ["take"]}),
            "step 0 of job 'b' grasps 'red', which another arm holds since step 2 of job 'take'",
        ),
        (
            work(TAKE, {"name": "b", "arm": "arm0", "steps": [{"grasp": "red"}], "after": ["take"]}),
            "step 0 of job 'b' grasps 'red', which the arm itself holds since step 2 of job 'take'",
        ),
        (
            work({"name": "a", "steps": [{"release": "red"}]}),
            "step 0 of job 'a' releases 'red', which is not held",
        ),
        (
            work(TAKE, PUT | {"arm": "arm1"}),
            "step 0 of job 'put' releases 'red', which step 2 of job 'take' grasps; both jobs must name the same arm",
        ),
        (
            work({"name": "a", "steps": [{"grasp": "red"}]}, cell=PANDA, objects=[WIDE]),
            "step 0 of job 'a' grasps 'red', which is 0.1 m wide; the gripper opens 0.08 m",
        ),
        (work(TAKE, objects=[box("red", 0, 0), box("red", 0, 1)]), "two objects are named 'red'"),
        (work(TAKE, objects=[box("red", 0, 0), box("table", 0, 1)]), "has the name of an obstacle of the cell"),
        (work(TAKE, objects=[box("red", 0, 0) | {"yaw": 1.0}]), "objects[0] has both pose and yaw; give one"),
        (work(TAKE, objects=[box("red", 0, 0) | {"pose": 3}]), "objects[0].pose is 3"),
        (work(TAKE, objects=[box("red", 0, 0) | {"size": [1.0]}]), "objects[0]"),
        (work({"name": "a", "steps": [{"grasp": 3}]}), "jobs[0].steps[0].grasp is 3; it must be the name of an object"),
    ],
)
def test_a_fault_is_one_sentence(data, words):
    with pytest.raises(MmpError) as error:
        jobs_from_dict(data, "jobs.json")
    assert words in str(error.value)
    assert "\n" not in str(error.value)
