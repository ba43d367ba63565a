#!/usr/bin/env bash
# build.sh: compiles the converter to WebAssembly and makes the page, build/web/photo3d.html (one file) and build/web/site/ (a folder
# for a server). Installs what is missing. Prints the path of the file.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_web[@]}" >&2
viewer=$("$top/examples/viewer/build.sh" | tail -n 1)
build=$top/build/web
mkdir -p "$build/headers"
ln -sfn /usr/include/stb "$build/headers/stb"  # all of /usr/include would bring this machine's C library

export NODE_PATH=/usr/share/nodejs:/usr/lib/nodejs  # where Debian keeps what Emscripten's own scripts need
converter=$build/converter.wasm
if [ ! -f "$converter" ] || [ -n "$(find "$top/include" "$here/converter.cpp" "$here/build.sh" -newer "$converter" -print -quit)" ]; then
    em++ -std=c++20 -O2 -DNDEBUG -msimd128 -fwasm-exceptions -fno-rtti -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow \
        -I"$top/include" -isystem "$build/headers" "$here/converter.cpp" -o "$build/converter.js" \
        --no-entry -sENVIRONMENT=worker -sFILESYSTEM=0 -sMODULARIZE=1 -sEXPORT_NAME=createConverter -sALLOW_MEMORY_GROWTH=1 \
        -sMEMORY_GROWTH_GEOMETRIC_STEP=0 -sMEMORY_GROWTH_LINEAR_STEP=1MB -sTOTAL_STACK=1MB -sEXPORTED_FUNCTIONS=_malloc,_free -sEXPORTED_RUNTIME_METHODS=UTF8ToString >&2
fi
node "$here/bundle.mjs" "$build" "$viewer" "$top/examples/models" "$build"
