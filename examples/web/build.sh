#!/usr/bin/env bash
# build.sh: compiles the converter to WebAssembly and makes the page, build/web/photo3d.html (one file) and build/web/site/ (a folder
# for a server). Installs what is missing. Prints the path of the file.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_web[@]}" >&2
install_npm_packages "$here"
viewer=$("$top/examples/viewer/build.sh" | tail -n 1)
build=$top/build/web
libraries=$("$top/packaging/libraries.sh" web pugixml)
mkdir -p "$build/headers"
ln -sfn /usr/include/stb "$build/headers/stb"  # all of /usr/include would bring this machine's C library

export NODE_PATH=/usr/share/nodejs:/usr/lib/nodejs  # where Debian keeps what Emscripten's own scripts need
# compile NAME FLAG...: makes NAME.js and NAME.wasm.
compile() {
    local made=$build/$1.wasm
    if [ -f "$made" ] && [ -z "$(find "$top/include" "$here"/converter.cpp "$here"/landing_pads.hpp "$here/build.sh" -newer "$made" -print -quit)" ]; then
        return
    fi
    em++ -std=c++20 -O2 -DNDEBUG -msimd128 -fwasm-exceptions -fno-rtti -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow \
        -DLDI_WITH_PUGIXML -DPUGIXML_NO_XPATH -DPUGIXML_NO_EXCEPTIONS -I"$top/include" -isystem "$build/headers" -isystem "$libraries/include" \
        "$here/converter.cpp" -L"$libraries/lib" -lpugixml -o "$build/$1.js" \
        --no-entry -sENVIRONMENT=worker -sFILESYSTEM=0 -sMODULARIZE=1 -sEXPORT_NAME=createConverter -sALLOW_MEMORY_GROWTH=1 \
        -sMEMORY_GROWTH_GEOMETRIC_STEP=0 -sMEMORY_GROWTH_LINEAR_STEP=1MB -sTOTAL_STACK=1MB -sEXPORTED_FUNCTIONS=_malloc,_free \
        -sEXPORTED_RUNTIME_METHODS=UTF8ToString "${@:2}" >&2
}
max_threads=8
compile converter
# For pages with shared memory. Threads of Emscripten must exist before the program starts them.
compile converter_threads -pthread -Wno-pthreads-mem-growth -DLDI_MAX_THREADS="${max_threads}U" -sDEFAULT_PTHREAD_STACK_SIZE=1MB -sINITIAL_MEMORY=16MB -sMAXIMUM_MEMORY=1GB \
    -sPTHREAD_POOL_SIZE="Math.min(navigator.hardwareConcurrency,$max_threads)-1"
node "$here/bundle.mjs" "$build" "$viewer" "$top/examples/models" "$build"
