#!/usr/bin/env bash
# run.sh [PHOTO [OPTION...]]: makes a 3D photo from PHOTO, or from the sample beside this script. Installs what is missing, builds
# the program, and prints the path of the GLB on the last line. Options go to the program (build/photo3d/examples/photo3d --help).
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
published_model=${LDI_DEPTH_MODEL:-$top/../shared/tiefenrausch/model}
if [ $# = 0 ]; then
    options+=(--depth "$here/sample_depth.png" --fov 56)
elif [[ " ${options[*]} " != *" --depth"* && -d "$published_model" ]]; then
    options+=(--depth-model "$published_model")
fi

require "${needs_build[@]}" "${needs_library[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" >&2
cmake -S "$top" -B "$top/build/photo3d" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF -DLDI_BUILD_EXAMPLES=ON >&2
cmake --build "$top/build/photo3d" --target photo3d >&2

name=$(basename "$photo")
glb=$top/out/${name%.*}.glb
mkdir -p "$top/out"
"$top/build/photo3d/examples/photo3d" "$photo" -o "$glb" "${options[@]}"
printf '%s\n' "$glb"
