#!/usr/bin/env bash
# Format, lint, import rules, types, the native core's stub and the tests, these against the installed wheel and not the checkout.
# On a fresh machine it first makes .venv in the checkout. Usage: scripts/test.sh [arguments for pytest]
# Without arguments, the tests that touch MuJoCo run with the oldest supported version too, and those of mmp_env.dm.
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev ray
cd "$root"
export PYTHON=$venv/bin/python PATH=$venv/bin:$PATH
export PYTHONSAFEPATH=1 # keeps the working directory, which may be the checkout, off the import path
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

# The oldest supported MuJoCo, and dm-control, which does not support the newest one: in a folder before the environment.
older=$root/build/mujoco-3.17-dm-control

fetch_older() {
  local wanted
  if [ -d "$older" ]; then return; fi
  find_tools
  open_venv
  lend_pip_settings_to_uv
  mapfile -t wanted < <(requirements dm | grep '^dm-control')
  rm -rf "$older.new"
  quietly "Fetching mujoco 3.17 and dm-control" "${install[@]}" --target "$older.new" "mujoco==3.17.*" "${wanted[@]}"
  mv "$older.new" "$older"
}

with_oldest_mujoco() {
  PYTHONPATH=$older pytest -n auto tests/mmp_env/{sim,gym,view} \
    tests/mmp_env/test_opengl_children.py tests/mmp_env/check/test_check_exact.py \
    tests/mmp_env/export/test_export_mjcf.py tests/mmp_tasks
}

clang_format() { git ls-files -z 'native/*.cpp' 'native/*.hpp' | xargs -0 clang-format --dry-run -Werror; }

# The time of the commit is the seed: each commit tries other inputs, and a test that failed fails again.
fuzz_for_a_minute() { PYTHONPATH=$root/tests:$root/scripts "$PYTHON" -m fuzz --minutes 1 --seed "$(git log -1 --format=%ct)"; }

with_dm_control() { PYTHONPATH=$older pytest -n auto tests/dm; }

step "python format" ruff format --check .
step "python lint" ruff check .
step "C++ format" clang_format
step "import rules" lint-imports --no-cache --no-logo
step "types" basedpyright --pythonpath "$PYTHON"
step "stub of the native core" scripts/core_stub.sh --check
step "the installed package is under test" installed_from_the_wheel
# Plain pytest: `python -m pytest` would put the checkout first on the path. One process per core.
step "tests" pytest -n auto "$@"
left_out=
if [ "$#" -eq 0 ]; then
  step "a minute of fuzzing" fuzz_for_a_minute
  step "older packages" fetch_older
  step "tests with mujoco 3.17" with_oldest_mujoco
  if [ -d "$older/dm_control" ]; then
    step "tests with dm-control" with_dm_control
  else
    left_out=" But the tests with dm-control were left out: it needs Python 3.11 or 3.12, PYTHON and MMP_VENV choose one."
  fi
fi

if [ "${#failed[@]}" -gt 0 ]; then
  die "failed: $(printf '%s, ' "${failed[@]}" | sed 's/, $//')"
fi
say "All is well.$left_out"
