"""The steps of `mmp plan`: plan, retime, write, check, execute and show, as far as each is asked for."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from mmp_cli.visual_outputs import CombinedWatcher, VisualOutputs
from mmp_env.errors import MmpError
from mmp_env.model.margins import asked_margins

if TYPE_CHECKING:
    from mmp_cli.interrupt import Interrupts
    from mmp_cli.outcome import Outcome
    from mmp_env.model.plan import Plan
    from mmp_env.model.problem import Problem
    from mmp_planners import Planner, PlanResult


def run_steps(args: Namespace, planner: Planner, label: str, problem: Problem, outputs: VisualOutputs) -> Outcome:
    """Plans, and then retimes, writes, checks, executes and shows the plan, as far as that is asked for.

    The first Ctrl-C ends the step that is running and leaves out those after it, except writing what there is, which
    it does not end. The second one raises `KeyboardInterrupt`.
    """
    from mmp_cli.interrupt import interruptible_steps

    with interruptible_steps() as interrupts:
        outcome = _planned(args, planner, label, problem, outputs, interrupts)
        steps = {"retime": _retimed, "out": _written, "check": _checked, "execute": _executed}
        for name, step in steps.items() if outcome.result.plan is not None else ():
            is_asked = name == "check" or name in outcome.steps
            if is_asked and (name == "out" or not interrupts.happened):
                outcome = _after(outcome, interrupts, partial(step, args, outcome), whole=name == "out")
        outcome = _after(outcome, interrupts, partial(_shown, outcome, outputs))
    return replace(outcome, shown=outputs.rows, failures=(*outcome.failures, *outputs.failures))


def _after(outcome: Outcome, interrupts: Interrupts, step: Callable[[], Outcome], *, whole: bool = False) -> Outcome:
    """Returns the outcome after a step, or the one before it, marked as interrupted, if Ctrl-C has ended the step."""
    stopped = replace(outcome, interrupted=True)
    try:
        out = interrupts.run(step, whole=whole) or stopped
    except KeyboardInterrupt as interrupt:
        interrupt.add_note((stopped.interruption or "").partition("; ")[2])
        raise
    return replace(out, interrupted=interrupts.happened)


def _planned(
    args: Namespace,
    planner: Planner,
    label: str,
    problem: Problem,
    outputs: VisualOutputs,
    interrupts: Interrupts,
) -> Outcome:
    started = time.perf_counter()
    result = _plan(args, planner, problem, outputs, interrupts)
    spent_s = time.perf_counter() - started
    out = replace(first_outcome(args, label, result), problem=problem, planning_time_s=spent_s)
    return replace(out, interrupted=interrupts.happened)


def first_outcome(args: Namespace, label: str, result: PlanResult) -> Outcome:
    """Returns the outcome of a run that has come to `result` and to nothing else yet."""
    from mmp_cli.outcome import Outcome

    return Outcome(
        instance=label,
        planner=args.planner,
        seed=args.seed,
        result=result,
        asked=asked_margins(args.margin),
        steps=frozenset(name for name in ("retime", "out", "execute") if getattr(args, name)),
    )


def _retimed(args: Namespace, outcome: Outcome) -> Outcome:
    from mmp_env.retime import retime_with_report

    try:
        plan, report = retime_with_report(_plan_of(outcome), **args.retiming)
    except MmpError as error:
        return outcome.failed(f"--retime: {error}")
    return replace(outcome, result=replace(outcome.result, plan=plan), retimed=report)


def _written(args: Namespace, outcome: Outcome) -> Outcome:
    from mmp_env.files.plan_file import save_plan

    try:
        save_plan(_plan_of(outcome), args.out)
    except MmpError as error:  # the disk is full, say: the other steps do not need the file
        return outcome.failed(f"--out: {error}")
    return replace(outcome, plan_path=args.out)


def _checked(args: Namespace, outcome: Outcome) -> Outcome:
    from mmp_env.check import check_document
    from mmp_env.files.plan_file import plan_to_check

    started = time.perf_counter()
    # The file's content rather than the object: the checker shall read the cell for itself.
    report = check_document(plan_to_check(_plan_of(outcome)))
    return replace(outcome, check=report, check_time_s=time.perf_counter() - started)


def _executed(args: Namespace, outcome: Outcome) -> Outcome:
    from mmp_cli.execution import execute

    try:
        return replace(outcome, execution=execute(_plan_of(outcome), args.source))
    except MmpError as error:
        return outcome.failed(f"--execute: {error}")


def _shown(outcome: Outcome, outputs: VisualOutputs) -> Outcome:
    outputs.finish(outcome.result.plan, outcome.execution, interrupted=outcome.interrupted)
    return outcome


def _plan_of(outcome: Outcome) -> Plan:
    assert outcome.result.plan is not None
    return outcome.result.plan


def _plan(
    args: Namespace, planner: Planner, problem: Problem, outputs: VisualOutputs, interrupts: Interrupts
) -> PlanResult:
    """Returns the result; Ctrl-C ends the planning with the best plan so far."""
    from rich.console import Console

    from mmp_cli.interrupt import stopping_on_interrupt
    from mmp_cli.progress import ProgressLine
    from mmp_planners.safe_plan import run_planner

    with ProgressLine(args.planner, Console(stderr=True)) as line, stopping_on_interrupt() as interruption:
        watch = CombinedWatcher(interruption.check, line, *outputs.watchers)
        result = run_planner(args.planner, planner, problem, seed=args.seed, time_limit=args.time_limit, watch=watch)
        interrupts.only_note()
    interrupts.happened |= interruption.happened
    return result
