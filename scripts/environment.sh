# shellcheck shell=bash
# Sourced by the other scripts: `prepare [extra]` makes a virtual environment in the checkout, builds the
# wheel of mmp-env and installs it there. What is up to date is kept. The settings of pip (PIP_*) and uv (UV_*) hold as they are.
#   PYTHON    the interpreter to start from (default: python3, 3.11 or newer)
#   MMP_VENV  where the environment goes (default: .venv in the checkout)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$(realpath -m -- "${MMP_VENV:-$root/.venv}")
log=$root/build/prepare.log
unset PYTHONPATH PYTHONHOME # another environment's packages would hide the ones installed here

say() { printf '[%3d s] %s\n' "$SECONDS" "$*"; }
die() {
  printf '\n%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# quietly <what for> <command...>: output goes to the log; when it fails, its end is shown with a sentence.
quietly() {
  local what=$1
  shift
  { printf '\n$ %s\n' "$*" && "$@"; } >>"$log" 2>&1 && return
  tail -n 25 "$log" >&2
  die "$what did not work. The last lines are above, all of them in $log"
}

# --- what the machine has ---

is_311() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

find_python() {
  local name names=(python3 python3.14 python3.13 python3.12 python3.11)
  if [ -n "${PYTHON:-}" ]; then names=("$PYTHON"); fi
  for name in "${names[@]}"; do
    if is_311 "$name"; then
      python=$(command -v -- "$name")
      return
    fi
  done
  python=
}

# Sets `installers` to those of uv, venv and pip that are there, the preferred one first; `pip` installs from outside.
find_installers() {
  installers=()
  if command -v uv >/dev/null; then installers+=(uv); fi
  if "$python" -c 'import venv, ensurepip' 2>/dev/null; then installers+=(venv); fi
  local outside=--python
  for host_pip in pip3 pip "$python"; do
    if [ "$host_pip" = "$python" ]; then outside='-m pip --python'; fi
    # shellcheck disable=SC2086 # two words on purpose
    if "$host_pip" $outside "$python" --version >/dev/null 2>&1; then
      installers+=(pip)
      return
    fi
  done
}

# Exports CXX: otherwise the compiler that Python itself was built with is looked for.
find_compiler() {
  local name names=(g++ c++ clang++)
  if [ -n "${CXX:-}" ]; then names=("$CXX"); fi
  for name in "${names[@]}"; do
    if command -v -- "${name%% *}" >/dev/null; then
      export CXX=$name
      return
    fi
  done
  return 1
}

# Everything that the build needs from the system, asked for in one go.
find_tools() {
  local missing=() packages=() sudo='' list
  find_python
  if [ -z "$python" ]; then
    missing+=("Python 3.11 or newer${PYTHON:+ at $PYTHON}")
    packages+=(python3 python3-dev python3-venv)
  else
    if [ ! -f "$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h" ]; then
      missing+=("the header files of $python (Python.h)")
      packages+=(python3-dev)
    fi
    find_installers
    if [ "${#installers[@]}" -eq 0 ]; then
      missing+=("an installer of Python packages (uv, venv or pip)")
      packages+=(python3-venv)
    fi
  fi
  if ! find_compiler; then
    missing+=("a C++ compiler${CXX:+ at $CXX}")
    packages+=(g++)
  fi
  if [ "${#missing[@]}" -eq 0 ]; then return; fi
  list=$(printf ', %s' "${missing[@]}")
  if [ "$(id -u)" -ne 0 ]; then sudo='sudo '; fi
  die "this machine lacks ${list:2}. On Debian and Ubuntu one command gets all of it:

  ${sudo}apt-get update && ${sudo}apt-get install -y ${packages[*]}
"
}

# --- the environment ---

# Whether the environment runs and stands where it was made: a copied checkout has scripts that point to the old place.
venv_works() { is_311 "$venv/bin/python" && grep -qF -- "$venv" "$venv/bin/activate" 2>/dev/null; }

make_venv() { # make_venv <installer>
  if [ -e "$venv" ] && [ ! -f "$venv/pyvenv.cfg" ]; then die "$venv exists and is no virtual environment"; fi
  rm -rf -- "$venv"
  case $1 in
    uv) uv venv --python "$python" "$venv" ;;
    venv) "$python" -m venv "$venv" ;;
    pip) "$python" -m venv --without-pip "$venv" ;;
  esac >>"$log" 2>&1
}

# Sets `install`, the command that installs into the environment, which is made when there is none that works.
open_venv() {
  local installer
  for installer in "${installers[@]}"; do
    if ! venv_works; then make_venv "$installer" || continue; fi
    case $installer in
      uv) install=(uv pip install --python "$venv/bin/python") ;;
      venv)
        if ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then continue; fi
        install=("$venv/bin/python" -m pip install)
        ;;
      pip)
        install=("$host_pip" --python "$venv/bin/python" install)
        if [ "$host_pip" = "$python" ]; then install=("$python" -m pip --python "$venv/bin/python" install); fi
        ;;
    esac
    say "$("$venv/bin/python" --version) in $venv, packages through $installer"
    return
  done
  die "no virtual environment could be made at $venv with ${installers[*]}; what they said stands in $log"
}

