#!/usr/bin/env bash
# Makes the pictures in docs/images/gallery, which the README and the pages show.
# It takes some minutes without a graphics card. On a fresh machine it first makes .venv in the checkout.
# Usage: scripts/make_gallery.sh [NAME...]   names: search trees cells paths fast-track branches curves many-arms demonstrations work online; without, all of them
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"

# shellcheck disable=SC2119 # no extras
prepare
exec "$venv/bin/python" "$root/scripts/make_gallery.py" "$@"
