#!/usr/bin/env bash
# Makes docs/images/gallery/imported.webp: arms of the robosuite wheel, imported and drawn by their convex pieces.
# It downloads the wheel (157 MB) into a temporary folder. The repository keeps the picture and no model.
#
#   bash scripts/make_imported_picture.sh
#
# WHEELS names a folder that holds robosuite-1.5.2-py3-none-any.whl already.
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare robots
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
wheels=${WHEELS:-$work}
wheel=$wheels/robosuite-1.5.2-py3-none-any.whl
[[ -e $wheel ]] || "$venv/bin/python" -m pip download --quiet --no-deps robosuite==1.5.2 -d "$wheels"
"$venv/bin/python" -m zipfile -e "$wheel" "$work/wheel"
export XDG_DATA_HOME=$work/data
for robot in iiwa kinova3; do
  "$venv/bin/mmp" robot add "$work/wheel/robosuite/models/assets/robots/$robot/robot.xml" --name "$robot"
done
"$venv/bin/python" "$root/scripts/make_gallery.py" imported
