#!/usr/bin/env bash
# Two FR5 and two PiPER on one table pick up objects, pack them into a box and go home, in three plans.
# On a fresh machine it first makes .venv in the checkout, builds mmp-env and installs it there.
# Usage: scripts/demo_packing.sh [arguments of scripts/demo_packing.py, see --help]
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

# shellcheck disable=SC2119 # no extras
prepare
say "Picking, packing and going home in MultiArmCell-mixed-4"
"$venv/bin/python" -P "$root/scripts/demo_packing.py" --out "$root/episode.json" "$@"
say "Checking the saved episode again"
"$venv/bin/mmp" check "$root/episode.json"
