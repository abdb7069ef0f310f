"""Films of episodes: all plans in a row."""

from PIL import Image, ImageSequence
from support import tiny_plans
from support.picture_or_sentence import made

from mmp_env.files.episode_file import Episode
from mmp_env.files.plan_file import plan_from_dict
from mmp_env.view import films
from mmp_env.view.episode_film import save_episode_film


def test_a_film_of_an_episode_lasts_as_long_as_all_its_plans(tmp_path, monkeypatch):
    monkeypatch.setattr(films.ENCODERS[".gif"], "usual_fps", 2.0)
    plan = plan_from_dict(tiny_plans.two_apart())
    episode = Episode(name="twice", plans=(plan, plan))
    path = tmp_path / "film.gif"
    if made(lambda: save_episode_film(episode, path, width=64, height=48, fine=False, camera="top") or True) is None:
        return
    with Image.open(path) as film:
        assert sum(frame.info["duration"] for frame in ImageSequence.Iterator(film)) / 1e3 >= 2 * plan.makespan_s
