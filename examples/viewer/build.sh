#!/usr/bin/env bash
# build.sh: bundles the viewer and three.js into one HTML file, build/viewer/viewer.html, into which photo3d --html embeds photos. Also
# builds gallery.html, for photo3d --gallery, and photo-3d/, the npm package. Installs missing packages. Prints the paths of the files,
# viewer.html last.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_viewer[@]}" >&2
install_npm_packages "$here"
node "$here/bundle.mjs" "$top/build/viewer"
