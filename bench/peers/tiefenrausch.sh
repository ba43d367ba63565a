#!/usr/bin/env bash
# Compares the depth network at 384 x 288 in ldi, ONNX Runtime (int8, npm) and torch's oneDNN (int8, Debian's python3-torch): one thread,
# pinned to one processor, in alternating runs. Prints each median of elapsed times and ends with "ratio R": our time over that of the
# fastest peer. The first run builds the peers' models and installs onnxruntime-node in the folder PEERS_OUT.
#
# Needs the published network and the peers' models in ../shared; skipped without them.
#
#   bench/peers/tiefenrausch.sh [ROUNDS]          LDI_ISA forces an instruction set
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
peers="$root/../shared/peers"
rounds=${1:-7}
export PEERS_OUT=${PEERS_OUT:-/tmp/ldi_peers}
python=/usr/bin/python3

skip() {
    printf 'skipped: %s\n' "$1"
    exit 0
}
[[ -d $peers && -d $peers/../tiefenrausch ]] || skip "there is no ../shared with the published network"
# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_weight_files[@]}" "${needs_peers[@]}" >&2

mkdir -p "$PEERS_OUT"
[[ -f $PEERS_OUT/qlinear_u8s8.onnx ]] || "$python" "$peers/build_models.py" >/dev/null
cp "$peers/node_bench.mjs" "$PEERS_OUT/"
if [[ ! -d $PEERS_OUT/node_modules/onnxruntime-node ]]; then
    (cd "$PEERS_OUT" && npm init -y >/dev/null && npm install --silent --ignore-scripts onnxruntime-node@1.30.0 >/dev/null) ||
        skip "onnxruntime-node could not be installed"
fi
"${CXX:-g++}" -std=c++20 -O2 -DNDEBUG -I"$root/include" -I"$root" -DLDI_SHARED_DIR="\"$root/../shared\"" -DLDI_SOURCE_DIR="\"$root\"" \
    "$root/bench/peers/tiefenrausch.cpp" -lbenchmark_main -lbenchmark -lpthread -o "$PEERS_OUT/ours"

processor=$(taskset -cp $$ | sed 's/.*[ ,-]//')  # the last one in our affinity mask
pinned() { taskset -c "$processor" "$@"; }
measure_ours() {  # THREADS [COMMAND...]; COMMAND runs the benchmark
    "${@:2}" "$PEERS_OUT/ours" --benchmark_filter="network 384x288/threads:$1/" --benchmark_min_time=0 \
        --benchmark_repetitions=15 --benchmark_report_aggregates_only=true --benchmark_format=csv 2>/dev/null |
        awk -F, '/_median/ { print $3, $8 }'  # milliseconds and the label, which names the instruction set
}
ours() { measure_ours 1 pinned; }
onnx_runtime() { (cd "$PEERS_OUT" && pinned node node_bench.mjs 1 9 columns qlinear_u8s8) | sed -n 's/.* med *\([0-9.]*\).*/\1/p'; }
one_dnn() {
    MALLOC_MMAP_THRESHOLD_=8000000000 MALLOC_TRIM_THRESHOLD_=16000000000 MALLOC_TOP_PAD_=67108864 \
        pinned "$python" "$peers/torch_bench.py" 1 9 columns onednn 2>/dev/null | sed -n 's/.* med *\([0-9.]*\).*/\1/p'
}
median() { sort -g "$1" | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }

times=$(mktemp -d)
trap 'rm -rf "$times"' EXIT
for ((round = 0; round < rounds; ++round)); do
    ours >>"$times/ours"
    measure_ours 2 env >>"$times/two_threads"
    onnx_runtime >>"$times/onnx_runtime"
    one_dnn >>"$times/one_dnn"
done

mine=$(median "$times/ours")
fastest=
printf '%-32s %9s %8s\n' "384x288, int8, one thread" "ms" "ratio"
printf '%-32s %9.2f\n' "ldi, $(awk 'END { gsub(/"/, "", $2); print $2 }' "$times/ours")" "$mine"
for peer in onnx_runtime one_dnn; do
    theirs=$(median "$times/$peer")
    printf '%-32s %9.2f %8.3f\n' "$peer" "$theirs" "$(awk "BEGIN { print $mine / $theirs }")"
    fastest=$(awk "BEGIN { f = \"$fastest\"; print (f == \"\" || $theirs < f + 0) ? $theirs : f }")
done
two=$(median "$times/two_threads")
printf '%-32s %9.2f %8.3f\n' "ldi, two threads" "${two%% *}" "$(awk "BEGIN { print ${mine%% *} / ${two%% *} }")"
printf 'ratio %.3f\n' "$(awk "BEGIN { print $mine / $fastest }")"
