#!/usr/bin/env bash
# The types of the native core, mmp_env/_core.pyi, as nanobind's stubgen writes them from the compiled module.
# Usage: [PYTHON=path/to/python] scripts/core_stub.sh [--check]   writes the file, or says whether it is up to date.
# PYTHON (default: .venv/bin/python) has nanobind, and mmp-env installed or on PYTHONPATH with a core built in place.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
stub=$root/mmp_env/_core.pyi
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT

python=$(command -v -- "${PYTHON:-$root/.venv/bin/python}")
# From another folder: stubgen looks for modules where it stands, and the checkout may hold none or old ones.
(cd "$fresh" && "$python" -m nanobind.stubgen -q -m mmp_env._core_v1 -o _core.pyi)
if [ "${1:-}" != --check ]; then
  cp "$fresh/_core.pyi" "$stub"
elif ! diff -u "$stub" "$fresh/_core.pyi"; then
  echo "mmp_env/_core.pyi is not what the native core has now; write it again with scripts/core_stub.sh" >&2
  exit 1
fi
