"""Every number on a page is a measured figure, or a constant that tests/quoted_constants.toml explains."""

import importlib
import json
import re
import tomllib
from pathlib import Path

import pytest
from support import checkout_scripts

from mmp_env.errors import MmpError

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    # planners.md is written whole by a script
    *(page for page in sorted((ROOT / "docs").glob("*/*.md")) if page.name != "planners.md"),
    *sorted((ROOT / "docs").glob("*/*.ipynb")),
]
CONSTANTS = tomllib.loads((ROOT / "tests" / "quoted_constants.toml").read_text(encoding="utf-8"))
UNITS = {"s": 1, "ms": 1e-3, "minutes": 60, "mm": 1e-3, "rad": 1, "mrad": 1e-3, "%": 1e-2, "MB": 2**20, "times": 1}
MEASURED = re.compile(
    r"(?<![\w./(−-])\d+(?:[., ]\d+)*(?:e-?\d+)?\s?"
    r"(?:ms|µs|s|minutes?|hours?|MB|GB|mrad|rad|mm|times|nodes|%)(?![\w/²³^])"
    r"|(?<![\w.])\d+ of \d+\b"
)
WRITTEN = (
    r"<!-- table: .*?<!-- end of table -->",
    r"<!-- (?:figure:|checked by) .*?<!-- end -->",
    r"^```.*?^```$",
    r"`[^`\n]*`",
)


def text_of(page: Path) -> str:
    """Returns the text of a page, or of the Markdown cells of a notebook."""
    text = page.read_text(encoding="utf-8")
    if page.suffix != ".ipynb":
        return text
    cells = json.loads(text)["cells"]
    return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")


def claims(text: str) -> set[str]:
    """Returns numbers with a unit, and `n of m`, in hand-written text without code."""
    for pattern in WRITTEN:
        text = re.sub(pattern, "", text, flags=re.DOTALL | re.MULTILINE)
    return {re.sub(r"\s+", " ", found[0]) for found in MEASURED.finditer(text)}


def known(page: Path) -> dict[str, str]:
    return CONSTANTS.get(str(page.relative_to(ROOT)), {})


@pytest.fixture
def quoted(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    return importlib.import_module("quoted")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_figure_in_a_sentence_is_marked_or_is_a_constant(page):
    assert claims(text_of(page)) - known(page).keys() == set(), (
        "mark each as <!-- figure: NAME as FORMAT -->...<!-- end --> (scripts/quoted.py); "
        "a number that is not measured goes into tests/quoted_constants.toml"
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_listed_constants_stand_on_their_page(page):
    assert known(page).keys() - claims(text_of(page)) == set()


def test_constants_belong_to_existing_pages():
    assert CONSTANTS.keys() <= {str(page.relative_to(ROOT)) for page in PAGES}


CODE = [
    (page, text, why)
    for page, texts in CONSTANTS.items()
    for text, why in texts.items()
    if re.fullmatch(r"\S+:\S+", why)
]


@pytest.mark.parametrize(("page", "text", "place"), CODE)
def test_a_quoted_constant_equals_that_of_the_code(page, text, place):
    module, _, name = place.partition(":")
    value = importlib.import_module(module)
    for part in name.split("."):
        value = value[part] if isinstance(value, dict) else getattr(value, part)
    number, unit = re.fullmatch(r"([\d. ]+?(?:e-?\d+)?) ?([a-z%]+)", text, re.IGNORECASE).groups()
    assert float(number.replace(" ", "")) * UNITS[unit] == pytest.approx(value), f"{page} says {text}"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("It takes 3.8 ms, 18 s or 20 % of it.", {"3.8 ms", "18 s", "20 %"}),
        ("It solves 49 of 50.", {"49 of 50"}),
        ("It was 2.3 times as fast, with 10.3 nodes.", {"2.3 times", "10.3 nodes"}),
        ("It moves by 1e-4 rad, or by 6.9e-7 rad, with α = 1e-7.", {"1e-4 rad", "6.9e-7 rad"}),
        ("A limit of 0.8 rad/s, of 8 rad/s², or `5 s`, in 4 turns", set()),
        ("It takes <!-- figure: a/b as time -->3.8 ms<!-- end --> here.", set()),
        ("<!-- checked by tests/a.py -->\n| 56 % |\n<!-- end -->", set()),
        ("<!-- table: core -->\n| 3.8 ms |\n<!-- end of table -->", set()),
    ],
)
def test_what_counts_as_a_figure(text, found):
    assert claims(text) == found


FIGURES = {
    "ring/a/time": {"value": 0.0038, "unit": "s"},
    "ring/b/time": {"value": 0.0076, "unit": "s", "ratio": 2.0},
    "ring/a/solved": {"value": 49, "unit": "of 50"},
}


@pytest.mark.parametrize(
    ("expression", "form", "text"),
    [
        ("ring/a/time", "time", "3.8 ms"),
        ("ring/b/time#ratio", ".1f", "2.0"),
        ("ring/b/time / ring/a/time", ".1f", "2.0"),
        ("ring/b/time - ring/a/time * 1e3", ".1f", "3.8"),
        ("max ring/*/time * 1000", ".1f", "7.6"),
        ("max ring/b/t*#ratio", ".1f", "2.0"),
        ("ring/a/solved", "of", "49 of 50"),
    ],
)
def test_a_quoted_figure_equals_its_measurement(quoted, expression, form, text):
    mark = f"It is <!-- figure: {expression} as {form} -->"
    assert quoted.quoted(f"{mark}old<!-- end -->.", FIGURES) == f"{mark}{text}<!-- end -->."


def test_an_unknown_figure_is_an_error_with_the_nearest_name(quoted):
    with pytest.raises(MmpError, match=r"unknown figure 'ring/a/tim'\. Did you mean 'ring/a/time'"):
        quoted.quoted("<!-- figure: ring/a/tim as time -->?<!-- end -->", FIGURES)


def test_a_stale_figure_in_a_notebook_is_written_again(quoted):
    figures = importlib.import_module("measured").read_figures()
    text = (ROOT / "docs" / "tutorials" / "clone_an_expert.ipynb").read_text(encoding="utf-8")
    stale = quoted.PLACE.sub(r"\1?\5", text)
    assert stale != text
    assert quoted.quoted(stale, figures) == text


@pytest.mark.parametrize("script", ["readme_table.py", "results_page.py", "planners_page.py"])
def test_the_pages_are_up_to_date(script):
    done = checkout_scripts.run(script, "--check")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("page", ["README.md", "docs/reference/planners.md"])
def test_a_dash_replaces_times_only_beside_unsolved_instances_and_is_explained(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    dashed = re.findall(r"(\d+) of (\d+)[;,] –[;,]", text)
    for solved, times in re.findall(r"^\| \*\*solved\*\* (.*)\n\| \*\*median time\*\* (.*)$", text, re.MULTILINE):
        cells = zip(solved.split("|"), times.split("|"), strict=True)
        dashed += [re.findall(r"(\d+) of (\d+)", cell)[0] for cell, time in cells if "–" in time]
    assert all(int(solved) < int(all_) for solved, all_ in dashed)
    assert dashed == [] or re.search(r"[Aa] dash[^.]* unsolved", text.replace("\n", " "))


@pytest.mark.parametrize(
    ("value", "text"), [(0.00994, "9.9 ms"), (0.00996, "10 ms"), (0.0104, "10 ms"), (1.0, "1.0 s"), (3e-8, "30 ns")]
)
def test_a_time_has_two_digits_and_no_lonely_point(quoted, value, text):
    assert quoted.seconds(value) == text
