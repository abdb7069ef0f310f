#!/usr/bin/env bash
# Measures all planners again, as docs/results has them: the paper's experiment (arXiv 2509.13882) on cells of 4, 6 and 8
# UR5e, paper-literal settings beside our design decisions, constraint kinds, tasks, and the other planners. Started again
# on the same commit, it goes on where it stopped. On a fresh machine it first makes .venv in the checkout.
usage='usage: scripts/reproduce_paper.sh [--quick] [--time-limit S] [--count N] [--workers N] [--out DIR] [--instances DIR]
                                 [--pages] [PART...]
  --quick         less than ten minutes on one core: 10 instances and 1 s, if no other option says more
  --time-limit S  for each run [s]; default: 10, the paper has 1800
  --count N       instances of each cell, those of the seeds 0 to N - 1; default: 50
  --workers N     runs at a time; default: one for each core. Other work on the machine makes times longer
  --out DIR       folder of the results; default: build/reproduction-<time limit>s
  --instances DIR folder of panda-circle-N.json and panda-circle-N.published.csv: measures the part circles, too
  --pages         then writes the pages of docs with the results. Not with --quick
  PART            default: cells kinds tasks literal others panda preset study, and beyond if not --quick;
                  scripts/measure.py --help names all
It leaves out small and attacks, which measure this program and not the planners, and the pictures (scripts/make_gallery.sh).'
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

time_limit=
count=
workers=$(nproc 2>/dev/null || echo 1)
out=
instances=
pages=()
quick=
parts=()
full=(10 50)
beyond=(beyond)
while [ "$#" -gt 0 ]; do
  case $1 in
    -h | --help)
      printf '%s\n' "$usage"
      exit 0
      ;;
    --quick)
      quick=yes
      full=(1 10)
      beyond=()
      shift
      ;;
    --pages)
      pages=(pages)
      shift
      ;;
    --time-limit | --count | --workers | --out | --instances)
      if [ "$#" -lt 2 ]; then die "$1 needs a value; $usage"; fi
      name=${1#--}
      printf -v "${name//-/_}" '%s' "$2"
      shift 2
      ;;
    -*) die "unknown argument '$1'; $usage" ;;
    *)
      parts+=("$1")
      shift
      ;;
  esac
done
time_limit=${time_limit:-${full[0]}}
count=${count:-${full[1]}}
for name in count workers; do
  if ! [[ ${!name} =~ ^[1-9][0-9]{0,5}$ ]]; then die "--$name is '${!name}'; it must be a whole number from 1"; fi
done
if ! [[ $time_limit =~ ^[0-9]{1,6}(\.[0-9]+)?$ ]]; then
  die "--time-limit is '$time_limit'; it must be a number of seconds"
fi
if [ "${#parts[@]}" -eq 0 ]; then parts=(cells kinds tasks literal others panda preset study "${beyond[@]}"); fi
if [ -n "$quick" ] && [ "${#pages[@]}" -gt 0 ]; then die "--pages does not go with --quick: the pages have all instances"; fi
more=()
if [ -n "$instances" ]; then
  if ! [ -d "$instances" ]; then die "--instances is '$instances', which is no folder"; fi
  parts+=(circles)
  more=(--instances "$(realpath -- "$instances")")
fi
parts+=("${pages[@]}")
out=$(realpath -m -- "${out:-$root/build/reproduction-${time_limit}s}")

# shellcheck disable=SC2119 # no extras
prepare
say "$count instances of each cell, $time_limit s each, $workers at a time. Into $out"
cd "$root"
PYTHONSAFEPATH= "$venv/bin/python" scripts/measure.py "${parts[@]}" "${more[@]}" --count "$count" --time-limit "$time_limit" --workers "$workers" --out "$out"
say "Not run: small and attacks (scripts/measure.py), and the pictures (scripts/make_gallery.sh)"
if [ "${#pages[@]}" -gt 0 ]; then
  say "Done. The pages of docs have these results"
else
  say "Done. \`$venv/bin/python scripts/measure.py pages --out $out\` writes the pages of docs with these results; until then they stay as they are"
fi
