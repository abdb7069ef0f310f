#!/usr/bin/env bash
# Builds the native core with sanitizers, and runs it under them. `address` also finds undefined behaviour: the tests of the core with each
# variant that this processor runs, a plan by each planner, the fuzzer's good inputs and those that once failed, and two minutes of its
# changed inputs and hostile calls. `thread`: two threads that plan at once. Ends with an error at the first finding, which is on
# standard error or in build/sanitize-<kind>/found.<process>. First it shows that the sanitizers find planted faults; `planted` does
# only this, without the core.
# On a fresh machine it first makes .venv in the checkout. Usage: scripts/sanitize.sh [planted] [address] [thread]   (default: address thread)
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare dev
export PATH=$venv/bin:$PATH
if [ "$#" -eq 0 ]; then set -- address thread; fi

declare -A options=(
  [address]="-fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=undefined,float-cast-overflow"
  [thread]="-fsanitize=thread"
)
declare -A libraries=([address]="libasan.so libubsan.so" [thread]=libtsan.so)
declare -A planted=([address]="overflow float_cast signed_overflow" [thread]=race)
declare -A reports=(
  [overflow]="AddressSanitizer: heap-buffer-overflow"
  [float_cast]="is outside the range of representable values"
  [signed_overflow]="signed integer overflow"
  [race]="ThreadSanitizer: data race"
)

build() { # build <kind> <variants>: the core and a package around it in build/sanitize-<kind>
  local folder=$root/build/sanitize-$1 package
  say "Building the core ($2) with ${options[$1]}"
  # shellcheck disable=SC2086 # several targets on purpose
  cmake -S "$root/native" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DPython_EXECUTABLE="$venv/bin/python" \
    -DCMAKE_CXX_COMPILER="$CXX" -DCMAKE_CXX_FLAGS="${options[$1]} -fno-omit-frame-pointer -O1" >"$folder.log" 2>&1 &&
    cmake --build "$folder" --target ${2//v/_core_v} >>"$folder.log" 2>&1 || die "the build failed; see $folder.log"
  package=$folder/package
  rm -rf -- "$package"
  mkdir -p "$package"
  cp -r "$root/mmp_env" "$root/planners" "$root/tasks" "$root/scripts" "$root/tests" "$package"
  rm -f "$package"/mmp_env/_core_v*.so
  cp "$folder"/_core_v*.so "$package/mmp_env"
}

sanitized() { # sanitized <kind> <python arguments...>: runs them with the sanitizer's libraries
  local folder=$root/build/sanitize-$1 loaded=() name
  for name in ${libraries[$1]}; do loaded+=("$("$CXX" -print-file-name="$name")"); done
  shift
  ASAN_OPTIONS=detect_leaks=0:log_path=$folder/found TSAN_OPTIONS=halt_on_error=1:log_path=$folder/found \
    UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1:log_path=$folder/found \
    LD_PRELOAD="${loaded[*]}" "$venv/bin/python" -P "$@"
}

under() { # under <kind> <python arguments...>: runs them on the built core; ends with an error if that fails
  local package=$root/build/sanitize-$1/package
  say "${*:2}"
  (
    cd "$package"
    export PYTHONPATH=$package:$package/planners:$package/tasks:$package/scripts:$package/tests
    sanitized "$@"
  ) || die "$2 $3 ... failed; the report of the sanitizer is above or in ${package%/*}/found.*"
}

find_planted() { # find_planted <kind>: ends with an error unless the sanitizer reports each planted fault
  local folder=$root/build/sanitize-$1 fault
  mkdir -p "$folder"
  # shellcheck disable=SC2086 # several options on purpose
  "$CXX" ${options[$1]} -std=c++20 -shared -fPIC -O1 -g -o "$folder/planted.so" "$root/tests/support/planted_findings.cpp" ||
    die "the planted faults cannot be compiled"
  for fault in ${planted[$1]}; do
    rm -f -- "$folder"/found.*
    if sanitized "$1" -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1])[sys.argv[2]]()' "$folder/planted.so" "$fault" 2>"$folder/found.stderr"; then
      die "a planted $fault does not end the process"
    fi
    grep -qs -- "${reports[$fault]}" "$folder"/found.* || die "the $1 sanitizer does not report a planted $fault"
    say "A planted $fault is reported."
  done
  rm -f -- "$folder"/found.*
}

mkdir -p "$root/build"
use_ccache
find_compiler || die "no C++ compiler was found"
for kind in "$@"; do
  case $kind in
    planted)
      find_planted address
      find_planted thread
      ;;
    address)
      find_planted address
      variants=$("$venv/bin/python" -P -c 'from mmp_env import core; print(*core.usable_variants())')
      build address "$variants"
      for MMP_CORE in $variants; do # the last one, which is the best, is also that of all that follows
        export MMP_CORE
        under address tests/support/under_sanitizers.py loaded __asan_ __ubsan_
        under address -m pytest --import-mode=importlib -q -p no:cacheprovider --rootdir=. tests/core
      done
      under address tests/support/under_sanitizers.py plans
      export FUZZ_LONGEST_S=120 # sanitizers slow commands down
      under address -m pytest --import-mode=importlib -q -p no:cacheprovider --rootdir=. tests/test_fuzz.py \
        -k "good_inputs or once_failed"
      under address -m fuzz --minutes 2 --core-share 0.5 --figure sanitizers_fuzz_command_lines
      ;;
    thread)
      export MMP_CORE=v1
      find_planted thread
      build thread v1
      under thread tests/support/under_sanitizers.py loaded __tsan_
      under thread tests/support/under_sanitizers.py threads
      ;;
    *) die "'$kind' is no sanitizer; choose planted, address or thread" ;;
  esac
done
say "No sanitizer found anything but what was planted."
