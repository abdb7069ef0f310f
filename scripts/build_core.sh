#!/usr/bin/env bash
# Builds the native core in place, mmp_env/_core_v*.so, for work on the sources with PYTHONPATH and no installation.
# Incremental. Usage: [PYTHON=path/to/python] scripts/build_core.sh [v1|v3|v4 ...]   (all variants by default)
# PYTHON needs nanobind; cmake, and ninja or make, come from the PATH or from PYTHON's environment.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
python=${PYTHON:-python3}
die() {
  echo "build_core.sh: $*" >&2
  exit 2
}
python=$("$python" -c 'import sys; print(sys.executable)' 2>/dev/null) || die "${PYTHON:-python3} does not run"
PATH=$(dirname "$python"):$PATH

"$python" -c 'import nanobind' 2>/dev/null || die "nanobind is missing: $python -m pip install nanobind cmake ninja"
command -v cmake >/dev/null || die "cmake is missing: $python -m pip install cmake ninja"
tag=$("$python" -c 'import sys; print(sys.implementation.cache_tag)')
build=$root/build/in-place-$tag

mkdir -p "$root/build"
if [ ! -f "$build/CMakeCache.txt" ]; then
  generator=()
  if command -v ninja >/dev/null; then generator=(-G Ninja); fi
  cmake -S "$root/native" -B "$build" "${generator[@]}" -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$python" \
    -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >"$build.log" 2>&1 || {
    cat "$build.log" >&2
    rm -f "$build/CMakeCache.txt"
    die "cmake could not set up the build"
  }
fi
targets=()
for level in "$@"; do targets+=(--target "_core_$level"); done
cmake --build "$build" --parallel "$(nproc)" "${targets[@]}"
for module in "$build"/_core_v*.so; do
  name=${module##*/}
  if cmp -s "$module" "$root/mmp_env/$name"; then continue; fi
  # Moved into place in one step: a running process keeps the file that it has mapped.
  cp "$module" "$root/mmp_env/.$name.$$"
  mv -f "$root/mmp_env/.$name.$$" "$root/mmp_env/$name"
done
