#!/usr/bin/env bash
# Builds the native core with sanitizers, and runs it under them. `address` also finds undefined behaviour: the tests of the core with each
# variant that this processor runs, a plan by each planner, the fuzzer's good inputs and those that once failed, and two minutes of its
# changed inputs and hostile calls. `thread`: two threads that plan at once. Ends with an error at the first finding, which is in
# build/sanitize-<kind>/found.<process>.
# On a fresh machine it first makes .venv in the checkout. Usage: scripts/sanitize.sh [address] [thread]   (both by default)
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev
export PATH=$venv/bin:$PATH
if [ "$#" -eq 0 ]; then set -- address thread; fi

build() { # build <kind> <compiler options> <variants>: the core and a package around it in build/sanitize-<kind>
  local folder=$root/build/sanitize-$1 package
  say "Building the core ($3) with -fsanitize=$1"
  # shellcheck disable=SC2086 # several targets on purpose
  cmake -S "$root/native" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DPython_EXECUTABLE="$venv/bin/python" \
    -DCMAKE_CXX_COMPILER="$CXX" -DCMAKE_CXX_FLAGS="$2 -fno-omit-frame-pointer -O1" >"$folder.log" 2>&1 &&
    cmake --build "$folder" --target ${3//v/_core_v} >>"$folder.log" 2>&1 || die "the build failed; see $folder.log"
  package=$folder/package
  rm -rf -- "$package"
  mkdir -p "$package"
  cp -r "$root/mmp_env" "$root/planners" "$root/tasks" "$root/scripts" "$root/tests" "$package"
  rm -f "$package"/mmp_env/_core_v*.so
  cp "$folder"/_core_v*.so "$package/mmp_env"
}

under() { # under <kind> <runtime libraries> <command...>
  local folder=$root/build/sanitize-$1 libraries=() name
  local package=$folder/package
  for name in $2; do libraries+=("$("$CXX" -print-file-name="$name")"); done
  shift 2
  say "$*"
  (
    cd "$package"
    export PYTHONPATH=$package:$package/planners:$package/tasks:$package/scripts:$package/tests
    export ASAN_OPTIONS=detect_leaks=0:log_path=$folder/found TSAN_OPTIONS=halt_on_error=1:log_path=$folder/found
    export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1:log_path=$folder/found
    LD_PRELOAD="${libraries[*]}" "$venv/bin/python" -P "$@"
  ) || die "$1 $2 ... failed; the report of the sanitizer is in $folder/found.*"
}

mkdir -p "$root/build"
use_ccache
find_compiler || die "no C++ compiler was found"
for kind in "$@"; do
  case $kind in
    address)
      variants=$("$venv/bin/python" -P -c 'from mmp_env import core; print(*core.usable_variants())')
      build address "-fsanitize=address,undefined -fno-sanitize-recover=undefined" "$variants"
      libraries="libasan.so libubsan.so"
      for MMP_CORE in $variants; do # the last one, which is the best, is also that of all that follows
        export MMP_CORE
        under address "$libraries" -m pytest --import-mode=importlib -q -p no:cacheprovider --rootdir=. tests/core
      done
      under address "$libraries" tests/support/under_sanitizers.py plans
      under address "$libraries" -m pytest --import-mode=importlib -q -p no:cacheprovider --rootdir=. tests/test_fuzz.py \
        -k "good_inputs or once_failed"
      under address "$libraries" -m fuzz --minutes 2 --core-share 0.5 --longest 120 --figure sanitizers_fuzz_command_lines
      ;;
    thread)
      export MMP_CORE=v1
      build thread "-fsanitize=thread" v1
      under thread libtsan.so tests/support/under_sanitizers.py threads
      ;;
    *) die "'$kind' is no sanitizer; choose address or thread" ;;
  esac
done
say "No sanitizer found anything."
