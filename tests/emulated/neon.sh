#!/usr/bin/env bash
# Tests the Arm kernels, and the operators and networks that use them, on an emulated 64-bit Arm processor: once with the dot product
# extension, and once without it, where ldi must choose portable code. Installs missing packages. Ends with "N passed, N failed".
# Another compiler: AARCH64_CXX="clang++ --target=aarch64-linux-gnu" tests/emulated/neon.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh
# shellcheck source=tests/emulated/header_links.sh
source tests/emulated/header_links.sh

require "${needs_weight_files[@]}" "${needs_tests[@]}" "${needs_neon[@]}"

build=build/neon
end_without_catch2
link_headers "$build/headers"
printf '#define CATCH_CONFIG_MAIN\n#include <catch2/catch.hpp>\n' >"$build/main.cpp"
tests=(tests/nn/dense/quantized_network.cpp tests/nn/ldi/{convolution,feature_map,convolution_layer,pooling,elementwise}.cpp tests/networks/{tiefenrausch,farbrausch}.cpp)
tests+=(tests/kernels/*.cpp)

compile() {
    # shellcheck disable=SC2086
    ${AARCH64_CXX:-aarch64-linux-gnu-g++} -std=c++20 -O1 -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Werror \
        -Iinclude -I. -isystem "$build/headers" "-DLDI_SHARED_DIR=\"$PWD/../shared\"" "$@"
}
compile_tests() {
    rm -f "$build"/*.o "$build/tests"
    printf '%s\n' "$build/main.cpp" "${tests[@]}" |
        xargs -P "$jobs" -I {} bash -c 'compile -c "$1" -o "$build/$(basename "$1" .cpp).o"' compile {} &&
        compile -static -pthread "$build"/*.o -o "$build/tests"
}
export build
export -f compile

# Runs one test file on the named processor. With LDI_ISA, a missing instruction set is an error instead of a silent fallback to portable
# code.
run_file() {
    qemu-aarch64 -cpu "$1" "$build/tests" --filenames-as-tags --warn NoTests "[#$2]~the published output is the same on every*"
}
with_dot_product() { LDI_ISA=neon run_file max "$1"; }
without_dot_product() { run_file cortex-a53 "$1" && run_file cortex-a53 isa && neon_is_refused; }
neon_is_refused() { { LDI_ISA=neon run_file cortex-a53 isa || true; } | grep -q 'LDI_ISA: expected one of scalar, found neon'; }

count_step "the tests compile for 64-bit Arm" compile_tests
names=("${tests[@]##*/}")
count_together "passes with the dot product extension" with_dot_product "${names[@]%.cpp}"
count_together "passes without the dot product extension" without_dot_product gemm_u8 depthwise_u8 add_u8 conv unavailable_sets

print_tally
