#!/usr/bin/env bash
# build.sh: compiles the converter to WebAssembly and makes the page, build/web/photo3d.html (one file) and build/web/site/ (a folder
# for a server). Installs missing packages. Prints the path of photo3d.html.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_web[@]}" >&2
install_npm_packages "$here"
viewer=$("$top/examples/viewer/build.sh" | tail -n 1)
build=$top/build/web
libraries=$("$top/packaging/libraries.sh" web pugixml lcms2 libde265 libheif)
mkdir -p "$build/headers"
ln -sfn /usr/include/stb "$build/headers/stb"  # not -I/usr/include, which has the headers of this machine's C library

export NODE_PATH=/usr/share/nodejs:/usr/lib/nodejs  # Debian's folders of the modules that Emscripten's scripts import
# compile NAME SOURCE FLAG...: writes NAME.js and NAME.wasm.
compile() {
    local made=$build/$1.wasm
    local sources=("$top/include" "$top/examples/photo3d/depth_direction.hpp" "$here/$2" "$here/landing_pads.hpp" "$here/build.sh")
    if [ -f "$made" ] && [ -z "$(find "${sources[@]}" -newer "$made" -print -quit)" ]; then
        return
    fi
    # -unroll-runtime=false saves 13 kB of the compressed converter, at the same speed.
    em++ -std=c++20 -O2 -mllvm -unroll-runtime=false -DNDEBUG -msimd128 -fwasm-exceptions -fno-rtti \
        -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow \
        -DLDI_WITH_PUGIXML -DPUGIXML_NO_XPATH -DPUGIXML_NO_EXCEPTIONS -I"$top/include" -isystem "$build/headers" -isystem "$libraries/include" \
        "$here/$2" -L"$libraries/lib" -o "$build/$1.js" \
        --no-entry -sENVIRONMENT=worker -sFILESYSTEM=0 -sMODULARIZE=1 -sALLOW_MEMORY_GROWTH=1 \
        -sMEMORY_GROWTH_GEOMETRIC_STEP=0 -sTOTAL_STACK=1MB -sEXPORTED_FUNCTIONS=_malloc,_free \
        -sEXPORTED_RUNTIME_METHODS=UTF8ToString "${@:3}" >&2
}
# start NAME ...: runs compile in the background. finish: waits for all of them, and fails if one failed.
running=()
start() {
    compile "$@" &
    running+=($!)
}
finish() {
    local process
    for process in "${running[@]}"; do wait "$process"; done
}
converter=(converter.cpp -lpugixml -sEXPORT_NAME=createConverter -sMEMORY_GROWTH_LINEAR_STEP=1MB)
max_threads=8
start converter "${converter[@]}"
# A build with threads, for pages with shared memory. Emscripten must create the Workers of the threads before the program needs them.
start converter_threads "${converter[@]}" -pthread -Wno-pthreads-mem-growth -DLDI_MAX_THREADS="${max_threads}U" -sDEFAULT_PTHREAD_STACK_SIZE=1MB \
    -sINITIAL_MEMORY=16MB -sMAXIMUM_MEMORY=1GB -sPTHREAD_POOL_SIZE="Math.min(navigator.hardwareConcurrency,$max_threads)-1"
start heic heic.cpp -DLDI_WITH_LIBHEIF -DLDI_WITH_LCMS2 -lheif -lde265 -llcms2 -lpugixml -sEXPORT_NAME=createReader -sMEMORY_GROWTH_LINEAR_STEP=16MB
finish
node "$here/bundle.mjs" "$build" "$viewer" "$top/examples/models" "$build"
