#!/usr/bin/env bash
# Builds the program photo3d of another revision and of this working tree, runs both in turns on the photos of
# bench/photo3d/run.sh, and prints the ratios of all stages: this tree's processor time divided by the other's. Ends with
# "this tree takes D of REVISION; single pairs of runs: D to D"; the first number is the geometric mean of the photos' ratios.
#
#   bench/compare.sh REVISION [RUNS]     default: medians of 5 runs
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

revision=${1:?the revision to compare with}
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "command python3;python3" "command git;git" \
    "header libexif/exif-data.h;libexif-dev" >&2  # revisions before 2026-11-25 need libexif
commit=$(git rev-parse --verify "$revision^{commit}")
other=$PWD/build/compare/$commit
if [ ! -e "$other/.git" ]; then
    git worktree prune
    git worktree add --detach "$other" "$commit" >&2
fi
for tree in "$other" "$PWD"; do
    cmake -S "$tree" -B "$tree/build/release" -G Ninja -DCMAKE_CXX_COMPILER=g++ -DCMAKE_BUILD_TYPE=Release -DLDI_BUILD_TESTS=OFF \
        -DLDI_BUILD_BENCH=OFF >&2
    cmake --build "$tree/build/release" --target photo3d >&2
done
python3 bench/photo3d/stages.py --runs "${2:-5}" --beside "$other/build/release/examples/photo3d" --name "$revision" \
    build/release/examples/photo3d
