"""`scripts/wheel.sh`: it ends with an error if the first plan comes too late. Stubs build, install and plan."""

import json
import os
import shutil
import subprocess

import pytest
from support import checkout_scripts

ENVIRONMENT = r"""
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
log=$root/build/log
say() { printf '%s\n' "$*" >&2; }
die() {
  say "$*"
  exit 1
}
quietly() { if [[ $1 == Installing* ]]; then SECONDS=$((SECONDS + TAKES_S)); fi; }
find_tools() { python=python3; }
open_venv() {
  mkdir -p "$venv/bin"
  cp "$root/python" "$venv/bin/python"
  install=(false)
}
for name in lend_pip_settings_to_uv requirements use_ccache ccache install_build_tools tar; do
  eval "$name() { :; }"
done
"""
PYTHON = r"""#!/bin/sh
case "$2" in
  *print_figure*) echo "{\"name\": \"wheel_$3\", \"value\": $4}" ;;
  *) echo mmp_env-0-cp312-abi3-any.whl ;;
esac
"""


@pytest.mark.parametrize(
    ("cache", "takes_s", "code"), [("warm", 80, 0), ("warm", 100, 1), ("cold", 140, 0), ("cold", 160, 1)]
)
def test_a_first_plan_that_comes_too_late_is_an_error(tmp_path, cache, takes_s, code):
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "environment.sh").write_text(ENVIRONMENT)
    (tmp_path / "python").write_text(PYTHON)
    (tmp_path / "python").chmod(0o755)
    script = shutil.copy(checkout_scripts.SCRIPTS / "wheel.sh", tmp_path / "scripts")
    words, environment = ["bash", script, f"--{cache}"], os.environ | {"TAKES_S": str(takes_s)}
    done = subprocess.run(words, check=False, capture_output=True, text=True, env=environment)
    assert done.returncode == code, done.stderr
    figure = json.loads(done.stdout)
    assert figure["name"] == f"wheel_{cache}"
    assert takes_s <= figure["value"] < takes_s + 9
    assert (f"allowed: {150 if cache == 'cold' else 90} s" in done.stderr) == bool(code)
