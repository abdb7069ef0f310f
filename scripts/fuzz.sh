#!/usr/bin/env bash
# Changes files of every kind and options of all commands, and calls the native core with hostile arrays; exit code 1 if anything
# crashes, hangs, ends with a traceback, leaves half a file or accepts nonsense. Inputs that failed are kept.
# On a fresh machine it first makes .venv in the checkout. Usage: scripts/fuzz.sh [--minutes N] [--workers N] [--seed N] [--core-share X] [--keep DIR]
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev
PYTHONPATH=$root/tests:$root/scripts "$venv/bin/python" -P -m fuzz "$@"
