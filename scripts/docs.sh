#!/usr/bin/env bash
# Builds the documentation site into site/, and fails on every warning and broken link. Usage: scripts/docs.sh
# On a fresh machine it first makes .venv in the checkout. Open site/index.html, no server is needed.
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

prepare docs
cd "$root"
export NO_MKDOCS_2_WARNING=1 # pyproject.toml keeps MkDocs 1
"$venv/bin/mkdocs" build --strict "$@"
say "Done: site/index.html"
