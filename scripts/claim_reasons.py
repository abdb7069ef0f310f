"""Measured reasons for the verdicts on the claims of the paper, with marks that `quoted.py` fills."""

from __future__ import annotations

from collections.abc import Callable

SAME = "the same"


def _figure(expression: str, form: str) -> str:
    return f"<!-- figure: {expression} as {form} --><!-- end -->"


def _nodes(run: str) -> str:
    """Returns the mean of the expanded nodes of FOLDER/CELL/LABEL."""
    return _figure(f"{run}/expanded_nodes_mean", ".3g")


def _per_node(run: str) -> str:
    """Returns the mean time divided by the mean of the expanded nodes."""
    return _figure(f"{run}/planning_time_mean / {run}/expanded_nodes_mean", "time")


def _on_each(figure: Callable[[int], str]) -> str:
    """Returns a figure of the cells of 4, 6 and 8 arms."""
    return ", ".join(figure(arms) for arms in (4, 6, 8))


def _of_cells(folder: str, label: str, what: str, form: str) -> str:
    return _on_each(lambda arms: _figure(f"{folder}/MultiArmCell-{arms}/{label}/{what}", form))


def _track(label: str, what: str, form: str) -> str:
    """Returns a figure of a variant of the fast track, whose runs with 4 arms are in `literal`."""
    return _on_each(lambda n: _figure(f"{'literal' if n == 4 else 'track'}/MultiArmCell-{n}/{label}/{what}", form))


def _track_time(label: str) -> str:
    """Returns the mean times of a variant of the fast track with 6 and 8 arms."""
    return ", ".join(_figure(f"track/MultiArmCell-{arms}/{label}/planning_time_mean", "time") for arms in (6, 8))


def _kind(kind: str) -> str:
    run = f"kinds/MultiArmCell-4/{kind}"
    return f"{_nodes(run)} with `{kind}` ({_figure(f'{run}/solved', 'of')})"


def _shortened(planner: str) -> str:
    """Returns the ratios of the costs of a planner without and with `shorten=400`."""
    return _on_each(lambda arms: _figure(f"repulsion/{planner} shorten=400/cost_ring-{arms}#ratio", ".3f"))


def _last_arm(key: str) -> str:
    """Returns a mean time of the arm that arrives last [s]."""
    return _on_each(lambda arms: _figure(f"waits_ring-{arms}{key}", ".1f"))


def _calls(run: str) -> str:
    return _figure(f"{run}/low_level_calls_mean", ".3g")


_FOUR, _EIGHT, _PRESET = "literal/MultiArmCell-4", "cells/MultiArmCell-8", "preset/MultiArmCell-8"

NODES = (
    f"the distance and the step, at 4 arms: {_nodes(f'{_FOUR}/apf-ecbs')} nodes by default, "
    f"{_nodes(f'{_FOUR}/gradient')} with `step=gradient`, {_nodes('decisions/MultiArmCell-4/centre-distance')} with "
    f"`distance=centre`, {_nodes(f'{_FOUR}/centre')} with both, and {_nodes(f'{_FOUR}/ecbs')} with `ecbs`"
)
TIME = (
    f"at 8 arms a node of `paper` takes {_per_node(f'{_PRESET}/paper')} and one of `ecbs-paper` "
    f"{_per_node(f'{_PRESET}/ecbs-paper')}; one of `apf-ecbs` {_per_node(f'{_EIGHT}/apf-ecbs')} and one of `ecbs` "
    f"{_per_node(f'{_EIGHT}/ecbs')}, but there are fewer of the former"
)
SUCCESS = (
    "at 4 arms no planner can solve more: `ecbs` solves "
    f"{_figure(f'{_FOUR}/ecbs/solved', 'of')} with our defaults, and "
    f"{_figure(f'{_FOUR}/ecbs-paper/solved', 'of')} with the settings of the paper"
)
FAST_TRACK = (
    "attempts that resolve all conflicts, at 4, 6 and 8 arms: with `paper` "
    f"{_of_cells('preset', 'paper', 'fast_track_hits', 'of')}; with our defaults "
    f"{_of_cells('cells', 'apf-ecbs', 'fast_track_hits', 'of')}. Ours also keep paths that leave fewer conflicts: mean "
    f"nodes, of 20 instances with 6 and 8 arms, {_track('apf-ecbs', 'expanded_nodes_mean', '.3g')} by default, and "
    f"{_track('discarded', 'expanded_nodes_mean', '.3g')} with `misses=discarded`"
)
LITERAL_TRACK = (
    "`literal-track`, the fast track of the paper, at 4, 6 and 8 arms: attempts that resolve all conflicts "
    f"{_track('literal-track', 'fast_track_hits', 'of')}; mean time "
    f"at 6 and 8 arms {_track_time('literal-track')} with it and {_track_time('apf-ecbs-nf')} without"
)
GEN_ECBS_AND_ECBS = (
    "Gen-ECBS branches with `split`, `avoid-state`, `sphere` and `priority`, `ecbs-paper` with `vertex`, and our "
    "`ecbs` with `avoid-state`. Nodes of `ecbs` at 4 arms with one kind, and solved: "
    f"{_kind('vertex')}, {_kind('avoid-state')}, {_kind('sphere')}, {_kind('priority')}, {_kind('split')}"
)
GEN_ECBS_AND_OURS = (
    "repulsion in `gen-ecbs` divides its nodes by "
    f"{_on_each(lambda n: _figure(f'repulsion/gen-ecbs repulsion=fast-track/nodes_ring-{n}#ratio', '.3g'))}. "
    "At 4 arms `avoid-state` in place of `vertex` divides those of `paper` by "
    f"{_figure(f'{_FOUR}/paper/expanded_nodes_mean / {_FOUR}/paper-avoid-state/expanded_nodes_mean', '.3g')}. "
    f"At 8 arms `gen-ecbs-paper` calls the low level {_calls(f'{_PRESET}/gen-ecbs-paper')} times, and `paper` "
    f"{_calls(f'{_PRESET}/paper')} times"
)
MAKESPAN = (
    "the path of the arm that arrives last, at 4, 6 and 8 arms: it takes "
    f"{_last_arm('#travel_of_ecbs')} s in plans of `ecbs` and {_last_arm('#travel')} s in those of `apf-ecbs`; waits "
    f"and slow motion take {_last_arm('#rest_of_ecbs')} s and {_last_arm('')} s: detours take "
    "time that shorter waits save"
)
COST = (
    "the cost of `ecbs` divided by that of `apf-ecbs`: "
    f"{_of_cells('cells', 'ecbs', 'cost_rad_where_both_solve#ratio', '.3f')}. `shorten=400` divides the cost of "
    f"`ecbs` by {_shortened('ecbs')}, and that of `apf-ecbs` by {_shortened('apf-ecbs')}: it takes detours out"
)
