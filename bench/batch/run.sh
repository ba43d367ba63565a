#!/usr/bin/env bash
# Measures photo3d --batch on photographs: its rate compared to a shell loop, and its peak memory compared to the limit. Checks that its
# results equal those of single runs, and that it resumes after each of ten kills at random times. Ends with "N passed, N failed".
#
#   bench/batch/run.sh [NUMBER_OF_PHOTOS [FOLDER]]     1000 photos of ../shared/photos/train; without them, copies of the sample
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=bench/support/photos.sh
source bench/support/photos.sh

photos=$(photos_for "${1:-1000}" "${2:-}")
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "command python3;python3" >&2
if [ -z "${PHOTO3D:-}" ]; then # PHOTO3D: path of a built program
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >&2
    cmake --build --preset release --target photo3d >&2
    PHOTO3D=build/release/examples/photo3d
fi
python3 bench/batch/batch.py "$PHOTO3D" "$photos" "${1:-1000}"
