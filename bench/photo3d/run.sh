#!/usr/bin/env bash
# Times every stage of photo3d, with one thread and with two, on the sample and on six photographs of ../shared if present. Prints the
# paper's times beside them. Ends with the sample's results: "whole photo D ms at D % hidden, one thread; two threads D; peak D MB".
#
#   bench/photo3d/run.sh [RUNS]     default: medians of 5 runs
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "command python3;python3" >&2
if [ -z "${PHOTO3D:-}" ]; then # PHOTO3D: path of a built program
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >&2
    cmake --build --preset release --target photo3d >&2
    PHOTO3D=build/release/examples/photo3d
fi
python3 bench/photo3d/stages.py --runs "${1:-5}" "$PHOTO3D"
