"""Recordings as files: complete and valid with every planner, and without effect on the plan."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from rerun.chunk import RrdReader
from support import two_arms
from support.recordings import Rows, blueprints

import mmp_env
from mmp_env import MmpError, events
from mmp_env.view.rerun import RerunWatcher, require, sdk
from mmp_planners import StopPlanning, make, names

IDS, TEXT = "GraphNodes:node_ids", "TextDocument:text"
MOST_MB = 6


def verified(path):
    """Returns whether rerun's own tool finds no fault."""
    tool = Path(sys.executable).parent / "rerun"
    return subprocess.run([tool, "rrd", "verify", path], capture_output=True).returncode == 0


def record(problem, planner, path, **options):
    with RerunWatcher(problem, path) as watcher:
        result = make(planner, **options).plan(problem, seed=0, time_limit=60.0, watch=watcher)
        watcher.show_plan(result.plan)
    return result


@pytest.mark.parametrize("planner", names())
def test_the_plan_is_the_same_as_without(planner, tmp_path):
    problem = two_arms.passing()
    alone = make(planner).plan(problem, seed=0, time_limit=60.0)
    watched = record(problem, planner, tmp_path / "search.rrd")
    assert watched.plan.planner == alone.plan.planner
    assert watched.plan.stats == alone.plan.stats
    np.testing.assert_array_equal(watched.plan.times, alone.plan.times)
    for arm, q in alone.plan.positions.items():
        np.testing.assert_array_equal(watched.plan.positions[arm], q)
    assert verified(tmp_path / "search.rrd")
    assert blueprints(tmp_path / "search.rrd") == 1


@pytest.mark.parametrize("planner", ["ecbs", "apf-ecbs", "auto", "rrt-connect", "prioritized"])
@pytest.mark.parametrize("problem", [two_arms.one_moves, two_arms.nothing_to_do], ids=lambda kind: kind.__name__)
def test_a_search_that_ends_at_its_root_shows_its_one_node(planner, problem, tmp_path):
    record(problem(), planner, tmp_path / "search.rrd")
    rows = Rows(tmp_path / "search.rrd")
    ids = rows.at("/tree", IDS, "expansion")
    assert len(ids[max(ids)]) in (1, 2)  # two if the plan was shortened
    assert rows.at("/node/words", TEXT, "expansion")
    assert {"expansion", "plan time"} <= rows.timelines
    assert verified(tmp_path / "search.rrd")


def test_a_malformed_plan_is_refused_and_leaves_no_file(tmp_path):
    problem = two_arms.passing()
    plan = make("auto").plan(problem, seed=0).plan
    wrong = dataclasses.replace(plan, times=plan.times[::-1])
    watcher = RerunWatcher(problem, tmp_path / "plan.rrd")
    with pytest.raises(MmpError, match="the plan is malformed: its times"):
        watcher.show_plan(wrong)
    assert list(tmp_path.iterdir()) == []


def test_the_plan_of_a_silent_planner_is_shown(tmp_path):
    problem = two_arms.passing()
    plan = make("auto").plan(problem, seed=0).plan
    with RerunWatcher(problem, tmp_path / "plan.rrd") as watcher:
        watcher.show_plan(plan)
    rows = Rows(tmp_path / "plan.rrd")
    assert "/tree" not in rows.entities
    assert "/plan/spheres/left" in rows.entities
    assert verified(tmp_path / "plan.rrd")


def test_a_silent_planner_without_a_plan_has_its_start_shown(tmp_path):
    with RerunWatcher(two_arms.passing(), tmp_path / "start.rrd"):
        pass
    assert any(path.startswith("/cell/left/") for path in Rows(tmp_path / "start.rrd").entities)
    assert blueprints(tmp_path / "start.rrd") == 1
    assert verified(tmp_path / "start.rrd")


