#!/usr/bin/env bash
# The test suite, in 12 minutes of two cores: the program, headers and packages as g++ builds them, the unit tests with the address
# and undefined behavior sanitizers, then Khronos' glTF validator on the sample's 3D photo. Installs what is missing. Ends with
# "N passed, N failed".
#
#   tests/run.sh [--all] [CMAKE_OPTION...]
#
# --all adds what takes longer: the lessons of examples/learn, tests labeled slow, the unit tests as g++ builds them without sanitizers, and as clang builds them with
# the single header.
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

# Nothing that is tested here may be left out.
common=(-DLDI_BUILD_BENCH=OFF "-DLDI_REQUIRED=^(ldi::io|examples, tests|examples/(learn|photo3d)|photo3d|tests)" "$@")
if [ "$all" = 1 ]; then
    build_and_test dev "${common[@]}"
    # g++ tests the separate headers, clang the single one: to both compilers the two are the same program, says the test
    # single_include/same_program. Nobody steps through this with a debugger: without its tables it takes a quarter less time to build.
    exclude_labels="slow|build" build_and_test dev-clang "${common[@]}" -DLDI_TEST_SINGLE_INCLUDE=ON -DCMAKE_CXX_FLAGS_DEBUG=-O1
else
    build_targets="photo3d ldi_test_networks_tiefenrausch training_programs" exclude_labels="unit|slow|learn" build_and_test dev "${common[@]}"
fi
# Sanitizers have nothing to find in tests that only run the compiler, and would take minutes on the slow ones and on compiling them
# and the program, whose parts are all tested here. g++ warns of what it sees in this code before; instrumented, it may see more than
# there is.
only_labels=unit build_and_test sanitize "${common[@]}" -DLDI_BUILD_EXAMPLES=OFF -DLDI_BUILD_SLOW_TESTS=OFF -DLDI_UNITY_TESTS=ON \
    -DLDI_WARNINGS_AS_ERRORS=OFF

sample_is_valid() {
    build/dev/examples/photo3d examples/photo3d/sample.jpg --depth examples/photo3d/sample_depth.png -o build/dev/sample.glb --quiet &&
        tests/gltf_validator/run.sh build/dev/sample.glb
}
count_step "the sample's GLB passes the glTF validator" sample_is_valid

print_tally
