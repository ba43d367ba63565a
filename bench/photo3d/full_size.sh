#!/usr/bin/env bash
# Measures photo3d --size full on one photograph at 12, 24 and 48 megapixels, 5 runs each: maximum of the peak memory, bytes per pixel,
# and median seconds for reading, encoding and the rest. Validates the 48-megapixel photo's GLB file. Ends with "N passed, N failed".
#
#   bench/photo3d/full_size.sh [PHOTO]     default: one of ../shared/depth_companions, or the sample
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

photo=${1:-../shared/depth_companions/iphone_mpo_a.jpg}
if [ -z "${1:-}" ] && [ ! -e "$photo" ]; then
    photo=examples/photo3d/sample.jpg
fi
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_validator[@]}" "command python3;python3" "command ffmpeg;ffmpeg" >&2
if [ -z "${PHOTO3D:-}" ]; then # PHOTO3D: path of a built program
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >&2
    cmake --build --preset release --target photo3d >&2
    PHOTO3D=build/release/examples/photo3d
fi
python3 bench/photo3d/full_size.py "$PHOTO3D" "$photo"
