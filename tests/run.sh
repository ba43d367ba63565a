#!/usr/bin/env bash
# The whole test suite: with g++, then with the address and undefined behavior sanitizers, then Khronos' glTF validator on the
# sample's 3D photo. Installs what is missing. Arguments go to CMake. Ends with "N passed, N failed".
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh

require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_tests[@]}" "${needs_validator[@]}"

build_and_test dev -DLDI_BUILD_BENCH=OFF "$@"
# Sanitizers have nothing to find in tests that only run the compiler, and would take minutes on the slow ones and on compiling them
# and the program, whose parts are all tested here. g++ has warned of what it sees in this code before; instrumented, it may see more
# than there is.
exclude_labels="build|slow" build_and_test sanitize -DLDI_BUILD_EXAMPLES=OFF -DLDI_BUILD_SLOW_TESTS=OFF "$@" -DLDI_WARNINGS_AS_ERRORS=OFF

sample_is_valid() {
    build/dev/examples/photo3d examples/photo3d/sample.jpg --depth examples/photo3d/sample_depth.png -o build/dev/sample.glb --quiet &&
        tests/gltf_validator/run.sh build/dev/sample.glb
}
count_step "the sample's GLB passes the glTF validator" sample_is_valid

print_tally
