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
sample=("$top/examples/photo3d/sample.jpg" --depth "$top/examples/photo3d/sample_depth.png" --fov 56 --compress --quiet)
"$top/build/photo3d/examples/photo3d" "${sample[@]}" -o "$top/out/sample_compressed.glb" --compressed-texture jpeg
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --html "$top/out/sample_compressed.html" --usdz "$top/out/sample.usdz"
# Worked on at a third of its size and shown at its own: several textures.
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --size full --geometry-size 320 --html "$top/out/sample_full.html" --usdz "$top/out/sample_full.usdz"
node "$here/viewer.mjs"
