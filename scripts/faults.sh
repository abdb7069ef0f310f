#!/usr/bin/env bash
# Runs commands again and again, and each time one of their calls to the system fails: an error, a full or read-only disk, a closed pipe,
# no memory, or SIGKILL; or standard error is closed. Exit code 1 if a file is half written, if something is lost that was reported, or after a traceback. It takes hours
# for all commands; name some of them, or give --most. On a fresh machine it first makes .venv in the checkout.
# Usage: scripts/faults.sh [--kinds KIND,...] [--most N] [--workers N] [COMMAND...]
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev
find_compiler || die "no C++ compiler was found"
PYTHONPATH=$root/tests:$root/scripts "$venv/bin/python" -P -m faults "$@"
