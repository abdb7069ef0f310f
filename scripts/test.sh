#!/usr/bin/env bash
# Format, lint, types, the native core's stub and the tests, these against the installed wheel and not the checkout.
# On a fresh machine it first makes .venv in the checkout. Usage: scripts/test.sh [arguments for pytest]
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev
cd "$root"
export PYTHON=$venv/bin/python PATH=$venv/bin:$PATH
failed=()

step() { # step <name> <command...>
  local name=$1 started=$SECONDS
  shift
  say "$name: $*"
  if "$@"; then
    say "... done, took $((SECONDS - started)) s"
  else
    say "... FAILED after $((SECONDS - started)) s"
    failed+=("$name")
  fi
}

installed_from_the_wheel() {
  "$PYTHON" -P -c 'import mmp_cli, mmp_env, mmp_planners, mmp_tasks, sys
for package in (mmp_cli, mmp_env, mmp_planners, mmp_tasks):
    assert package.__file__.startswith(sys.prefix), f"{package.__file__} is not in {sys.prefix}"'
}

step "python format" ruff format --check .
step "python lint" ruff check .
step "C++ format" clang-format --dry-run -Werror native/*.cpp native/*.hpp
step "types" basedpyright --pythonpath "$PYTHON"
step "stub of the native core" scripts/core_stub.sh --check
step "the installed package is under test" installed_from_the_wheel
# Plain pytest: `python -m pytest` would put the checkout first on the path. One process per core.
step "tests" pytest -n auto "$@"

if [ "${#failed[@]}" -gt 0 ]; then
  die "failed: $(printf '%s, ' "${failed[@]}" | sed 's/, $//')"
fi
say "All is well."
