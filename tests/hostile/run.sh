#!/usr/bin/env bash
# Runs the optimized program on malicious files. costly_files.py and, if present, the scripts in ../shared/hostile create these files. Every
# run must end with exit code 0, 1 or 2, within 10 s of processor time and 1 GB, and leave no file behind. Ends with "N passed, N failed".
#
#   PROGRAM=build/photo3d/examples/photo3d tests/hostile/run.sh [PATTERN...]
#
# Builds the program unless PROGRAM is set. Patterns, such as 'heic_*', select files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

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
makers=(tests/hostile/costly_files.py)
if [ -f ../shared/hostile/bombs.py ]; then
    makers+=(../shared/hostile/{bombs,heif,scan}.py)
else
    echo "skipped: the files of ../shared/hostile, which is absent"
    others=skipped
fi
for maker in "${makers[@]}"; do
    /usr/bin/python3 "$maker" "$BOMBS" "$work/sound.jpg" >"$work/log" || {
        echo "$maker failed:" >&2
        tail -n 5 "$work/log" >&2
        echo "0 passed, 1 failed"
        exit 1
    }
done
/usr/bin/python3 tests/hostile/hostile.py "$PROGRAM" "$BOMBS" "$work/sound.jpg" "$@" | sed "s/^[0-9]* passed, /${others:+1 tests were skipped\n\n}&/"
