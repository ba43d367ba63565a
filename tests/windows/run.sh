#!/usr/bin/env bash
# Compiles the library for Windows with MinGW and tests it under Wine. Runs the unit tests that need only the standard library, and a
# conversion. The conversion must write the same bytes as on Linux, with every instruction set of this processor. Installs missing packages.
# Ends with "N passed, N failed".
#
#   tests/windows/run.sh [FOLDER/TEST...]     only these tests, such as core/graph
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh
# shellcheck source=tests/emulated/header_links.sh
source tests/emulated/header_links.sh

mapfile -t missing < <(missing_needs "${needs_windows[@]}")
if [ "${#missing[@]}" -gt 0 ] && ! (require "${missing[@]}"); then
    printf 'skipped: MinGW, Wine or Catch2 cannot be installed here\n0 passed, 0 failed\n'
    exit 0
fi
end_without_catch2

build=build/windows
link_headers "$build/headers"
printf '#define CATCH_CONFIG_MAIN\n#include <catch2/catch.hpp>\n' >"$build/main.cpp"
tests=("$@")
if [ "${#tests[@]}" = 0 ]; then
    # Excludes tests of the programs, and tests that need other libraries or POSIX. The conversion below covers the whole networks.
    mapfile -t tests < <(grep -LE 'setenv|<(nlohmann|Eigen|xtensor|zlib|tiny_gltf|unistd|sys/)|ldi/(io|adapt)/|npy\.hpp|LDI_SHARED_DIR|peak_memory|caffe2_files|photo_scene' \
        tests/{base,core,kernels,nn/dense,nn/ldi,depth,occlusion,inpaint,charts,texture,mesh,render,formats}/*.cpp | sed -E 's|^tests/(.*)\.cpp$|\1|')
fi

# Wine's files are in the build folder.
export WINEPREFIX="$PWD/$build/wine" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml="
wine64=$(command -v wine64 || echo /usr/lib/wine/wine64)
launcher=$(command -v ccache || true)

# Windows aligns the stack only to 16 bytes, and GCC does not align 32-byte variables on it (GCC bug 54412). The assembler therefore
# replaces aligned moves with unaligned ones.
mingw() {
    $launcher x86_64-w64-mingw32-g++-posix -std=c++20 -O1 -Wa,-muse-unaligned-vector-move -Wall -Wextra -Werror -Iinclude -I. -Itests \
        -isystem "$build/headers" "$@"
}
object_of() { printf '%s/%s.o' "$build" "${1//\//_}"; }
compile_all() {
    local file running=0 failures=0
    rm -f "$build"/*.o "$build"/*.exe
    for file in "${tests[@]}"; do
        if [ "$running" -ge "$jobs" ]; then
            wait -n || failures=$((failures + 1))
        else
            running=$((running + 1))
        fi
        mingw -c "tests/$file.cpp" -o "$(object_of "$file")" &
    done
    mingw -c "$build/main.cpp" -o "$build/main.o" || failures=$((failures + 1))
    while [ "$running" -gt 0 ]; do
        wait -n || failures=$((failures + 1))
        running=$((running - 1))
    done
    [ "$failures" = 0 ]
}
# Each test file becomes a separate program, so that the others still run if one does not compile or crashes.
run_test() {
    [ -f "$(object_of "$1")" ] &&
        mingw -static "$build/main.o" "$(object_of "$1")" -o "$build/test.exe" &&
        timeout 300 "$wine64" "$build/test.exe"
}
compile_conversion() {
    rm -f "$build/convert"
    mingw -static tests/windows/convert.cpp -o "$build/convert.exe" &
    $launcher "${CXX:-g++}" -std=c++20 -O1 -Iinclude -I. -c tests/windows/convert.cpp -o "$build/linux.o" &&
        "${CXX:-g++}" "$build/linux.o" -pthread -o "$build/convert"
    wait $! && [ -x "$build/convert" ]
}
sets_under_wine() {
    "$wine64" "$build/convert.exe" sets - - 2>/dev/null | tr -d '\r'
}
# Compares the result under Wine, with the given instruction set, to the result on Linux with the default set.
compare_conversion() {
    local depth=$1 isa=$2
    [ -s "$build/linux_$depth.glb" ] || "$build/convert" archway "$depth" "$build/linux_$depth.glb"
    LDI_ISA=$isa "$wine64" "$build/convert.exe" archway "$depth" "$build/windows.glb" &&
        cmp "$build/linux_$depth.glb" "$build/windows.glb"
}

count_step "Wine starts" "$wine64" cmd /c "exit 0"
count_step "the unit tests compile for Windows" compile_all
for file in "${tests[@]}"; do
    count_step "$file under Wine" run_test "$file"
done
if [ "$#" = 0 ]; then
    count_step "the conversion compiles for Windows" compile_conversion
    rm -f "$build"/*.glb
    sets=$(sets_under_wine)
    for isa in ${sets:-scalar}; do
        count_step "a conversion with a depth map and $isa has the same bytes under Wine" compare_conversion map "$isa"
        count_step "a conversion with the depth network and $isa has the same bytes under Wine" compare_conversion network "$isa"
    done
fi

print_tally
