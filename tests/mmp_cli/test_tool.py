"""`mmp tool add`: grippers of the user's own, from file to plan."""

import json

import pytest

pytest.importorskip("scipy")

GRIPPER = """<mujoco model="pincher">
  <worldbody>
    <body name="palm">
      <geom type="box" size="0.03 0.05 0.03" pos="0 0 0.03"/>
      <body name="left" pos="0 0.01 0.06">
        <joint name="finger1" type="slide" axis="0 1 0" range="0 0.04"/>
        <geom type="box" size="0.01 0.008 0.03" pos="0 0.008 0.03"/>
      </body>
      <body name="right" pos="0 -0.01 0.06">
        <joint name="finger2" type="slide" axis="0 -1 0" range="0 0.04"/>
        <geom type="box" size="0.01 0.008 0.03" pos="0 -0.008 0.03"/>
      </body>
      <site name="grip_site" pos="0 0 0.11"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache that the tests share, so that each tool is made once."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def home(tmp_path, cache, monkeypatch):
    """The user's data folder, empty; the working directory with a gripper."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    monkeypatch.setattr("mmp_cli.import_progress.FIRST_S", 1e6)  # no line on a slow machine
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pincher.xml").write_text(GRIPPER)
    return tmp_path


def write_cell(home, **arm):
    arms = [
        {"name": "a", "robot": "ur5e", "position": [-0.5, 0, 0], **arm},
        {"name": "b", "robot": "panda", "position": [0.5, 0, 0]},
    ]
    (home / "cell.json").write_text(json.dumps({"arms": arms, "spheres": "exact"}))


def test_a_cell_chooses_the_state_of_an_added_tool_and_its_plan_needs_no_tool_folder(mmp, home, monkeypatch):
    ran = mmp(
        "tool", "add", "pincher.xml", "--name", "pincher", "--state", "open=0.04,0.04", "--state", "closed=", "--json"
    )
    assert (ran.code, ran.err) == (0, "")
    assert list(ran.result["states"]) == ["open", "closed"]
    told = ran.result["states"]["open"]
    assert told["joints"] == {"finger1": 0.04, "finger2": 0.04}
    assert (told["point"], told["uncovered_mm"]) == ([0, 0, 0.11], 0)
    assert told["protrusion_mm"]["fine"] <= 5
    assert "pincher" in [tool["name"] for tool in mmp("list", "--json").result["tools"]]
    write_cell(home, tool="pincher", tool_state="closed")
    ran = mmp("plan", "cell.json", "--out", "plan.json", "--execute", "--json")
    assert (ran.code, ran.result["valid"]) == (0, True)
    monkeypatch.setenv("XDG_DATA_HOME", str(home / "nowhere"))
    assert mmp("check", "plan.json").code == 0
    (carried,) = json.loads((home / "plan.json").read_text())["problem"]["cell"]["tools"].values()
    assert carried["tool.json"]["state"] == "closed"
    assert "wrist3" in carried["tool.json"]["self_collision_ignore"]["fine"]


def test_a_tool_without_states_is_found_by_the_path_of_its_folder(mmp, home):
    ran = mmp("tool", "add", "pincher.xml", "--name", "pincher", "--out", "tools", "--json")
    assert list(ran.result["states"]) == ["default"]
    write_cell(home, tool="./tools/pincher")
    assert mmp("plan", "cell.json", "--json").code == 0


def test_an_earlier_tool_gives_way_but_no_source_and_no_file_of_the_user(mmp, home):
    words = ("tool", "add", "pincher.xml", "--name", "pincher", "--out", "tools", "--state", "open=0.04,0.04")
    assert "replaced" not in mmp(*words).out
    assert "the tool of this name that was in the folder" in mmp(*words).out
    ran = mmp("tool", "add", "tools/pincher/open/pincher.xml", "--name", "pincher", "--out", "tools")
    assert (ran.code, "is an input and lies in" in ran.err) == (2, True)
    (home / "tools" / "alias").symlink_to("pincher")
    ran = mmp("tool", "add", "pincher.xml", "--name", "alias", "--out", "tools")
    assert (ran.code, "tools/alias is a symbolic link to pincher" in ran.err) == (2, True)
    (home / "tools" / "pincher" / "open" / "LICENSE").write_text("mine")
    ran = mmp(*words)
    assert (ran.code, "holds open/LICENSE, which no import wrote" in ran.err) == (2, True)
    assert (home / "tools" / "pincher" / "open" / "LICENSE").read_text() == "mine"


@pytest.mark.parametrize(
    ("states", "told"),
    [
        (["open"], "--state is open; it must be NAME=JOINTS"),
        (["open=0", "open=1"], "--state open is given twice"),
        (["open=0.04"], "state open has 1 values; the tool has 2 joints: finger1, finger2"),
        (["open=fingr1=0.04"], "unknown joint of state open 'fingr1'. Did you mean 'finger1'?"),
        (["open=finger1=0.05"], "state open: joint 'finger1' is 0.05; its limits are 0 to 0.04"),
        (["open=finger1=wide"], "state open: joint 'finger1' is 'wide'; it must be a finite number"),
        (["open=finger1=0.01,0.02"], "state open: '0.02' names no joint"),
    ],
)
def test_a_bad_state_is_refused_in_one_sentence(mmp, home, states, told):
    ran = mmp(
        "tool", "add", "pincher.xml", "--name", "pincher", *(word for state in states for word in ("--state", state))
    )
    assert ran.code == 2
    assert told in ran.err
    assert not (home / "data").exists()


@pytest.mark.parametrize(
    ("arm", "told"),
    [
        (
            {"tool": "pincher", "tool_state": "opne"},
            "unknown state of tool 'pincher' 'opne'. Did you mean 'open'? Known: closed, open",
        ),
        ({"tool": "franka-hand", "tool_state": "open"}, "tool 'franka-hand' has one state, which has no name"),
        ({"tool": None, "tool_state": "open"}, "arms[0].tool_state is 'open', but the arm has no tool"),
        ({"tool": "pinch"}, "unknown tool 'pinch'. Did you mean 'pincher'?"),
    ],
)
def test_an_unknown_tool_or_state_names_the_nearest(mmp, home, arm, told):
    added = mmp("tool", "add", "pincher.xml", "--name", "pincher", "--state", "open=0.04,0.04", "--state", "closed=")
    assert (added.code, added.err) == (0, "")
    write_cell(home, **arm)
    ran = mmp("plan", "cell.json")
    assert ran.code == 2
    assert told in ran.err


def test_a_source_without_geometry_and_a_taken_name_are_refused(mmp, home):
    (home / "empty.xml").write_text(
        "<mujoco><worldbody><body><geom size='.1' contype='0' conaffinity='0'/></body></worldbody></mujoco>"
    )
    assert "no collision geometry" in mmp("tool", "add", "empty.xml", "--name", "empty").err
    assert "is the name of a tool in" in mmp("tool", "add", "pincher.xml", "--name", "franka-hand").err
    assert "unknown site or body 'tpi'" in mmp("tool", "add", "pincher.xml", "--name", "p", "--tip", "tpi").err
