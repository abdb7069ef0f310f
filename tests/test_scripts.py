"""Scripts beside the command line: each has a help text, and refuses unknown arguments with a sentence."""

import pytest
from support import checkout_scripts

COMMANDS = sorted(path.name for path in checkout_scripts.SCRIPTS.glob("*.py") if "__main__" in path.read_text())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_script_explains_its_arguments(name):
    done = checkout_scripts.run(name, "--help")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"usage: {name} ")


@pytest.mark.parametrize("name", COMMANDS)
def test_an_option_that_a_script_does_not_have_is_a_sentence(name):
    done = checkout_scripts.run(name, "--hepl")
    assert done.returncode == 2
    assert done.stdout == ""
    (sentence,) = done.stderr.splitlines()
    assert sentence.startswith(f"{name}: ")
    assert "'--hepl'" in sentence or "required" in sentence


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        ("bench_env.py", ["MultiArmCel-8"], "unknown environment id 'MultiArmCel-8'. Did you mean 'MultiArmCell-8'?"),
        ("bench_rerun.py", ["MultiArmCell"], "unknown environment id 'MultiArmCell'."),
        ("bench_retime.py", ["MultiArmCell-mixd-4:pick"], "Did you mean 'MultiArmCell-mixed-4'?"),
        ("bench_retime.py", ["--count", "0"], "'0' is not a whole number from 1"),
        ("bench_harness.py", ["MultiArmCel-8"], "Did you mean 'MultiArmCell-8'?"),
        ("bench_published.py", ["none", "none.csv"], "none.csv cannot be read: No such file or directory"),
        ("measure.py", ["cell"], "unknown part 'cell'. Did you mean 'cells'?"),
        ("measure.py", ["circles"], "the part 'circles' needs --instances"),
        ("bench_alone.py", ["none.json"], "none.json cannot be read: No such file or directory"),
        ("make_gallery.py", ["cell"], "unknown part of the gallery 'cell'. Did you mean 'cells'?"),
        ("results_page.py", [], "give either FOLDER or --check"),
        ("results_page.py", ["--check", "folder"], "give either FOLDER or --check"),
        ("results_page.py", ["folder"], "folder has no folder of `mmp bench` and no lines of figures"),
    ],
)
def test_misuse_of_a_script_is_a_sentence(name, words, message):
    done = checkout_scripts.run(name, *words)
    assert done.returncode == 2
    assert done.stdout == ""
    (sentence,) = done.stderr.splitlines()
    assert sentence.startswith(f"{name}: ")
    assert message in sentence
