#!/usr/bin/env bash
# Repeats the paper's measurements with paper_options(), and prints them beside the paper's figures, as Markdown. Writes pictures
# to build/paper.
#
#   bench/paper/run.sh [--only stages|ablations|networks] [--runs N] [--photos N]
#
# --runs    number of runs per photo; default 5. The tables contain the median of each stage
# --photos  number of photos for --only ablations; default: the sample and six others
#
# Reads the photos, the published depth network and the pairs with depth from ../shared. The sample replaces missing photos. If other
# data is missing, the script skips the part that needs it and says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_bench[@]}" >&2
cmake --preset release >&2
cmake --build build/release --target ldi_paper >&2
build/release/bench/ldi_paper --pictures build/paper "$@"
