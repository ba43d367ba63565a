#!/usr/bin/env bash
# Compares float convolutions, 3 x 3, 32 -> 32 and 16 -> 16. Ours run on the layered depth image of the sample at 1152 x 1536 after
# expansion. The peers, torch's oneDNN (Debian's python3-torch, channels last) and ONNX Runtime (npm), run on an image with about as many
# pixels. The timing excludes our plan, which all layers on one graph share. It also excludes the allocation of the result for ldi and
# oneDNN, but not for ONNX Runtime, which allocates its result in each run. Alternates runs of ldi and the peers, on one thread that is
# pinned to one processor. Measures processor time, because other programs may run. Prints medians and ends with "ratio R": our time
# divided by that of the fastest peer, for the worse of the two shapes. The first run installs
# onnxruntime-node in the folder PEERS_OUT; if npm cannot install it, the script ends with code 75.
#
#   bench/peers/ldi_conv.sh [ROUNDS]              LDI_ISA forces an instruction set
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
rounds=${1:-5}
export PEERS_OUT=${PEERS_OUT:-/tmp/ldi_peers}
python=/usr/bin/python3
ours=$PEERS_OUT/ldi_conv

fail() {
    printf '%s\n' "$1" >&2
    exit 75
}
# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_io[@]}" "${needs_peers[@]}" >&2

mkdir -p "$PEERS_OUT"
if [[ ! -d $PEERS_OUT/node_modules/onnxruntime-node ]]; then
    (cd "$PEERS_OUT" && npm init -y >/dev/null && npm install --silent --ignore-scripts onnxruntime-node@1.30.0 >/dev/null) ||
        fail "npm could not install onnxruntime-node, with which this script compares"
fi
if [[ ! -f $ours || -n $(find "$root/include" "$root/bench" -newer "$ours" -name '*.[ch]pp' -print -quit) ]]; then
    "${CXX:-g++}" -std=c++20 -O2 -DNDEBUG -I"$root/include" -I"$root" -I/usr/include/stb -DLDI_SOURCE_DIR="\"$root\"" \
        -DLDI_SHARED_DIR="\"$root/../shared\"" "$root"/bench/nn/operators.cpp "$root"/bench/support/*.cpp -o "$ours" -lbenchmark \
        -lpthread -lpng -lz
fi

processor=$(taskset -cp $$ | sed 's/.*[ ,-]//')  # the last one in our affinity mask
pinned() { taskset -c "$processor" "$@"; }
times=$(mktemp -d)
trap 'rm -rf "$times"' EXIT

width=1152
pixels=$("$ours" --benchmark_filter='nn/plan_convolution/ldi 3x3$' --benchmark_min_time=0 --benchmark_format=json 2>/dev/null |
    "$python" -c 'import json, sys; print(int(json.load(sys.stdin)["benchmarks"][0]["pixels"]))')
height=$((pixels / width))
"$python" "$here/dense_convolution.py" models "$PEERS_OUT" "$width" "$height" 32 16
cp "$here/dense_convolution.mjs" "$PEERS_OUT/"

ldi() {
    pinned "$ours" --benchmark_filter='^nn/convolve/ldi 3x3 .*, float32$' --benchmark_min_time=0 --benchmark_repetitions=5 \
        --benchmark_report_aggregates_only=true --benchmark_format=csv 2>/dev/null |
        sed -n 's/^"nn\/convolve\/ldi 3x3 \([0-9]*\)->.*_median",[^,]*,[^,]*,\([^,]*\),.*/\1 \2/p' | awk '{ print $1, $2 / 1000 }'
}
one_dnn() {  # malloc keeps freed memory, so that oneDNN spends no time on new pages
    MALLOC_MMAP_THRESHOLD_=8000000000 MALLOC_TRIM_THRESHOLD_=16000000000 MALLOC_TOP_PAD_=67108864 \
        pinned "$python" "$here/dense_convolution.py" time "$width" "$height" 32 16
}
onnx_runtime() { (cd "$PEERS_OUT" && pinned node dense_convolution.mjs "$width" "$height" 32 16); }
for ((round = 0; round < rounds; ++round)); do
    for one in ldi one_dnn onnx_runtime; do
        $one >>"$times/$one"
    done
done

median() { awk -v c="$2" '$1 == c { print $2 }' "$times/$1" | sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
printf '%d pixels on the layered depth image, %d x %d on the image, one thread\n' "$pixels" "$width" "$height"
printf '%-12s %10s %10s %14s %8s\n' "3x3" "ldi, ms" "one_dnn" "onnx_runtime" "ratio"
worst=0
for channels in 32 16; do
    mine=$(median ldi "$channels") a=$(median one_dnn "$channels") b=$(median onnx_runtime "$channels")
    ratio=$(awk "BEGIN { print $mine / ($a < $b ? $a : $b) }")
    printf '%-12s %10.1f %10.1f %14.1f %8.3f\n' "$channels->$channels" "$mine" "$a" "$b" "$ratio"
    worst=$(awk "BEGIN { print ($ratio > $worst ? $ratio : $worst) }")
done
printf 'ratio %.3f\n' "$worst"
