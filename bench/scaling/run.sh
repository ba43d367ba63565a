#!/usr/bin/env bash
# Draws the plots of bench/scaling/README.md and prints the numbers that the page states. Needs 8 GB of memory, for 48 megapixels.
#
#   bench/scaling/run.sh [GOOGLE_BENCHMARK_OPTION...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
require "module matplotlib;python3-matplotlib"
bench/run.sh --benchmark_filter=^scaling/ --benchmark_min_time=0.1 --benchmark_repetitions=3 "$@" >&2
/usr/bin/python3 bench/scaling/plot.py build/bench/results.json bench/scaling
