#!/usr/bin/env bash
# Eight arms keep working while a box is carried through their cell.
# On a fresh machine it first makes .venv in the checkout, builds mmp-env and installs it there.
# Usage: scripts/demo_online.sh [arguments of scripts/demo_online.py, see --help]
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

# shellcheck disable=SC2119 # no extras
prepare
say "Eight arms work while a box is carried through their cell"
# Without -P: the script imports another one beside it.
run=("$venv/bin/python" "$root/scripts/demo_online.py")
case " $* " in *" --out"* | *" --help "* | *" -h "*) exec "${run[@]}" "$@" ;; esac
"${run[@]}" --out "$root/online.json" "$@"
say "Checking the longest saved answer again"
"$venv/bin/mmp" check "$root/online.json"
