#!/usr/bin/env bash
# Compares the depth network at 384 x 288 in ldi, ONNX Runtime (int8, npm) and torch's oneDNN (int8, Debian's python3-torch): one thread,
# pinned to one processor, in alternating runs. All compute the published network if ../shared/tiefenrausch/model exists, else the network
# that ldi ships. Prints the median elapsed time of each and ends with "ratio R": our time divided by that of the fastest peer. The first
# run installs onnxruntime-node in the folder PEERS_OUT; if npm cannot install it, the script ends with code 75.
#
#   bench/peers/tiefenrausch.sh [ROUNDS]          LDI_ISA forces an instruction set
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
published=$root/../shared/tiefenrausch/model
rounds=${1:-7}
export PEERS_OUT=${PEERS_OUT:-/tmp/ldi_peers}
python=/usr/bin/python3

# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_weight_files[@]}" "${needs_peers[@]}" "header stb/stb_image.h;libstb-dev" "header zlib.h;zlib1g-dev" "header nlohmann/json.hpp;nlohmann-json3-dev" >&2

mkdir -p "$PEERS_OUT"
cp "$here/quantized_network.mjs" "$PEERS_OUT/"
if [[ ! -d $PEERS_OUT/node_modules/onnxruntime-node ]]; then
    (cd "$PEERS_OUT" && npm init -y >/dev/null && npm install --silent --ignore-scripts onnxruntime-node@1.30.0 >/dev/null) || {
        printf 'npm could not install onnxruntime-node, with which this script compares\n' >&2
        exit 75
    }
fi
network=tiefenrausch_small weights=$root/examples/models/tiefenrausch_small.safetensors
if [[ -d $published ]]; then
    network=tiefenrausch weights=$PEERS_OUT/published.safetensors
    "${CXX:-g++}" -std=c++20 -O1 -I"$root/include" "$root/examples/training/tiefenrausch_small/convert.cpp" -o "$PEERS_OUT/convert"
    "$PEERS_OUT/convert" "$published" "$weights" >&2
fi
"$python" "$here/quantized_network.py" model "$PEERS_OUT" "$weights"
"${CXX:-g++}" -std=c++20 -O2 -DNDEBUG -I"$root/include" -I"$root" -DLDI_SHARED_DIR="\"$root/../shared\"" -DLDI_SOURCE_DIR="\"$root\"" \
    "$root/bench/peers/tiefenrausch.cpp" -lbenchmark_main -lbenchmark -lpthread -lz -o "$PEERS_OUT/ours"

processor=$(taskset -cp $$ | sed 's/.*[ ,-]//')  # the last one in our affinity mask
pinned() { taskset -c "$processor" "$@"; }
measure_ours() {  # THREADS [COMMAND...]; COMMAND runs the benchmark
    "${@:2}" "$PEERS_OUT/ours" --benchmark_filter="^$network/network 384x288/threads:$1/" --benchmark_min_time=0 \
        --benchmark_repetitions=15 --benchmark_report_aggregates_only=true --benchmark_format=csv 2>/dev/null |
        awk -F, '/_median/ { print $3, $8 }'  # milliseconds and the label, which names the instruction set
}
ours() { measure_ours 1 pinned; }
onnx_runtime() { (cd "$PEERS_OUT" && pinned node quantized_network.mjs); }
one_dnn() {
    MALLOC_MMAP_THRESHOLD_=8000000000 MALLOC_TRIM_THRESHOLD_=16000000000 MALLOC_TOP_PAD_=67108864 \
        pinned "$python" "$here/quantized_network.py" time "$PEERS_OUT" "$weights"
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
printf '%-32s %9s %8s\n' "$network, 384x288, one thread" "ms" "ratio"
printf '%-32s %9.2f\n' "ldi, $(awk 'END { gsub(/"/, "", $2); print $2 }' "$times/ours")" "$mine"
for peer in onnx_runtime one_dnn; do
    theirs=$(median "$times/$peer")
    printf '%-32s %9.2f %8.3f\n' "$peer" "$theirs" "$(awk "BEGIN { print $mine / $theirs }")"
    fastest=$(awk "BEGIN { f = \"$fastest\"; print (f == \"\" || $theirs < f + 0) ? $theirs : f }")
done
two=$(median "$times/two_threads")
printf '%-32s %9.2f %8.3f\n' "ldi, two threads" "${two%% *}" "$(awk "BEGIN { print ${mine%% *} / ${two%% *} }")"
printf 'ratio %.3f\n' "$(awk "BEGIN { print $mine / $fastest }")"
