"""`scripts/demo_work.py`: parts are packed without contact, faster than in rounds, and the saved schedule is valid."""

import json

from support import checkout_scripts

from mmp_env.check.schedule import check_schedule_document


def test_it_saves_a_schedule_that_the_checker_proves_and_no_contact_occurs(tmp_path):
    path = tmp_path / "schedule.json"
    done = checkout_scripts.run("demo_work.py", "--parts", "4", "--out", path)
    assert done.returncode == 0, done.stderr
    rows = {line.split()[0]: line for line in done.stdout.splitlines()}
    assert "of the makespan" in rows["planning"]
    assert "picks per minute" in rows["makespan"]
    assert rows["execution"].endswith("every goal reached, no contact")
    assert float(rows["in"].split()[-1]) <= 1.0
    document = json.loads(path.read_text())
    assert len(document["objects"]) == 4
    assert check_schedule_document(document).valid


def test_more_parts_than_the_feeders_hold_are_refused():
    done = checkout_scripts.run("demo_work.py", "--parts", "25")
    assert done.returncode == 2
    assert "25 parts are too many; the feeders hold 24" in done.stderr
