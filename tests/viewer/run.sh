#!/usr/bin/env bash
# run.sh [--photographs [PICTURES]]: the viewer in a real browser: the shipped sample and three photographs of ../shared/photos, made by
# photo3d --html, in a headless Chromium. With --photographs, in place of the tests, all gaps of the 40 photographs of
# bench/quality/run.sh --only holes are counted, and what is seen at the worst place of each is written to the folder PICTURES.
# Installs what is missing. Ends with "N passed, N failed".
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_viewer[@]}" "${needs_browser[@]}"
install_npm_packages "$here"
"$top/examples/photo3d/run.sh" sample

photographs=$top/../shared/photos/eval
more_photographs=$top/../shared/photos/train  # every 80th
gaps=$top/out/gaps
rm -rf "$gaps" && mkdir -p "$gaps"
# Makes a page of each photograph.
make_pages() {
    local photo
    for photo; do
        "$top/build/photo3d/examples/photo3d" "$photo" --html "$gaps/$(basename "${photo%.*}").html" --quiet
    done
}
if [ "${1:-}" = --photographs ]; then
    if [ ! -d "$photographs" ]; then
        printf 'skipped: %s is absent\n' "$photographs"
        exit 0
    fi
    make_pages "$photographs"/*.png
    LC_ALL=C  # sorts as bench/quality does
    more=("$more_photographs"/*)
    for ((i = 0; i < ${#more[@]}; i += 80)); do
        [ ! -f "${more[i]}" ] || make_pages "${more[i]}"
    done
    node "$here/photographs.mjs" "$gaps" "${@:2}"
    exit
fi
[ ! -d "$photographs" ] || make_pages "$photographs"/kodim{01,03,05}.png
sample=("$top/examples/photo3d/sample.jpg" --depth "$top/examples/photo3d/sample_depth.png" --fov 56 --compress --quiet)
"$top/build/photo3d/examples/photo3d" "${sample[@]}" -o "$top/out/sample_compressed.glb" --compressed-texture jpeg
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --html "$top/out/sample_compressed.html" --usdz "$top/out/sample.usdz"
# In the paper's frame, with surfaces that end at the photo's border.
"$top/build/photo3d/examples/photo3d" "$top/examples/photo3d/sample.jpg" --depth "$top/examples/photo3d/sample_depth.png" --fov 56 --frame crop \
    --quiet -o "$top/out/sample_cropped.glb" --html "$top/out/sample_cropped.html"
# Worked on at a third of its size and shown at its own: several textures.
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --size full --geometry-size 320 --html "$top/out/sample_full.html" --usdz "$top/out/sample_full.usdz"
node "$here/viewer.mjs"