# uv does not read the settings of pip.
lend_pip_settings_to_uv() {
  if [ -n "${PIP_INDEX_URL:-}" ]; then export UV_DEFAULT_INDEX="${UV_DEFAULT_INDEX:-$PIP_INDEX_URL}"; fi
  if [ -n "${PIP_EXTRA_INDEX_URL:-}" ]; then export UV_INDEX="${UV_INDEX:-$PIP_EXTRA_INDEX_URL}"; fi
  if [ -n "${PIP_FIND_LINKS:-}" ]; then export UV_FIND_LINKS="${UV_FIND_LINKS:-$PIP_FIND_LINKS}"; fi
  if [ -n "${PIP_CERT:-}" ]; then export SSL_CERT_FILE="${SSL_CERT_FILE:-$PIP_CERT}"; fi
}

# --- what is installed in it ---

# Prints the requirements in pyproject.toml, one a line: those of the build, of the package, and of the named extras or all extras.
requirements() { # requirements [extra... | --all | --build]
  "$python" - "$root/pyproject.toml" "$@" <<'PYTHON'
import sys, tomllib

with open(sys.argv[1], "rb") as file:
    data = tomllib.load(file)
lines = data["build-system"]["requires"]
if sys.argv[2:] != ["--build"]:
    lines += data["project"]["dependencies"]
    extras = data["project"]["optional-dependencies"]
    for extra in extras if sys.argv[2:] == ["--all"] else sys.argv[2:]:
        lines += extras[extra]
print("\n".join(lines))
PYTHON
}

# shellcheck disable=SC2143 # grep -q would break the pipe, which pipefail takes for a failure
requirements_met() {
  [ -f "$venv/.mmp-requirements" ] && [ -z "$(requirements "$@" | grep -vxFf "$venv/.mmp-requirements")" ]
}

# Notes what is installed. Packages that other scripts asked for are still there: their lines stay while pyproject.toml has
# them.
record_requirements() { # record_requirements [extra...]
  local lines
  touch "$venv/.mmp-requirements"
  mapfile -t lines < <(requirements "$@" && grep -xFf "$venv/.mmp-requirements" <<<"$(requirements --all)")
  printf '%s\n' "${lines[@]}" >"$venv/.mmp-requirements"
}

# cmake and ninja where the machine has none, or too old ones: the build backend knows.
install_build_tools() {
  local wanted
  mapfile -t wanted < <(cd "$root" && "$venv/bin/python" -P -c \
    'from scikit_build_core.build import get_requires_for_build_wheel as needs; print(*needs(), sep="\n")')
  if [ -n "${wanted[*]}" ]; then quietly "Fetching build tools" "${install[@]}" "${wanted[@]}"; fi
}

install_requirements() { # install_requirements [extra...]
  local wanted started=$SECONDS
  if requirements_met "$@"; then return; fi
  say "Fetching Python packages (about a minute) ..."
  lend_pip_settings_to_uv
  mapfile -t wanted < <(requirements "$@")
  quietly "Fetching packages (it needs a network; PIP_INDEX_URL or PIP_FIND_LINKS can name another source)" \
    "${install[@]}" "${wanted[@]}"
  install_build_tools
  record_requirements "$@"
  say "... done, took $((SECONDS - started)) s"
}

# A hash of all that goes into the wheel.
sources() {
  (cd "$root" && find pyproject.toml LICENSE README.md native mmp_env planners tasks scripts/mmp_cli -type f \
    ! -name '*.so' ! -name '*.pyc' -print0 | sort -z | xargs -0 sha256sum | sha256sum)
}

sources_installed() { [ "$(cat "$venv/.mmp-sources" 2>/dev/null)" = "$(sources)" ]; }

# What was compiled before is taken from the cache of ccache, if it is there. Paths in the checkout are no part of what is compared.
use_ccache() {
  if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1; fi
}

install_package() {
  local built now started=$SECONDS
  if sources_installed; then return; fi
  say "Building mmp-env (a minute or two when the native core is new) ..."
  now=$(sources)
  use_ccache
  rm -rf -- "$root/build/wheel"
  cd "$root"
  quietly "Building the wheel" "$venv/bin/python" -P -c \
    'from scikit_build_core.build import build_wheel; build_wheel("build/wheel")'
  built=("$root"/build/wheel/mmp_env-*.whl)
  quietly "Installing the wheel" "${install[@]}" --no-deps --no-index --force-reinstall "${built[0]}"
  cd "$OLDPWD"
  printf '%s\n' "$now" >"$venv/.mmp-sources"
  say "... done, took $((SECONDS - started)) s"
}

up_to_date() {
  python=$venv/bin/python
  venv_works && requirements_met "$@" && sources_installed
}

prepare() { # prepare [extra...]
  if up_to_date "$@"; then return; fi
  if ! mkdir -p "$root/build" 2>/dev/null || [ ! -w "$root/build" ] || [ ! -w "$root" ]; then
    die "$root cannot be written to; work in a copy of your own"
  fi
  # One at a time: a second run waits and then finds everything done.
  exec 9>"$root/build/.lock"
  if command -v flock >/dev/null; then flock 9; fi
  if ! up_to_date "$@"; then
    find_tools
    : >"$log"
    open_venv
    install_requirements "$@"
    install_package
  fi
  exec 9>&-
}
