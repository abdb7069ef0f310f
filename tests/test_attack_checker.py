"""`scripts/attack_checker.py`: every planted violation is found, every valid plan is accepted."""

import dataclasses
import importlib
import json

import pytest
from support import checkout_scripts

from mmp_env.check import RULES

COUNT = 37
"""Number of kinds of violations."""


@pytest.fixture
def attack(monkeypatch):
    monkeypatch.syspath_prepend(checkout_scripts.SCRIPTS)
    return importlib.import_module("attack_checker")


def test_every_rule_has_a_kind_of_violation(attack):
    assert {kind.rule for kind in attack.KINDS.values()} == set(RULES)


def test_the_checker_finds_violations_of_every_kind(attack):
    assert len(attack.KINDS) == COUNT
    done = checkout_scripts.run("attack_checker.py", "--faults", 2 * COUNT, "--plans", 4, "--workers", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    figures = [json.loads(line) for line in done.stdout.splitlines()]
    assert [figure["planted"] for figure in figures[:COUNT]] == [2] * COUNT
    assert [figure["value"] for figure in figures] == [2] * COUNT + [2 * COUNT, 4]


@pytest.mark.parametrize("number", range(COUNT))
def test_a_checker_without_a_rule_misses_the_violations_of_its_kind(attack, number, monkeypatch):
    name, check = list(attack.KINDS)[number], attack.check_plan

    def forgetful(given):
        report = check(given)
        kept = tuple(v for v in report.violations if v.rule != attack.KINDS[name].rule)
        return dataclasses.replace(report, violations=kept)

    assert attack.attacked(number)[:2] == (name, True)
    monkeypatch.setattr(attack, "check_plan", forgetful)
    assert attack.attacked(number)[:2] == (name, False)
