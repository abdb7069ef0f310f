import io

from rich.console import Console

from mmp_cli.progress import ProgressLine, ScheduleLine
from mmp_env.events import FastTracked, NodeExpanded, SearchStarted, SolutionFound


def watch_a_search(line):
    line(SearchStarted(elapsed_s=0.0, restart=2, sub_seed=1))
    line(NodeExpanded(elapsed_s=0.1, node=3, open_nodes=5, expanded_nodes=12, conflicts=4))
    line(FastTracked(elapsed_s=0.2, node=3, arms=("arm0",), solved=True))
    line(SolutionFound(elapsed_s=0.3, node=4, cost_rad=12.345, clearance_m=0.002))


def test_the_line_shows_the_state_of_the_search():
    line = ProgressLine("ecbs", Console(file=io.StringIO()))
    watch_a_search(line)
    for words in ["ecbs: ", "12 nodes expanded", "5 open", "4 conflicts", "restart 2", "1 fast-tracked", "12.35 rad"]:
        assert words in line.text()


def test_nothing_is_written_where_there_is_no_terminal():
    file = io.StringIO()
    with ProgressLine("ecbs", Console(file=file)) as line:
        watch_a_search(line)
    assert file.getvalue() == ""


def test_a_terminal_shows_the_line_and_is_left_as_it_was():
    file = io.StringIO()
    with ProgressLine("ecbs", Console(file=file, force_terminal=True, width=200)) as line:
        watch_a_search(line)
    shown = file.getvalue()
    assert "ecbs: " in shown
    assert "0:00:00" in shown
    assert shown.count("\x1b[?25l") == shown.count("\x1b[?25h") == 1  # the cursor is hidden once and restored once


def test_the_line_of_schedules_shows_the_shortest_so_far_on_a_terminal_alone():
    for is_terminal in (True, False):
        file = io.StringIO()
        with ScheduleLine("auto", 4, Console(file=file, force_terminal=is_terminal, width=200)) as line:
            line.show(12.345)
        assert ("auto, 4 jobs: shortest schedule so far 12.35 s" in file.getvalue()) == is_terminal
        assert (file.getvalue() == "") != is_terminal
