#!/usr/bin/env bash
# Format, lint, types, the native core's stub and the tests, these against the installed wheel and not the checkout.
# On a fresh machine it first makes .venv in the checkout. Usage: scripts/test.sh [arguments for pytest]
# Without arguments, the tests that touch MuJoCo run with the oldest supported version too.
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev ray
cd "$root"
export PYTHON=$venv/bin/python PATH=$venv/bin:$PATH
export PYTHONSAFEPATH=1 # nothing is imported from the checkout just because it is the working directory
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

with_oldest_mujoco() {
  local older=$root/build/mujoco-3.17
  if [ ! -d "$older" ]; then
    find_tools
    open_venv
    lend_pip_settings_to_uv
    rm -rf "$older.new"
    quietly "Fetching mujoco 3.17" "${install[@]}" --target "$older.new" "mujoco==3.17.*"
    mv "$older.new" "$older"
  fi
  PYTHONPATH=$older pytest -n auto \
    tests/mmp_env/test_{scene,env,simulation,execution,rendering,robot_servos,check_exact}*.py
}

step "python format" ruff format --check .
step "python lint" ruff check .
step "C++ format" clang-format --dry-run -Werror native/*.cpp native/*.hpp
step "types" basedpyright --pythonpath "$PYTHON"
step "stub of the native core" scripts/core_stub.sh --check
step "the installed package is under test" installed_from_the_wheel
# Plain pytest: `python -m pytest` would put the checkout first on the path. One process per core.
step "tests" pytest -n auto "$@"
if [ "$#" -eq 0 ]; then step "tests with mujoco 3.17" with_oldest_mujoco; fi

if [ "${#failed[@]}" -gt 0 ]; then
  die "failed: $(printf '%s, ' "${failed[@]}" | sed 's/, $//')"
fi
say "All is well."
