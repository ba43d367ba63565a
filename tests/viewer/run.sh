#!/usr/bin/env bash
# run.sh [--photographs [PICTURES]]: tests the viewer in headless Chromium on pages that photo3d --html wrote for the shipped sample and
# three photographs of ../shared/photos. Tests the element <photo-3d> in other pages, in Chromium and Firefox. With --photographs, runs no tests.
# Instead, counts all gaps in the 40 photographs of bench/quality/run.sh --only holes, and writes the view with the most gaps in each of
# them to the folder PICTURES. Installs missing packages. Ends with "N passed, N failed".
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_viewer[@]}" "${needs_browser[@]}" "${needs_web_browsers[@]}"
install_npm_packages "$here"
"$top/examples/photo3d/run.sh" sample

photographs=$top/../shared/photos/eval
more_photographs=$top/../shared/photos/train  # every 80th
gaps=$top/out/gaps
rm -rf "$gaps" && mkdir -p "$gaps"
# make_pages PHOTO...: converts each photograph to a page in $gaps.
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
    LC_ALL=C  # the order of bench/quality
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
# This page has a cropped frame, as in the paper: surfaces end at the photo's border.
"$top/build/photo3d/examples/photo3d" "$top/examples/photo3d/sample.jpg" --depth "$top/examples/photo3d/sample_depth.png" --fov 56 --frame crop \
    --quiet -o "$top/out/sample_cropped.glb" --html "$top/out/sample_cropped.html"
# Working size is a third of the photo's size; the texture has full size, in several files.
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --size full --geometry-size 320 --html "$top/out/sample_full.html" --usdz "$top/out/sample_full.usdz"
# Input of element.mjs: a small photo for a feed, the output of --embed, and a batch with a failure.
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --size 640 -o "$top/out/feed.glb"
mkdir -p "$top/out/embed"
"$top/build/photo3d/examples/photo3d" "${sample[@]}" --html "$top/out/embed/sample.html" --embed
batch=$top/out/gallery_in
rm -rf "$batch" "$top/out/gallery" && mkdir -p "$batch" "$top/out/gallery"
cp "$top/examples/photo3d/sample.jpg" "$batch/one.jpg"
cp "$top/examples/photo3d/sample.jpg" "$batch/number two & more.jpg"
head -c 2000 "$top/examples/photo3d/sample.jpg" >"$batch/broken.jpg"
"$top/build/photo3d/examples/photo3d" --batch "$batch" -o "$top/out/gallery" --gallery "$top/out/gallery/index.html" --size 512 --quiet >/dev/null || true

# Runs both programs at the same time, because browsers often wait.
rc=0
with_screen node "$here/element.mjs" >"$top/out/element.log" 2>&1 &
element=$!
node "$here/viewer.mjs" | tee "$top/out/viewer.log" || rc=1
wait "$element" || rc=1
cat "$top/out/element.log"
cat "$top/out/viewer.log" "$top/out/element.log" |
    awk '/^[0-9]+ passed, [0-9]+ failed$/ { passed += $1; failed += $3 } END { printf "%d passed, %d failed\n", passed, failed }'
exit "$rc"
