"""The summary of a run as text."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, repeat

import numpy as np

from mmp_cli.outcome import Outcome
from mmp_cli.output import one_line, print_rows
from mmp_env.model.keep import Upright
from mmp_env.model.margins import DEFAULT_MARGIN_M, KIND_WORDS, KINDS
from mmp_env.model.model_joints import ModelJoints
from mmp_env.model.problem import Problem
from mmp_env.retime import RetimeReport
from mmp_env.sim.clearance_audit import ClearanceAudit
from mmp_env.sim.execution import ExecutionReport
from mmp_env.wording import counted, in_seconds
from mmp_planners import PlanResult, Status


def print_summary(outcome: Outcome) -> None:
    """Prints the summary, a row per fact."""
    print_rows((name, "bold", text) for name, text in _rows(outcome))


def _rows(outcome: Outcome) -> Iterator[tuple[str, str]]:
    plan, problem = outcome.result.plan, outcome.problem
    yield "instance", outcome.instance
    if problem and problem.cell.joints is not None:
        yield from zip(chain(["joints"], repeat("")), _joints(problem.cell.joints), strict=False)
    yield "planner", f"{outcome.planner}, seed {outcome.seed}"
    yield "status", _status(outcome)
    if plan is None and not outcome.interrupted:
        yield "advice", outcome.result.status.advice
    if outcome.planning_time_s is not None:
        proof = "" if outcome.result.status == Status.ERROR else ", certificate included"
        yield "planning", f"{outcome.planning_time_s:.3f} s{proof}"
    yield "search", _search(outcome.result)
    if plan and problem:
        yield "cost", _cost(outcome.result, plan.cost_rad, problem)
        yield "makespan", _makespan(plan.makespan_s, outcome.retimed, problem.cell.largest_unit)
    if problem:
        yield "margin", _margin(outcome, problem)
        bounds = (_bound(arm, bound) for arm, bound in problem.keep.items())
        yield from zip(chain(["keep"], repeat("")), bounds, strict=False)
    if outcome.check is not None:
        *sentences, last = str(outcome.check).splitlines()
        sentences.append(f"{last}; checked in {outcome.check_time_s:.2f} s")
        yield from zip(chain(["check"], repeat("")), sentences, strict=False)
        yield from zip(chain(["not tested"], repeat("")), outcome.check.not_tested, strict=False)
    elif plan:
        yield "check", "left out, the run was interrupted; mmp check does it"
    yield from _not_done(outcome)
    if outcome.execution is not None and problem:
        yield "execution", _execution(outcome.execution)
        if plan and plan.steps_in_velocity:
            yield "warning", "the executed plan is not retimed, no motor can follow its corners; leave out --no-retime"
    if outcome.plan_path is not None:
        yield "plan file", outcome.plan_path
    yield from outcome.shown.items()
    if plan and outcome.execution is None and not outcome.interrupted and not outcome.refuted:
        yield "next", _next_step(outcome)


def _next_step(outcome: Outcome) -> str:
    """Returns what makes a motion of a plan that is proved and not executed."""
    retimes = "" if outcome.retimed else ", both retime it"
    if outcome.plan_path is None:
        return f"--execute plays the plan in MuJoCo, --out FILE keeps it for mmp export{retimes}"
    return f"mmp export {outcome.plan_path} --to motion.csv writes it for a controller, --execute plays it{retimes}"


def _not_done(outcome: Outcome) -> Iterator[tuple[str, str]]:
    """Yields a row for each step that was asked for and not done: there is no plan, or the run was interrupted."""
    if outcome.result.plan is not None and not outcome.interrupted:
        return
    why = "there is no plan" if outcome.result.plan is None else "the run was interrupted"
    results = {"retime": outcome.retimed, "execute": outcome.execution, "out": outcome.plan_path}
    rows = {"retime": ("retiming", "done"), "execute": ("execution", "done"), "out": ("plan file", "written")}
    for step, (name, verb) in rows.items():
        if step in outcome.steps and results[step] is None:
            yield name, f"not {verb}: {why}"


def _status(outcome: Outcome) -> str:
    words = {
        "timeout": "timeout: no plan in time",
        "exhausted": "exhausted: the constraints used up the search",
        "error": f"error: {one_line(outcome.message or 'the planner does not say what went wrong')}",
    }
    status = str(outcome.result.status)
    return ("interrupted; " if outcome.interrupted else "") + words.get(status, status)


def _search(result: PlanResult) -> str:
    stats = result.stats
    names = {
        "expanded_nodes": ("node expanded", "nodes expanded"),
        "generated_nodes": ("generated", "generated"),
        "low_level_calls": ("low-level call", "low-level calls"),
        "root_conflicts": ("conflict at the root", "conflicts at the root"),
    }
    if stats.get("found_by"):  # a portfolio: zero counts of members that did not run say nothing
        names = {key: name for key, name in names.items() if stats.get(key)}
    parts = [_counted(stats[key], *name) for key, name in names.items() if stats.get(key) is not None]
    if stats.get("fast_track_tries"):
        parts.append(f"fast track {stats.get('fast_track_hits')} of {stats['fast_track_tries']}")
    first = stats.get("first_plan_s")
    changes = {
        "shortcuts": ("shortcut", "shortcuts"),
        "replanned": ("replanning", "replannings"),
        "recombined": ("recombination", "recombinations"),
    }
    made = [_counted(stats[key], *name) for key, name in changes.items() if stats.get(key)]
    if isinstance(first, int | float) and (made or stats.get("found_by")):
        finder = f" by {stats['found_by']}" if stats.get("found_by") else ""
        parts += [f"first plan{finder} after {first:.3f} s", *made]
    return ", ".join(parts) or "not counted by this planner"


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def _cost(result: PlanResult, cost: float, problem: Problem) -> str:
    slides = any(any(arm.robot.slides) for arm in problem.cell.arms)
    bound, unit = problem.cost_lower_bound_rad, "rad and m of slides" if slides else "rad"
    if bound <= 0:
        return f"{cost:.2f} {unit}"
    text = f"{cost:.2f} {unit}, {cost / bound:.3f} x the straight lines"
    options = (result.plan.planner if result.plan else {}).get("options", {})
    w, straight = options.get("w"), options.get("bound") == "straight"
    if not isinstance(w, int | float):
        return text
    if cost <= w * bound:
        return f"{text}: at most {w:g} x the best"
    met, costs = result.stats.get("bound_met"), "the straight lines" if straight else "the planner's own costs"
    return f"{text}; bound {'met' if met else 'not met'}: {w:g} x {costs}"


def _margin(outcome: Outcome, problem: Problem) -> str:
    """Returns the margins in force, and why a default is smaller than usual."""
    when = ", at every instant" if outcome.result.plan else "" if outcome.asked else ", the default"
    text = f"{problem.margins}{when}"
    tight = [kind for kind in KINDS if kind not in outcome.asked and problem.margins[kind] < DEFAULT_MARGIN_M]
    if tight:
        words = " and ".join(KIND_WORDS[kind] for kind in tight)
        text += f"; start or goal is tight {words}, where the default is {DEFAULT_MARGIN_M * 1e3:g} mm"
    return text


def _bound(arm: str, bound: Upright) -> str:
    axis = ", ".join(f"{number:g}" for number in np.asarray(bound.axis))
    return f"{arm} within {bound.within:g} rad of upright, axis [{axis}], at every instant"


def _makespan(makespan_s: float, retimed: RetimeReport | None, unit: str) -> str:
    if retimed is None:
        return in_seconds(makespan_s)
    velocities = f"{retimed.ratio:.3f} x the {retimed.fastest_s:.2f} s that velocity limits alone allow"
    stops = f", {retimed.stops} of {retimed.corners} corners are stops" if retimed.stops else ""
    smoothed = f"corners rounded by {retimed.deviation_rad:.3f} {unit} at most{stops}"
    return f"{in_seconds(makespan_s)} retimed, {in_seconds(retimed.given_s)} as planned; {velocities}; {smoothed}"


def _joints(joints: ModelJoints) -> Iterator[str]:
    """Yields which joints of a model each arm has, and that it holds the others."""
    for arm, names in joints.names.items():
        yield f"{arm}: {', '.join(names)}"
    if len(joints.qpos) > sum(map(len, joints.addresses.values())):
        yield "all other joints of the model are held at their value"


def _execution(report: ExecutionReport) -> str:
    goals = "every goal reached" if report.reached else "GOAL NOT REACHED"
    contacts = counted(len(report.contacts), "contact") if report.contacts else "no contact"
    error = f"tracking error at most {report.max_tracking_error_rad:.4f} {report.unit}"
    arm, load = max(report.loads.items(), key=lambda item: item[1].share)
    torque = f"torque at most {load.share:.0%} of its rating ({arm}, joint {load.joint})"
    return f"{goals}, {contacts}, {error}, {torque}, {_nearness(report.nearness)}{report.duration_s:.2f} s"


def _nearness(nearness: ClearanceAudit) -> str:
    if nearness.closer_m <= 0:
        return ""
    pair = f"{nearness.body_a} and {nearness.body_b}"
    return f"{pair} {nearness.closer_m * 1e3:.2f} mm closer than proved of the plan, at {nearness.time_s:.2f} s, "