@pytest.mark.parametrize(("error", "raised"), [(KeyboardInterrupt, KeyboardInterrupt), (RuntimeError, MmpError)])
def test_a_recording_that_cannot_be_finished_leaves_the_earlier_file_alone(error, raised, tmp_path, monkeypatch):
    path = tmp_path / "search.rrd"
    path.write_text("earlier")

    def fails(self, **_):
        raise error("no space left")

    watcher = RerunWatcher(two_arms.passing(), path)
    with monkeypatch.context() as patch:
        patch.setattr(require().RecordingStream, "flush", fails)
        with pytest.raises(raised, match="no space left"):
            watcher.close()
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("search.rrd", "earlier")]


def test_without_a_plan_the_search_is_shown(tmp_path):
    problem = two_arms.passing(1.0)
    path = tmp_path / "search.rrd"
    with RerunWatcher(problem, path) as watcher:

        def stop(event):
            watcher(event)
            if isinstance(event, events.NodeExpanded):
                raise StopPlanning

        result = make("ecbs").plan(problem, seed=0, watch=stop)
        watcher.show_plan(result.plan)
    assert result.plan is None
    rows = Rows(path)
    assert sorted(rows.at("/tree", IDS, "expansion")) == [0, 1, 2]
    assert not any(path.startswith("/plan/") for path in rows.entities)
    assert verified(path)


def test_events_before_an_interrupt_are_kept(tmp_path):
    path = tmp_path / "search.rrd"
    watcher = RerunWatcher(two_arms.passing(1.0), path)

    def interrupt(event):
        watcher(event)
        if isinstance(event, events.NodeCreated):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), watcher:
        make("ecbs").plan(two_arms.passing(1.0), seed=0, watch=interrupt)
    assert verified(path)
    assert Rows(path).at("/tree", IDS, "expansion")[1] == ["0"]


def test_the_numbers_of_detailed_nodes_and_repulsions_are_limited_and_stated(tmp_path):
    problem, path = two_arms.passing(1.0), tmp_path / "search.rrd"
    with RerunWatcher(problem, path, most_nodes=1, most_repulsions=1) as watcher:
        result = make("apf-ecbs-nf", step_rad=0.01).plan(problem, seed=0, watch=watcher)
    assert result.stats["expanded_nodes"] > 2
    rows = Rows(path)
    last = result.stats["expanded_nodes"] + 1
    words = rows.at("/node/words", TEXT, "expansion")
    assert sorted(words) == [0, 1, 2, last]
    assert "Only the first expanded node is" in words[2][0]
    assert sorted(rows.at("/tree", IDS, "expansion")) == list(range(last + 1))
    titles = [text[0].split("\n")[0] for text in rows.at("/repulsion_words", TEXT, "repulsion").values()]
    assert titles[0].endswith("the path of the low level")
    assert not any(title.endswith("the path of the low level") for title in titles[1:])


def test_the_watcher_requests_the_iterates_of_repulsion():
    watcher = RerunWatcher.__new__(RerunWatcher)
    assert events.wants_iterates(watcher)
    assert not events.wants_iterates(events.ignore)


def test_a_recording_of_eight_arms_is_small(tmp_path):
    """Plan and repulsions take most of the space. `scripts/bench_rerun.py` measures larger searches."""
    with gymnasium.make("MultiArmCell-8") as env:
        env.reset(seed=8)
        problem = env.unwrapped.problem
    result = record(problem, "apf-ecbs", tmp_path / "search.rrd")
    assert result.stats["expanded_nodes"] >= 2
    assert (tmp_path / "search.rrd").stat().st_size < MOST_MB * 1e6
    assert verified(tmp_path / "search.rrd")


def test_without_the_extra_one_sentence_says_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MmpError, match=r"pip install 'mmp-env\[rerun\]'") as caught:
        require()
    assert "\n" not in str(caught.value)
    with pytest.raises(MmpError, match="rerun-sdk"):
        RerunWatcher(two_arms.passing(), tmp_path / "search.rrd")
    assert not list(tmp_path.iterdir())


