#!/usr/bin/env bash
# Builds the source distribution, from it a wheel in a clean environment, and installs the wheel with its dependencies into another clean
# environment, where it plans an instance. It does so for each PYTHON. The wheel of the first one that is 3.12 or newer is for all of them:
# those that follow install it and plan with it, and build nothing. The files are in dist/.
# With ccache on the PATH, what was compiled before is taken from its cache. With --cold it uses an empty cache of its own, with --warm the
# same cache as the last --cold left it; then it also prints the time with the first PYTHON as a line of JSON, and ends with an error
# if it is above 150 s with --cold, or 90 s with --warm.
# Usage: scripts/wheel.sh [--cold | --warm] [PYTHON...]   (default: python3)
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

dist=$root/dist
declare -A longest=([cold]=150 [warm]=90) # bound of the time [s]

clean_environment() { # clean_environment <folder>: sets `venv` and `install`
  venv=$1
  rm -rf -- "$venv"
  mkdir -p "$(dirname "$venv")"
  open_venv
  # Like uv, pip leaves it to the first import to compile a module to bytecode: it would need twice the time for all modules.
  if [ "${install[0]}" != uv ]; then install+=(--no-compile); fi
  lend_pip_settings_to_uv
}

call_backend() { # call_backend <folder> <function>: prints the name of the file that it puts into dist/
  (cd "$1" && "$venv/bin/python" -P -c \
    "import sys, scikit_build_core.build as build; print(build.$2(sys.argv[1]))" "$dist") >"$log.name" 2>>"$log" ||
    quietly "$2" false
  tail -n 1 "$log.name"
}

build() { # build <folder>: sets `wheel`, the name of the file in dist/
  local wanted sdist
  clean_environment "$1/builder"
  mapfile -t wanted < <(requirements --build)
  use_ccache
  quietly "Fetching what the build needs" "${install[@]}" "${wanted[@]}"
  install_build_tools
  sdist=$(PATH=$venv/bin:$PATH call_backend "$root" build_sdist)
  say "dist/$sdist"
  rm -rf -- "$1/source"
  mkdir -p "$1/source"
  tar -xzf "$dist/$sdist" -C "$1/source" --strip-components 1
  wheel=$(PATH=$venv/bin:$PATH call_backend "$1/source" build_wheel)
}

build_and_try() { # build_and_try <python>: sets `stable`, a wheel for Python 3.12 and newer, if it builds one
  local started=$SECONDS home wheel=$stable version took
  PYTHON=$1 find_tools
  version=$("$python" -c 'import platform; print(platform.python_version())')
  home=$root/build/wheels/$("$python" -c 'import sys; print(sys.implementation.cache_tag)')
  if [ -z "$stable" ] || "$python" -c 'import sys; sys.exit(sys.version_info >= (3, 12))'; then
    build "$home"
    say "dist/$wheel, built with Python $version after $((SECONDS - started)) s"
    if [[ $wheel == *-abi3-* ]]; then stable=$wheel; fi
  fi
  clean_environment "$home/user"
  quietly "Installing the wheel" "${install[@]}" "$dist/$wheel"
  (cd "$home" && quietly "Planning with the installed wheel" "$venv/bin/mmp" plan MultiArmCell-2 --seed 1)
  took=$((SECONDS - started))
  say "dist/$wheel plans with Python $version in an environment of its own; from nothing in $took s"
  if [ -z "$cache" ]; then return; fi
  PYTHONPATH=$root/scripts "$venv/bin/python" -c \
    'import sys, figure; figure.print_figure(f"wheel_{sys.argv[1]}", int(sys.argv[2]), "s", python=sys.version.split()[0])' \
    "$cache" "$took"
  if [ "$took" -gt "${longest[$cache]}" ]; then die "--$cache took $took s; allowed: ${longest[$cache]} s"; fi
  cache=
}

stable=
cache=
case ${1:-} in
  --cold | --warm)
    cache=${1#--}
    shift
    command -v ccache >/dev/null || die "--$cache needs ccache"
    export CCACHE_DIR=$root/build/wheels/cache
    if [ "$cache" = cold ]; then rm -rf -- "$CCACHE_DIR"; fi
    ;;
  -*) die "unknown argument '$1'; it takes --cold, --warm and names of Python interpreters" ;;
esac

mkdir -p "$root/build" "$dist"
: >"$log"
if [ "$#" -eq 0 ]; then set -- "${PYTHON:-python3}"; fi
for each in "$@"; do build_and_try "$each"; done
