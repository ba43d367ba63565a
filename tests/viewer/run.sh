#!/usr/bin/env bash
# The viewer in a real browser: the shipped sample, made by photo3d --html, in a headless Chromium. Installs what is missing.
# Ends with "N passed, N failed".
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_viewer[@]}" "${needs_browser[@]}"
install_npm_packages "$here"
"$top/examples/photo3d/run.sh" sample
node "$here/viewer.mjs"
