#!/usr/bin/env bash
# Repeats the paper's experiment (arXiv 2509.13882): cells of 4, 6 and 8 UR5e, 50 instances each, five planners; then, on
# the cell of four, paper-literal settings beside our design decisions. Ends with two reports. Started again, it goes on
# where it stopped. On a fresh machine it first makes .venv in the checkout.
usage='usage: scripts/reproduce_paper.sh [--time-limit S] [--count N] [--workers N] [--out DIR]
  --time-limit S  for each run [s]; default: 10, the paper has 1800
  --count N       instances of each cell, those of the seeds 0 to N - 1; default: 50
  --workers N     runs at a time; default: one for each core. Other work on the machine makes times longer
  --out DIR       folder of the results; default: reproduction-<time limit>s'
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

time_limit=10
count=50
workers=$(nproc 2>/dev/null || echo 1)
out=
while [ "$#" -gt 0 ]; do
  case $1 in
    -h | --help)
      printf '%s\n' "$usage"
      exit 0
      ;;
    --time-limit | --count | --workers | --out)
      if [ "$#" -lt 2 ]; then die "$1 needs a value; $usage"; fi
      name=${1#--}
      printf -v "${name//-/_}" '%s' "$2"
      shift 2
      ;;
    *) die "unknown argument '$1'; $usage" ;;
  esac
done
for name in count workers; do
  if ! [[ ${!name} =~ ^[1-9][0-9]{0,5}$ ]]; then die "--$name is '${!name}'; it must be a whole number from 1"; fi
done
if ! [[ $time_limit =~ ^[0-9]{1,6}(\.[0-9]+)?$ ]]; then
  die "--time-limit is '$time_limit'; it must be a number of seconds"
fi
out=${out:-reproduction-${time_limit}s}

cells=(MultiArmCell-4 MultiArmCell-6 MultiArmCell-8)
planners=cbs,ecbs,gen-ecbs,apf-ecbs-nf,apf-ecbs

# Variants that revert one design decision each ("gradient"), the paper-literal settings ("literal"), and these without one
# of them ("literal-surface"). docs/explanation/paper.md explains each decision.
variants=(
  "apf-ecbs"
  "gradient: step=gradient"
  "centre: distance=centre step=gradient"
  "all-iterations: early_stop=off"
  "literal-track: fast_track=literal"
  "vertex: constraint=vertex"
  "vertex-0.05: constraint=vertex radius=0.05"
  "one-tree: restarts=off"
  "literal: step=gradient distance=centre early_stop=off fast_track=literal constraint=vertex restarts=off"
  "literal-0.05: step=gradient distance=centre early_stop=off fast_track=literal constraint=vertex radius=0.05 restarts=off"
  "literal-surface: step=gradient early_stop=off fast_track=literal constraint=vertex restarts=off"
  "literal-avoid-state: step=gradient distance=centre early_stop=off fast_track=literal restarts=off"
  "literal-restarts: step=gradient distance=centre early_stop=off fast_track=literal constraint=vertex"
  "ecbs"
  "ecbs-literal: constraint=vertex restarts=off"
)

# Sets `labels`, for --planners, and `settings`, the --set of all variants.
read_variants() {
  local variant label option planner
  labels=
  settings=()
  for variant in "${variants[@]}"; do
    label=${variant%%:*}
    planner=apf-ecbs
    if [ "${label%%-*}" = ecbs ]; then planner=ecbs; fi
    if [ "$label" = "$planner" ]; then labels+=,$label; else labels+=,$label=$planner; fi
    if [ "$label" = "$variant" ]; then continue; fi
    for option in ${variant#*:}; do settings+=(--set "$label.$option"); done
  done
  labels=${labels#,}
}

# Prints the longest time of a number of runs in readable units, without checks and the start of workers.
at_most() { # at_most <runs>
  awk -v runs="$1" -v limit="$time_limit" -v workers="$workers" \
    'BEGIN { h = runs * limit / workers / 3600; printf h < 1 ? "%.0f minutes" : "%.1f hours", h < 1 ? 60 * h + 1 : h }'
}

bench() { # bench <folder> <arguments of mmp bench...>
  local folder=$1 started=$SECONDS
  shift
  "$venv/bin/mmp" bench "$@" --count "$count" --seed 0 --time-limit "$time_limit" --workers "$workers" --out "$folder"
  say "... done, took $((SECONDS - started)) s"
}

# shellcheck disable=SC2119 # no extras
prepare
read_variants
five=$((${#cells[@]} * count * 5))
say "The table: ${cells[*]} x $count instances x 5 planners, $time_limit s each, $workers at a time:"
say "$five runs, at most $(at_most "$five") if none were solved; much less as a rule. Into $out/cells"
bench "$out/cells" "${cells[@]}" --planners "$planners"
say "The settings: ${cells[0]} x $count instances x ${#variants[@]} variants: at most $(at_most $((count * ${#variants[@]})))"
bench "$out/literal" "${cells[0]}" --planners "$labels" "${settings[@]}"
say "The reports"
limit="$time_limit s per run"
"$venv/bin/mmp" report "$out/cells" --title "The paper's five planners, $limit"
"$venv/bin/mmp" report "$out/literal" --title "Paper-literal settings and our design decisions, $limit" --reference apf-ecbs
say "Done: $out/cells/report.html and $out/literal/report.html"
