#!/usr/bin/env bash
# Imports four arms of the robosuite wheel, checks them, and plans, executes and checks rings of four of each.
# It downloads the wheel (157 MB) into a temporary folder and is no test: tests download nothing.
#
#   bash scripts/try_robots.sh [COUNT]      instances of each robot; default: 50
#
# WHEELS names a folder that holds robosuite-1.5.2-py3-none-any.whl already.
set -euo pipefail
count=${1:-50}
python=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
wheels=${WHEELS:-$work}
[[ -e $wheels/robosuite-1.5.2-py3-none-any.whl ]] || "$python" -m pip download --quiet --no-deps robosuite==1.5.2 -d "$wheels"
"$python" -m zipfile -e "$wheels/robosuite-1.5.2-py3-none-any.whl" "$work/wheel"
export XDG_DATA_HOME=$work/data XDG_CACHE_HOME=$work/cache
mmp() { "$python" -c 'from mmp_cli.main import main; raise SystemExit(main())' "$@"; }

failed=0
for robot in iiwa kinova3 panda ur5e; do
  name=rs-$robot
  began=$SECONDS
  mmp robot add "$work/wheel/robosuite/models/assets/robots/$robot/robot.xml" --name "$name" >"$work/$name.txt"
  echo "$name: imported in $((SECONDS - began)) s"
  mmp robot check "$name" || failed=1
  solved=0
  for ((seed = 0; seed < count; seed++)); do
    if mmp plan MultiArmCell-4 --robot "$name" --seed "$seed" --time-limit 10 --execute --out "$work/plan.json" \
      >"$work/plan.txt" 2>&1 && mmp check "$work/plan.json" >/dev/null; then
      solved=$((solved + 1))
    else
      echo "$name: seed $seed failed: $(grep -E '^(status|execution|check|mmp)' "$work/plan.txt" | head -n 3 | tr '\n' ';')"
      failed=1
    fi
  done
  echo "$name: $solved of $count instances planned, executed without contact and checked"
done
exit $failed