def test_importing_the_package_imports_no_viewer():
    code = "import sys, mmp_env.view.rerun, mmp_planners; print([m for m in ('rerun', 'pyarrow') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("name", "words"), [("search.txt", "must end in .rrd"), ("absent/search.rrd", "cannot be written")]
)
def test_a_name_that_cannot_be_written_is_refused_before_planning(name, words, tmp_path):
    with pytest.raises(MmpError, match=words):
        RerunWatcher(two_arms.passing(), tmp_path / name)


def test_without_a_display_the_viewer_is_refused_before_planning(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(MmpError, match=r"no display here; record to a file \.rrd instead"):
        RerunWatcher(two_arms.passing(), "spawn")


def test_spawn_opens_the_viewer_and_logs_to_it(monkeypatch, tmp_path):
    """A file stands in for the viewer."""
    asked = []

    def spawn(recording, **options):
        asked.append(options)
        recording.save(tmp_path / "viewer.rrd")

    monkeypatch.setattr(require(), "spawn", spawn)
    monkeypatch.setenv("DISPLAY", ":0")
    with RerunWatcher(two_arms.passing(), "spawn") as watcher:
        watcher.show_plan(make("auto").plan(two_arms.passing(), seed=0, watch=watcher).plan)
    assert asked[0]["executable_path"] == str(Path(sys.executable).parent / "rerun")
    assert verified(tmp_path / "viewer.rrd")
    assert "/plan/spheres/left" in Rows(tmp_path / "viewer.rrd").entities


def test_recordings_with_the_same_tabs_share_a_name_that_rerun_takes_as_it_is(tmp_path):
    problem = two_arms.passing(1.0)
    record(problem, "ecbs", tmp_path / "search.rrd")
    (store,) = RrdReader(str(tmp_path / "search.rrd")).recordings()
    assert store.application_id == "mmp-env-search-plan-of-facing"


def test_arms_and_obstacles_of_every_kind_are_shown(tmp_path):
    """The cell has a tool, four shapes of obstacles, seven joints and fine spheres."""
    from mmp_env.model.arm import Obstacle, place_arm
    from mmp_env.model.cell import Cell
    from mmp_env.model.transforms import quaternion_from_yaw

    at = {"quaternion": quaternion_from_yaw(0.3)}
    obstacles = (
        Obstacle(name="box", shape="box", position=np.array([2.0, 0, 0]), size=np.array([0.1, 0.2, 0.3]), **at),
        Obstacle(name="ball", shape="sphere", position=np.array([2.0, 1, 0]), radius=0.1, **at),
        Obstacle(name="pipe", shape="cylinder", position=np.array([2.0, 2, 0]), radius=0.1, length=0.2, **at),
        Obstacle(name="pill", shape="capsule", position=np.array([2.0, 3, 0]), radius=0.1, length=0.2, **at),
    )
    arms = (place_arm("one", "panda", [0, 0, 0], at["quaternion"]),)
    cell = Cell(name="odd", arms=arms, obstacles=obstacles, spheres="fine")
    home = cell.arms[0].robot.home
    problem = mmp_env.make_problem(cell, {"one": home}, {"one": home + 0.1})
    record(problem, "auto", tmp_path / "odd.rrd")
    rows = Rows(tmp_path / "odd.rrd")
    assert {"/stage/boxes", "/stage/spheres", "/stage/cylinders", "/stage/capsules"} <= rows.entities
    (begin,) = rows.static("/stage/capsules", "Capsules3D:translations")
    np.testing.assert_allclose(begin, [2.0, 3.0, -0.1], atol=1e-6)
    assert verified(tmp_path / "odd.rrd")


def test_a_recording_without_memory_for_its_copies_is_not_begun(tmp_path, monkeypatch):
    def refuse(size):
        raise MemoryError

    monkeypatch.setattr(sdk, "bytearray", refuse, raising=False)
    with pytest.raises(MemoryError):
        record(two_arms.passing(), "auto", tmp_path / "plan.rrd")
    assert list(tmp_path.iterdir()) == []
