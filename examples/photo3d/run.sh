#!/usr/bin/env bash
# run.sh [PHOTO [OPTION...]]: makes a 3D photo from PHOTO, or from the sample beside this script: a page to open in a browser, and a
# GLB. Installs what is missing, builds the program and the viewer, and prints the paths of the page and of the GLB on the last two
# lines. Options go to the program (build/photo3d/examples/photo3d --help).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

photo=${1:-$here/sample.jpg}
if [ ! -f "$photo" ]; then
    printf 'There is no file %s\n' "$photo" >&2
    exit 1
fi
options=("${@:2}")
if [ $# = 0 ]; then
    options+=(--depth "$here/sample_depth.png" --fov 56)
fi

require "${needs_build[@]}" "${needs_library[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" >&2
cmake -S "$top" -B "$top/build/photo3d" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF -DLDI_BUILD_EXAMPLES=ON >&2
cmake --build "$top/build/photo3d" --target photo3d >&2

name=$(basename "$photo")
made=$top/out/${name%.*}
mkdir -p "$top/out"
page=()
if "$top/examples/viewer/build.sh" >&2; then
    page=(--html "$made.html")
else
    printf 'The viewer could not be built: making the GLB alone.\n' >&2
fi
"$top/build/photo3d/examples/photo3d" "$photo" -o "$made.glb" "${page[@]}" "${options[@]}"
printf '%s\n' "${page[@]:1}" "$made.glb"
