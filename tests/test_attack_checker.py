"""`scripts/attack_checker.py`: every planted violation is found, every valid plan is accepted."""

import dataclasses
import json

import attack_checker
import pytest
from planted_violations import KINDS
from support import checkout_scripts

COUNT = len(KINDS)


def test_the_checker_finds_violations_of_every_kind():
    done = checkout_scripts.run("attack_checker.py", "--faults", 2 * COUNT, "--plans", 4, "--workers", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    figures = [json.loads(line) for line in done.stdout.splitlines()]
    assert [figure["planted"] for figure in figures[:COUNT]] == [2] * COUNT
    assert [figure["value"] for figure in figures] == [2] * COUNT + [2 * COUNT, 4]


@pytest.mark.parametrize("name", KINDS)
def test_a_checker_without_a_rule_misses_the_violations_of_its_kind(name, monkeypatch):
    check = attack_checker.check_plan

    def forgetful(given):
        report = check(given)
        kept = tuple(v for v in report.violations if v.rule not in KINDS[name].rules)
        return dataclasses.replace(report, violations=kept)

    number = list(KINDS).index(name)
    assert attack_checker.attacked(number)[:2] == (name, True)
    monkeypatch.setattr(attack_checker, "check_plan", forgetful)
    assert attack_checker.attacked(number)[:2] == (name, False)
