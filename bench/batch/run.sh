#!/usr/bin/env bash
# photo3d --batch over photographs: its rate beside a loop of the shell, its memory beside the bound, its bytes beside those of one by
# one, and ten kills at random times after each of which it goes on. Ends with "N passed, N failed".
#
#   bench/batch/run.sh [NUMBER_OF_PHOTOS [FOLDER]]     1000 of ../shared/photos/train, else copies of the sample
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=bench/support/photos.sh
source bench/support/photos.sh

photos=$(photos_for "${1:-1000}" "${2:-}")
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "command python3;python3" >&2
if [ -z "${PHOTO3D:-}" ]; then # a program that is built already
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >&2
    cmake --build --preset release --target photo3d >&2
    PHOTO3D=build/release/examples/photo3d
fi
python3 bench/batch/batch.py "$PHOTO3D" "$photos" "${1:-1000}"
