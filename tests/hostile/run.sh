#!/usr/bin/env bash
# Runs the optimized program on malicious files, which the scripts in ../shared/hostile create. Every run must end with exit code 0, 1, 2
# or 75, within 10 s of processor time and 1 GB, and leave no file behind. Ends with "N passed, N failed".
#
#   PROGRAM=build/photo3d/examples/photo3d tests/hostile/run.sh [PATTERN...]
#
# Builds the program unless PROGRAM is set. Patterns, such as 'heic_*', select files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

makers=../shared/hostile
if [ ! -f "$makers/bombs.py" ]; then
    echo "skipped: $makers, which creates the files, is absent"
    echo "0 passed, 0 failed"
    exit 0
fi
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_hostile[@]}"
if [ -z "${PROGRAM:-}" ]; then
    cmake --preset release -B build/photo3d -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >/dev/null
    cmake --build build/photo3d --target photo3d
    PROGRAM=build/photo3d/examples/photo3d
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export BOMBS=$work/files SAMPLE=examples/photo3d/sample.jpg
mkdir "$BOMBS"
for maker in bombs heif scan; do
    /usr/bin/python3 "$makers/$maker.py" >"$work/$maker.log" || {
        echo "$maker.py failed:" >&2
        tail -n 5 "$work/$maker.log" >&2
        echo "0 passed, 1 failed"
        exit 1
    }
done
/usr/bin/python3 tests/hostile/hostile.py "$PROGRAM" "$BOMBS" "$makers/small.jpg" "$@"
