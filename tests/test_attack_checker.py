"""`scripts/attack_checker.py`: every planted violation is found, every valid plan is accepted."""

import json

from support import checkout_scripts


def test_the_checker_finds_violations_of_every_kind():
    done = checkout_scripts.run("attack_checker.py", "--faults", 28, "--plans", 4, "--workers", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    figures = [json.loads(line) for line in done.stdout.splitlines()]
    assert [figure["planted"] for figure in figures[:14]] == [2] * 14
    assert [figure["value"] for figure in figures] == [2] * 14 + [28, 4]
