#!/usr/bin/env bash
# Compares the depth network at 384 x 288 in WebAssembly under node with ONNX Runtime Web (int8) and TensorFlow.js (float, its wasm
# backend): one thread, pinned to one processor, in alternating runs. Prints the median elapsed time of each and ends with "ratio R": our
# time divided by that of the faster peer. Each run of the script compiles ldi; the first run also builds the peers' models and installs
# the peers in the folder PEERS_OUT. With 0 rounds, the script stops after these steps. The script ends with code 75 if the published
# network is missing, or if npm can install no peer.
#
#   bench/peers/tiefenrausch_webassembly.sh [ROUNDS]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
shared="$root/../shared"
rounds=${1:-5}
export PEERS_OUT=${PEERS_OUT:-/tmp/ldi_peers}
# shellcheck source=tests/emulated/header_links.sh
source "$root/tests/emulated/header_links.sh"

fail() {
    printf '%s\n' "$1" >&2
    exit 75
}
[[ -d $shared/peers && -d $shared/tiefenrausch ]] || fail "expected ../shared/peers and ../shared/tiefenrausch (bench/data.md), found none"
# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_weight_files[@]}" "${needs_webassembly[@]}" "command npm;npm" "command taskset;util-linux" >&2

peers=()
packages="$PEERS_OUT/webassembly"
mkdir -p "$packages"
# Adds a peer. Skips it with a message if npm cannot install it, or if its model cannot be built.
add_peer() {
    local name=$1
    shift
    if [[ -d $packages/node_modules/${1%@*} ]] ||
        (cd "$packages" && { [[ -f package.json ]] || npm init -y; } && npm install --silent --ignore-scripts "$@") >/dev/null; then
        peers+=("$name")
    else
        printf 'without %s: npm could not install %s\n' "$name" "$*"
    fi
}
if [[ -f $PEERS_OUT/qlinear_u8s8.onnx ]] || /usr/bin/python3 "$shared/peers/build_models.py" >/dev/null; then
    add_peer onnx_runtime_web onnxruntime-web@1.30.0
else
    printf 'without onnx_runtime_web: its model needs python3-torch, python3-onnx and python3-opencv\n'
fi
add_peer tensorflow_js @tensorflow/tfjs-backend-wasm@4.22.0 @tensorflow/tfjs@4.22.0
[[ ${#peers[@]} -gt 0 ]] || fail "npm could install no peer"

link_headers "$PEERS_OUT/headers"
export NODE_PATH=/usr/share/nodejs:/usr/lib/nodejs # Debian's folders of the modules that Emscripten's scripts import
em++ -std=c++20 -O3 -DNDEBUG -msimd128 -fwasm-exceptions -I"$root/include" -I"$root" -isystem "$PEERS_OUT/headers" \
    -DLDI_SHARED_DIR="\"$shared\"" "$here/webassembly/tiefenrausch.cpp" -sNODERAWFS=1 -sALLOW_MEMORY_GROWTH=1 \
    -o "$PEERS_OUT/tiefenrausch.js"
[[ $rounds -gt 0 ]] || exit 0

processor=$(taskset -cp $$ | sed 's/.*[ ,-]//') # the last one in our affinity mask
pinned() { (cd "$packages" && taskset -c "$processor" node --no-experimental-fetch "$@") | sed -n 's/^median *\([0-9.]*\).*/\1/p'; }
run() {
    case $1 in
        ldi) pinned "$PEERS_OUT/tiefenrausch.js" 9 ;;
        *) pinned "$here/webassembly/peers.mjs" "$1" "$PEERS_OUT" "$shared/tiefenrausch/layers.txt" 3 ;;
    esac
}
median() { sort -g "$1" | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }

times=$(mktemp -d)
trap 'rm -rf "$times"' EXIT
for ((round = 0; round < rounds; ++round)); do
    for name in ldi "${peers[@]}"; do
        run "$name" >>"$times/$name"
    done
done

mine=$(median "$times/ldi")
fastest=
printf '%-32s %9s %8s\n' "384x288, WebAssembly, one thread" "ms" "ratio"
printf '%-32s %9.1f\n' "ldi, int8" "$mine"
for peer in "${peers[@]}"; do
    theirs=$(median "$times/$peer")
    printf '%-32s %9.1f %8.3f\n' "$peer" "$theirs" "$(awk "BEGIN { print $mine / $theirs }")"
    fastest=$(awk "BEGIN { f = \"$fastest\"; print (f == \"\" || $theirs < f + 0) ? $theirs : f }")
done
printf 'ratio %.3f\n' "$(awk "BEGIN { print $mine / $fastest }")"
