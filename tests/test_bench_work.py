"""`scripts/bench_work.py`: its schedules are valid, no delay causes a contact, and the checker finds planted faults."""

import json

from support import checkout_scripts


def test_it_checks_schedules_executes_them_with_delays_and_plants_faults():
    done = checkout_scripts.run(
        *("bench_work.py", "--arms", "4", "--jobs", "8", "--packed", "0", "--delays", "2", "--planted", "6")
    )
    assert done.returncode == 0, done.stderr
    figures = {line["name"]: line for line in map(json.loads, done.stdout.splitlines())}
    assert figures["work_drawn-8_4_valid"]["value"] == 1
    assert figures["work_drawn-8_4_in_shortest_rounds_s"]["value"] <= figures["work_drawn-8_4_in_rounds_s"]["value"]
    assert figures["work_drawn-8_4_delayed_patterns"]["value"] == 2
    assert figures["work_drawn-8_4_delayed_with_contact"]["value"] == 0
    assert figures["work_drawn-8_4_delayed_missed"]["value"] == 0
    for faults in ("work_planted", "work_planted_objects"):
        assert figures[faults]["value"] == figures[f"{faults}_found"]["value"] == 6
