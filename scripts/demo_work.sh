#!/usr/bin/env bash
# Four UR5e take 24 parts from two feeders, show some of them to a camera, and put them into boxes, each in its own time.
# On a fresh machine it first makes .venv in the checkout, builds mmp-env and installs it there.
# Usage: scripts/demo_work.sh [arguments of scripts/demo_work.py, see --help]
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

# shellcheck disable=SC2119 # no extras
prepare
say "Planning 24 jobs of four arms, executing the schedule in MuJoCo, and comparing it with rounds"
# Without -P: the script imports another one beside it.
run=("$venv/bin/python" "$root/scripts/demo_work.py")
case " $* " in *" --out"* | *" --help "* | *" -h "*) exec "${run[@]}" "$@" ;; esac
"${run[@]}" --out "$root/schedule.json" "$@"
say "Checking the saved schedule again"
"$venv/bin/mmp" check "$root/schedule.json"
