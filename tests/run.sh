#!/usr/bin/env bash
# Runs the test suite, in about 14 minutes on two cores. Builds and runs the tests of the program, the headers and the packages with g++, runs
# unit tests with the address and undefined behavior sanitizers, and runs Khronos' glTF validator on the sample's 3D photo. Installs missing
# packages. Ends with "N passed, N failed".
#
#   [PROGRAM=FILE] tests/run.sh [--all] [CMAKE_OPTION...]
#
# PROGRAM is the path of a built photo3d, BUILD/examples/photo3d; the packaging tests install BUILD. Without PROGRAM, and with --all, the script
# builds photo3d, which takes minutes.
#
# --all adds slower tests: the lessons of examples/learn; tests labeled slow, such as those of bench/quality; tests of whole photos with
# sanitizers; and more builds of unit tests: with g++ without sanitizers, with clang and the single header, optimized, and with the
# thread sanitizer.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh

all=0
if [ "${1:-}" = --all ]; then
    all=1
    shift
    require "${needs_clang[@]}"
fi
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_lessons[@]}" "${needs_tests[@]}" "${needs_validator[@]}"
install_npm_packages tests/gltf_validator  # tests of GLB files use the validator only if it is installed

# Requires every tested part.
common=(-DLDI_BUILD_BENCH=OFF "-DLDI_REQUIRED=^(ldi::io|examples, tests|examples/(learn|photo3d)|photo3d|tests)" "$@")
program=build/dev/examples/photo3d build_program=photo3d
if [ -n "${PROGRAM:-}" ] && [ "$all" = 0 ]; then
    program=$(realpath -m "$PROGRAM") build_program=
fi
if [ "$all" = 1 ]; then
    build_and_test dev "${common[@]}" -DLDI_UNITY_TESTS=OFF  # compiles each file separately, to find missing includes
    # g++ builds with the separate headers, and clang with the single header. The test single_include/same_program ensures that both kinds
    # contain the same code. Without debug information, the build takes a quarter less time.
    exclude_labels="slow|build" build_and_test dev-clang "${common[@]}" -DLDI_TEST_SINGLE_INCLUDE=ON -DCMAKE_CXX_FLAGS_DEBUG=-O1
    # Builds kernels and networks as users do, and tests multithreaded code with the thread sanitizer.
    build_targets="ldi_test_kernels ldi_test_nn ldi_test_nn_dense ldi_test_nn_ldi ldi_test_networks" only_tests="^(kernels|nn|networks)/" \
        only_labels=unit build_and_test release "${common[@]}" -DLDI_UNITY_TESTS=ON -DLDI_BUILD_EXAMPLES=OFF
    build_targets="ldi_test_base ldi_test_core ldi_test_nn ldi_test_nn_dense ldi_test_nn_ldi ldi_test_networks" \
        only_tests="^(base/[a-z0-9_]+$|core/|nn/|networks/)" only_labels=unit build_and_test threads "${common[@]}" -DLDI_UNITY_TESTS=ON -DLDI_BUILD_EXAMPLES=OFF
else
    build_targets="$build_program ldi_test_photo3d ldi_test_networks_tiefenrausch" exclude_labels="unit|slow|learn" build_and_test dev "${common[@]}" \
        -DLDI_UNITY_TESTS=ON ${PROGRAM:+"-DLDI_TESTED_PROGRAM=$program"}
fi
# Excludes tests that only run a compiler, because sanitizers find nothing there. Excludes the program, because it takes minutes to build and
# other tests cover all its parts. Only --all includes tests of whole photos. Warnings are not errors here: the builds without sanitizers
# report real warnings, and sanitizers cause false ones. Without debug information (-g1 in the preset), the build takes a fifth less time, but
# the address sanitizer names no lines. Undefined behavior ends a test with SIGILL; building and testing the preset `sanitize` names its line.
# Without these messages, the build takes a sixth less time.
[ "$all" = 1 ] && whole=ON || whole=OFF
only_labels="unit|whole" build_and_test sanitize "${common[@]}" -DLDI_BUILD_EXAMPLES=OFF "-DLDI_BUILD_WHOLE_TESTS=$whole" \
    -DLDI_UNITY_TESTS=ON -DLDI_WARNINGS_AS_ERRORS=OFF \
    "-DCMAKE_CXX_FLAGS_DEBUG=-Og -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all -fsanitize-undefined-trap-on-error"

sample_is_valid() {
    "$program" examples/photo3d/sample.jpg --depth examples/photo3d/sample_depth.png -o build/dev/sample.glb --quiet &&
        tests/gltf_validator/run.sh build/dev/sample.glb
}
count_step "the sample's GLB passes the glTF validator" sample_is_valid

print_tally
