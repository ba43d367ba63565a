#!/usr/bin/env bash
# Tests the WebAssembly kernels, and the operators and networks that use them, compiled with Emscripten and run in node. Installs
# missing packages. Ends with "N passed, N failed".
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh
# shellcheck source=tests/emulated/header_links.sh
source tests/emulated/header_links.sh

require "${needs_weight_files[@]}" "${needs_tests[@]}" "${needs_webassembly[@]}"

build=build/webassembly
end_without_catch2
link_headers "$build/headers"
printf '#define CATCH_CONFIG_MAIN\n#include <catch2/catch.hpp>\n' >"$build/main.cpp"
tests=(
    tests/kernels/{isa,requantize,requantize_float,gemm_u8,depthwise_u8,add_u8,conv}.cpp
    tests/nn/dense/quantized_network.cpp tests/nn/ldi/{convolution,feature_map,convolution_layer,pooling,elementwise}.cpp tests/networks/{tiefenrausch,farbrausch}.cpp)
export NODE_PATH=/usr/share/nodejs:/usr/lib/nodejs  # Debian's folders of the modules that Emscripten's scripts import

# -fexceptions, because with threads and -fwasm-exceptions Emscripten 3.1.6 cannot catch exceptions by type.
emscripten() {
    em++ -std=c++20 -O1 -msimd128 -fexceptions -pthread -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow \
        -Werror -Iinclude -I. -isystem "$build/headers" "-DLDI_SHARED_DIR=\"$PWD/../shared\"" "$@"
}
compile_tests() {
    local file running=0
    rm -f "$build"/*.o "$build/tests.js"
    for file in "$build/main.cpp" "${tests[@]}"; do
        if [ "$running" -ge "$jobs" ]; then
            wait -n || return 1
        else
            running=$((running + 1))
        fi
        emscripten -c "$file" -o "$build/$(basename "$file" .cpp).o" &
    done
    while [ "$running" -gt 0 ]; do
        wait -n || return 1
        running=$((running - 1))
    done
    # The tests start threads and wait for them in main(), so main() must run in a thread of its own (PROXY_TO_PTHREAD).
    emscripten "$build"/*.o -sNODERAWFS=1 -sINITIAL_MEMORY=512MB -sPROXY_TO_PTHREAD=1 -sEXIT_RUNTIME=1 -o "$build/tests.js"
}
run_file() {
    node --no-experimental-fetch "$build/tests.js" --filenames-as-tags --warn NoTests \
        "[#$1]~\"the published output is the same on every*\""
}

count_step "the tests compile to WebAssembly" compile_tests
names=("${tests[@]##*/}")
count_together "passes in WebAssembly" run_file "${names[@]%.cpp}"

print_tally
