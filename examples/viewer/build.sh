#!/usr/bin/env bash
# build.sh: bundles the viewer and three.js into one HTML file, build/viewer/viewer.html, in which photo3d --html embeds photos.
# Installs missing packages. Prints the path of the file.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_viewer[@]}" >&2
install_npm_packages "$here"
node "$here/bundle.mjs" "$top/build/viewer"
