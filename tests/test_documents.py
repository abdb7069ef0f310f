"""README and pages: their programs run, their cells load, and their links lead to files."""

import re
from pathlib import Path

import pytest

from mmp_cli.main import main
from mmp_env import load_cell

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted(
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("*/*.md")]
)

SOURCES = [
    path
    for folder in ("mmp_env", "planners", "tasks", "native", "scripts")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".hpp", ".cpp", ".sh")
]


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def test_the_ten_lines_of_the_readme_move_eight_arms_to_their_goals():
    (program,) = blocks(README, "python")
    names: dict[str, object] = {}
    exec(program, names)
    report = names["report"]
    assert report.reached
    assert report.contacts == []


def test_the_readme_shows_what_the_command_prints(tmp_path, monkeypatch, capsys):
    (block,) = [text for text in blocks(README, "") if text.startswith("$ .venv/bin/mmp plan")]
    command, _, shown = block.partition("\n")
    monkeypatch.chdir(tmp_path)
    assert main(command.split()[2:]) == 0
    printed = capsys.readouterr().out
    assert without_machine(printed) == without_machine(shown)


def without_machine(text: str) -> list[str]:
    """Returns the lines of a summary but for those of the execution, without times that depend on the machine."""
    lines = [line for line in text.splitlines() if not line.startswith("execution")]
    return [re.sub(r"(?<=^planning   )\S+ s|(?<=checked in )\S+ s$", "", line) for line in lines]


def test_the_cell_of_the_readme_can_be_loaded(tmp_path):
    (text,) = blocks(README, "yaml")
    (tmp_path / "packing.yaml").write_text(text, encoding="utf-8")
    assert load_cell(tmp_path / "packing.yaml").arm_names == ("left", "right", "back")


def test_pages_and_demo_retime_every_plan_that_they_execute():
    texts = [page.read_text(encoding="utf-8") for page in [*PAGES, ROOT / "scripts" / "demo.sh"]]
    commands = [line for text in texts for line in text.splitlines() if re.search(r'mmp"? plan .*--execute', line)]
    calls = [line for text in texts for line in text.splitlines() if re.search(r"\benv\.\S*execute\(", line)]
    assert len(commands) > 5
    assert len(calls) > 3
    assert [line for line in commands if "--no-retime" in line] == []
    assert [line for line in calls if not re.search(r"retime|motion|execute\(plan\)`", line)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_links_of_a_page_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    missing = [t for t in targets if "://" not in t and not (page.parent / t).exists()]
    assert missing == []


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "explanation").glob("*.md")), ids=lambda page: page.name)
def test_the_code_has_the_names_and_files_of_an_explanation(page, code_words):
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    names = set(re.findall(r"`([A-Za-z_][\w.:]*)`", text))
    files = {name for name in names if re.search(r"\.(py|hpp|cpp|sh)$", name)}
    assert files - {path.name for path in SOURCES} == set()
    assert {name for name in names - files if re.split(r"[.:]", name)[-1] not in code_words} == set()


@pytest.fixture(scope="module")
def code_words():
    """Returns every word of the sources."""
    texts = [path.read_text(encoding="utf-8") for path in [*SOURCES, ROOT / "pyproject.toml"]]
    return {word for text in texts for word in re.findall(r"\w+", text)}


def test_pages_show_every_picture_and_all_pictures_are_small():
    folder = ROOT / "docs" / "images"
    kept = {path for path in folder.rglob("*") if path.is_file()}
    shown = {
        (page.parent / target).resolve()
        for page in PAGES
        for target in re.findall(r"!\[[^\]]*\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
        if "://" not in target
    }
    assert kept - shown == set()
    assert sum(path.stat().st_size for path in kept) <= 3.9e6


def test_line_numbers_in_the_conflict_tree_are_lines_of_the_listing():
    code = (ROOT / "planners" / "mmp_planners" / "conflict_tree" / "search.py").read_text(encoding="utf-8")
    algorithm = blocks((ROOT / "docs" / "explanation" / "paper.md").read_text(encoding="utf-8"), "")[0]
    lines = {int(number) for number in re.findall(r"^ *(\d+)  ", algorithm, re.MULTILINE)}
    named: set[int] = set()
    for first, last in re.findall(r"# l\. (\d+)(?:-(\d+))?", code):
        named |= set(range(int(first), int(last or first) + 1))
    assert named <= lines
    assert {6, 9, 15, 18, 19, 20, 24} <= named
