"""Attacks on the importer: covers of turned links, and faults planted in a robot folder. The scripts make more."""

import json

import pytest
from support.checkout_scripts import run
from support.small_arms import fingers, mjcf

from mmp_env.importing.robot_folder import ImportOptions, add_robot


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """The folder of a small arm."""
    folder = tmp_path_factory.mktemp("attacked")
    (folder / "arm.xml").write_text(mjcf(hand=fingers()))
    options = ImportOptions(name="small")
    return add_robot(folder / "arm.xml", folder, options, cache=None, progress=lambda line: None).folder


def test_random_covers_leave_no_point_outside(robot):
    process = run("attack_covers.py", robot, "--covers", 6, "--points", 5000)
    assert process.returncode == 0, process.stderr
    assert json.loads(process.stdout) | {"wrong": 0, "covers": 6} == json.loads(process.stdout)


def test_every_kind_of_planted_fault_is_found(robot):
    process = run("attack_robot_check.py", robot, "--faults", 36)
    lines = [json.loads(line) for line in process.stdout.splitlines()]
    assert process.returncode == 0, (process.stderr, [line for line in lines if line["missed"]])
    assert len(lines) > 30
    assert all(line["planted"] for line in lines)


def test_faults_in_the_hulls_and_spheres_of_a_built_in_robot_are_found():
    process = run("attack_robot_check.py", "ur5e", "--faults", 10)
    lines = {line["fault"]: line for line in map(json.loads, process.stdout.splitlines())}
    assert process.returncode == 0, (process.stderr, lines)
    assert {"radius negative", "hull vertex moved", "hull dropped", "sphere moved"} <= set(lines)
