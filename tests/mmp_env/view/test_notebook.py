"""The view of a plan in a notebook."""

import inspect
import io
import re
from base64 import b64decode

import pytest
from PIL import Image
from support import tiny_plans
from support.picture_or_sentence import NONE_HERE, made

from mmp_env import Plan, PlanView, opengl
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.view import notebook
from mmp_env.view.films import frame_times


@pytest.fixture(scope="module")
def plan():
    return plan_from_dict(tiny_plans.two_apart())


def test_a_notebook_shows_a_plan_as_a_film_inside_the_page(plan):
    view = plan.show(width=96, height=64, fps=2)
    page = view._repr_html_()
    if made(opengl.offscreen_backend) is None:
        assert re.fullmatch(f"<p>.*({NONE_HERE}).*</p>", page)
        assert set(view._repr_mimebundle_(include=["image/png"])) == set()
        return
    film = re.fullmatch(r'<img src="data:image/webp;base64,([^"]+)" width="96" height="64" alt="[^"<>]+">', page)
    with Image.open(io.BytesIO(b64decode(film[1]))) as image:
        assert (image.n_frames, image.size) == (len(frame_times(plan.makespan_s, 2)), (96, 64))
    with Image.open(io.BytesIO(view._repr_mimebundle_(include=["image/png"])["image/png"])) as image:
        assert image.size == (3 * 64 + 8, 42)


def test_showing_a_plan_makes_the_film_once_and_no_picture(plan, monkeypatch):
    made = []

    def film(plan, path, report, **options):
        made.append("film")
        path.write_bytes(b"a film")

    monkeypatch.setattr(notebook, "save_film", film)
    monkeypatch.setattr(notebook, "pictures", lambda *_, **__: made.append("pictures"))
    view = plan.show()
    for _ in range(2):
        assert set(view._repr_mimebundle_(include=None, exclude=None)) == {"text/plain", "text/html"}
        assert "base64" in view._repr_html_()
    assert set(view._repr_mimebundle_(exclude={"text/html"})) == {"text/plain"}
    assert made == ["film"]
    assert not hasattr(view, "_repr_png_")


def test_without_a_library_a_notebook_says_why(plan, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    view = plan.show()
    assert view._repr_html_() == (
        "<p>MUJOCO_GL is disable, which forbids pictures; unset it, or set it to egl or osmesa</p>"
    )
    assert view._repr_mimebundle_(include=["image/png"]) == {}
    assert repr(view).startswith("<a plan for 2 arms, ")


def test_a_plan_shows_itself_with_the_options_of_its_view():
    options, wanted = (list(inspect.signature(f).parameters.values())[2:] for f in (Plan.show, PlanView.__init__))
    assert [(one.name, one.default) for one in options] == [(one.name, one.default) for one in wanted[1:]]
