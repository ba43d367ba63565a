#!/usr/bin/env bash
# Plots photo3d's time and memory per pixel over the size of the photo and over the share of hidden pixels. Writes
# bench/photo3d/size.png and bench/photo3d/hidden.png, and prints their points as tables.
#
#   bench/photo3d/plots.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "command python3;python3" "module matplotlib;python3-matplotlib" >&2
if [ -z "${PHOTO3D:-}" ]; then # PHOTO3D: path of a built program
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >&2
    cmake --build --preset release --target photo3d >&2
    PHOTO3D=build/release/examples/photo3d
fi
/usr/bin/python3 bench/photo3d/plots.py "$PHOTO3D" bench/photo3d
