#!/usr/bin/env bash
# Repeats the paper's measurements with paper_options(), and prints them beside the paper's figures, as Markdown. Writes pictures
# to build/paper.
#
#   bench/paper/run.sh [--only stages|ablations|networks] [--runs N] [--photos N]
#
# --runs    runs per photo, of whose stages the median counts; 5 where absent
# --photos  number of photos for --only ablations; the sample and six others where absent
#
# Photos, the published depth network and pairs with depth are those of ../shared; what is absent is skipped or replaced by the
# sample, and the output says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_bench[@]}" >&2
cmake --preset release >&2
cmake --build build/release --target ldi_paper >&2
build/release/bench/ldi_paper --pictures build/paper "$@"
