#!/usr/bin/env bash
# Plans with APF-ECBS how eight UR5e arms around a table bring their tools to poses, proves the plan safe, retimes it,
# and executes it in MuJoCo.
# On a fresh machine it first makes .venv in the checkout, builds mmp-env and installs it there.
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

# shellcheck disable=SC2119 # no extras
prepare
say "Planning eight arms to poses of their tools with apf-ecbs, and executing the plan in MuJoCo"
"$venv/bin/mmp" plan MultiArmCell-8 --planner apf-ecbs --seed 7 --execute --out "$root/plan.json" \
  --start "@$root/scripts/demo/start.json" --goal "@$root/scripts/demo/goal.json"
say "Checking the saved plan again"
"$venv/bin/mmp" check "$root/plan.json"
say "Done. More: ${venv}/bin/mmp --help"
