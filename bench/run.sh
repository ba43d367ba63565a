#!/usr/bin/env bash
# Runs the benchmarks of all kernels, operators and stages, on the shipped sample and weights. Writes results.json and the table results.md
# to build/bench. Times are processor time, one thread.
#
#   bench/run.sh [--quick] [--before FILE.json] [--readme] [GOOGLE_BENCHMARK_OPTION...]
#
# --quick   one short run of each benchmark, without scaling laws and steps of networks: less than 3 minutes
# --before  compares with the results of an earlier run, using Google Benchmark's compare.py (Debian's libbenchmark-tools)
# --readme  also writes the table into bench/README.md, and all rows into bench/notes/table.md
#
# Other options go to ldi_bench, such as --benchmark_filter=^nn/ and --benchmark_repetitions=9. Without --quick, each benchmark runs
# 3 times for at least 0.2 s.
set -euo pipefail
caller=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

# The checked-out revision, with a plus sign if headers or benchmarks differ from it.
revision() {
    printf '%s%s' "$(git rev-parse --short=10 HEAD)" "$(git status --porcelain -- include 'bench/*.[ch]pp' | sed -n '1s/.*/+/p')"
}

quick=0 readme=0 before="" options=()
while [ $# -gt 0 ]; do
    case $1 in
        --quick) quick=1 ;;
        --readme) readme=1 ;;
        --before)
            before=$(cd "$caller" && realpath -e -- "${2:?"--before needs a JSON file of an earlier run"}")
            shift
            ;;
        --benchmark_*) options+=("$1") ;;
        *)
            printf '%s: expected --quick, --before FILE.json, --readme, or an option of Google Benchmark\n' "$1" >&2
            exit 1
            ;;
    esac
    shift
done

if [ "$readme" = 1 ] && { [ "$quick" = 1 ] || [ "${#options[@]}" -gt 0 ]; }; then
    printf -- '--readme: expected no --quick and no --benchmark_ options, because the tables show all benchmarks\n' >&2
    exit 1
fi
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_bench[@]}"
[ -z "$before" ] || require "${needs_bench_comparison[@]}"
cmake --preset release >&2
cmake --build build/release --target ldi_bench >&2

defaults=(--benchmark_filter='-^(scaling|steps)/' --benchmark_min_time=0.02)
[ "$quick" = 1 ] || defaults=(--benchmark_filter='-^scaling/' --benchmark_min_time=0.2 --benchmark_repetitions=3)
results=build/bench/results
mkdir -p build/bench
if [ -n "$before" ]; then # a copy, because the file may be $results.json, which this run replaces
    earlier=$(mktemp --suffix=.json)
    trap 'rm -f "$earlier"' EXIT
    cp "$before" "$earlier"
fi
# ldi_bench reads its options in order: those of the caller, which come last, override the defaults.
build/release/bench/ldi_bench "${defaults[@]}" "${options[@]}" "--benchmark_context=revision=$(revision)" \
    "--benchmark_context=processor=$(python3 bench/table.py --processor)" --benchmark_out=build/bench/new_results.json --benchmark_out_format=json
mv build/bench/new_results.json "$results.json"
python3 bench/table.py "$results.json" >"$results.md"
if [ "$readme" = 1 ]; then
    python3 bench/table.py "$results.json" --readme bench/README.md
    { printf '# All benchmarks\n\nWritten by `bench/run.sh --readme`. [How to read it](../README.md).\n\n'; cat "$results.md"; } >bench/notes/table.md
fi
if [ -n "$before" ]; then
    python3 bench/table.py "$results.json" --same "$earlier"
    compare=$(command -v compare.py || printf '%s' /usr/share/benchmark/compare.py)
    /usr/bin/python3 "$compare" --no-color benchmarks "$earlier" "$results.json"
fi
printf '%s.json and %s.md\n' "$results" "$results"
