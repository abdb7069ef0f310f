"""Files of jobs: what they say, and the sentence for each fault."""

from __future__ import annotations

import copy
import json

import pytest

from mmp_env import MmpError, load_jobs
from mmp_env.work.jobs import Move, Wait, job_to_data
from mmp_env.work.jobs_file import jobs_from_dict
from tests.support.small_jobs import in_a_ring


def test_a_file_is_read_with_all_its_jobs(tmp_path):
    path = tmp_path / "jobs.json"
    path.write_text(json.dumps(in_a_ring()))
    work = load_jobs(path)
    assert work.cell.arm_names == ("arm0", "arm1", "arm2", "arm3")
    assert [job.name for job in work.jobs] == ["a", "b", "c", "d"]
    assert [type(step) for step in work.jobs[0].steps] == [Move, Wait, Move]
    assert work.jobs[2].arm is None
    assert work.jobs[2].after == ("a",)
    assert [job_to_data(job) for job in work.jobs] == in_a_ring()["jobs"]


def test_a_cell_is_found_beside_the_file(tmp_path):
    arm = {"name": "left", "robot": "ur5e", "position": [0, 0, 0]}
    (tmp_path / "cell.json").write_text(json.dumps({"arms": [arm]}))
    jobs = [{"name": "a", "arm": "left", "steps": [{"wait": 1}]}]
    (tmp_path / "jobs.json").write_text(json.dumps({"schema": "mmp-jobs/1", "cell": "cell.json", "jobs": jobs}))
    assert load_jobs(tmp_path / "jobs.json").cell.arm_names == ("left",)


def _with_job(k, **fields):
    data = copy.deepcopy(in_a_ring())
    data["jobs"][k] |= fields
    return data


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (_with_job(0, arm="amr0"), "unknown arm 'amr0'. Did you mean 'arm0'?"),
        (_with_job(0, after=["dd"]), "unknown job 'dd'. Did you mean 'd'?"),
        (_with_job(0, after=["c"]), "wait for each other, so that none can begin: a after c after a"),
        (_with_job(0, after=["a"]), "none can begin: a after a"),
        (_with_job(0, name="b"), "two jobs are named 'b'"),
        (_with_job(0, steps=[]), "job 'a' has no steps"),
        (_with_job(0, steps=[{"mvoe": "home"}]), "unknown kind of step 'mvoe'. Did you mean 'move'?"),
        (
            _with_job(0, steps=[{"move": "home", "wait": 1}]),
            "it must be an object with one of move, line, grasp, release, wait",
        ),
        (_with_job(0, steps=[{"move": "hoem"}]), "unknown named configuration 'hoem'. Did you mean 'home'?"),
        (_with_job(0, steps=[{"wait": -1}]), "it must be a number of seconds above 0"),
        (_with_job(0, steps=[{"wait": 1e9}]), "it must be a number of seconds above 0, 3600 at most"),
        (_with_job(0, color="red"), "unknown field 'color'"),
        (in_a_ring(start={"arm9": "home"}), "unknown arm 'arm9'"),
        (in_a_ring(start={"arm0": "stay"}), "start of arm 'arm0' must be one configuration or pose"),
        (in_a_ring(jobs=[]), "the work has 0 jobs; it needs at least one"),
        (in_a_ring(cell="rink-4"), "unknown cell 'rink-4'. Did you mean 'ring-4'?"),
        (in_a_ring(schema="mmp-jobs/2"), "it must be 'mmp-jobs/1'"),
    ],
)
def test_a_fault_is_one_sentence_with_the_nearest_match(data, words):
    with pytest.raises(MmpError) as error:
        jobs_from_dict(data, "jobs.json")
    assert words in str(error.value)
    assert str(error.value).startswith("jobs.json: ")
    assert "\n" not in str(error.value)
