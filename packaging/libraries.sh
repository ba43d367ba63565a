#!/usr/bin/env bash
# Builds static libraries from Debian's sources, with Debian's patches: for Linux, the libraries that Debian offers only as shared
# libraries; for the other targets, all libraries that the downloads need. Changes nothing outside build/libraries, which also contains
# apt-get's list of source packages.
#
#   packaging/libraries.sh TARGET NAME...     prints the folder with include/ and lib/; NAME: a library with a function build_NAME below.
#                                             TARGET: linux, windows, python (for Linux, linkable into shared libraries), or web
#                                             (WebAssembly; pugixml, lcms2, libde265, libheif)
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

target=$1
if [ "$target" = web ]; then
    require "${needs_build[@]}" "${needs_sources[@]}" "${needs_web[@]}" >&2
else
    require "${needs_build[@]}" "${needs_release[@]}" >&2
fi
build=$top/build/libraries
prefix=$build/$target
shared=OFF
[ "$target" != python ] || shared=ON
export NODE_PATH=/usr/share/nodejs:/usr/lib/nodejs  # Debian's folders of the modules that Emscripten's scripts import
mkdir -p "$build/apt/parts" "$build/apt/lists/partial" "$build/apt/cache/archives/partial" "$build/sources" "$prefix"

sources_of_debian() {
    apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$build/apt/parts" -o Dir::State::lists="$build/apt/lists" \
        -o Dir::Cache="$build/apt/cache" -o APT::Sandbox::User=root "$@"
}

# Derives the list of source packages from this machine's list of package repositories.
fetch_lists() {
    [ ! -e "$build/apt/fetched" ] || return 0
    sed -n 's/^deb /deb-src /p' /etc/apt/sources.list /etc/apt/sources.list.d/*.list >"$build/apt/parts/all.list" 2>/dev/null || true
    local file
    for file in /etc/apt/sources.list.d/*.sources; do
        [ ! -e "$file" ] || { sed 's/^Types:.*/Types: deb-src/' "$file" && echo; } # an empty line separates the files' last and first entries
    done >"$build/apt/parts/all.sources"
    sources_of_debian update >&2 && touch "$build/apt/fetched"
}

# source_of NAME: unpacks the newest version of a source package on the mirror, and prints its folder.
source_of() {
    local folder=$build/sources/$1 version
    if [ ! -e "$folder/unpacked" ]; then
        fetch_lists
        rm -rf "$folder" && mkdir -p "$folder"
        for version in $(apt_versions "$1"); do
            (cd "$folder" && sources_of_debian source --download-only "$1=$version" && dpkg-source -x ./*.dsc unpacked) >&2 && break
            rm -f "$folder"/*
        done
        [ -e "$folder/unpacked" ] || rm -f "$build/apt/fetched" # the next run fetches newer lists
    fi
    [ -e "$folder/unpacked" ] && printf '%s\n' "$folder/unpacked"
}
apt_versions() {
    apt-cache -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$build/apt/parts" -o Dir::State::lists="$build/apt/lists" \
        -o Dir::Cache="$build/apt/cache" showsrc "$1" | sed -n 's/^Version: //p' | sort -rVu
}

# with_cmake SOURCE OPTION...: configures, builds and installs to the prefix. LIBDIR has a type (STRING), because in projects that declare
# it as a path, such as libjpeg-turbo, CMake interprets an untyped value as relative to the current folder.
with_cmake() {
    local source=$1 folder system=() launcher=()
    folder=$build/$target-build/$(basename "$(dirname "$source")")
    [ "$target" != windows ] || system=(-DCMAKE_TOOLCHAIN_FILE="$top/packaging/mingw.cmake")
    [ "$target" != web ] || system=(-DCMAKE_TOOLCHAIN_FILE=/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake
        -DCMAKE_FIND_ROOT_PATH="$prefix" -DCMAKE_CXX_FLAGS="-msimd128 -fwasm-exceptions -w")
    [ "$target" = web ] || ! command -v ccache >/dev/null || launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
    cmake -S "$source" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF -DCMAKE_INSTALL_PREFIX="$prefix" \
        -DCMAKE_INSTALL_LIBDIR:STRING=lib -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_POSITION_INDEPENDENT_CODE="$shared" "${launcher[@]}" "${system[@]}" "${@:2}" >&2 &&
        cmake --build "$folder" --parallel "$(nproc)" >&2 && cmake --install "$folder" >&2
}

# archive NAME FLAG... -- FILE...: compiles files to the static library NAME without a build system.
archive() {
    local name=$1 folder=$build/$target-build/$1 flags=() file compiler=(gcc) ar=ar
    [ "$shared" = OFF ] || flags+=(-fPIC)
    [ "$target" != windows ] || compiler=(x86_64-w64-mingw32-gcc-posix) ar=x86_64-w64-mingw32-ar
    if [ "$target" = web ]; then
        compiler=(emcc) ar=emar
    elif command -v ccache >/dev/null; then
        compiler=(ccache "${compiler[@]}")
    fi
    mkdir -p "$folder" "$prefix/lib" && rm -f "$folder"/*
    while shift && [ "$1" != -- ]; do flags+=("$1"); done
    for file in "${@:2}"; do
        "${compiler[@]}" -O2 -w -ffile-prefix-map="$build/sources/=" "${flags[@]}" -c "$file" -o "$folder/$(basename "$file").o" || return
    done
    rm -f "$prefix/lib/lib$name.a" && "$ar" rcs "$prefix/lib/lib$name.a" "$folder"/*.o
}

build_lcms2() {
    local source
    source=$(source_of lcms2) && archive lcms2 -I"$source/include" -- "$source"/src/*.c && mkdir -p "$prefix/include" &&
        cp "$source"/include/*.h "$prefix/include"
}
build_meshoptimizer() { with_cmake "$(source_of meshoptimizer)"; }
build_pugixml() {
    local source
    source=$(source_of pugixml) || return
    if [ "$target" != web ]; then
        with_cmake "$source"
        return
    fi
    # With -pthread, programs with and without threads can link it.
    archive pugixml -Oz -pthread -DPUGIXML_NO_XPATH -DPUGIXML_NO_EXCEPTIONS -- "$source/src/pugixml.cpp" && mkdir -p "$prefix/include" &&
        cp "$source"/src/pugi*.hpp "$prefix/include"
}
build_zlib() {
    local source
    source=$(source_of zlib) && archive z -- "$source"/*.c && mkdir -p "$prefix/include" && cp "$source"/{zlib,zconf}.h "$prefix/include"
}
build_libpng() { with_cmake "$(source_of libpng1.6)" -DPNG_SHARED=OFF -DPNG_TESTS=OFF; }
build_libwebp() {
    local tools=() tool
    for tool in ANIM_UTILS CWEBP DWEBP GIF2WEBP IMG2WEBP VWEBP WEBPINFO WEBPMUX EXTRAS; do tools+=(-DWEBP_BUILD_$tool=OFF); done
    with_cmake "$(source_of libwebp)" "${tools[@]}"
}
build_libjpeg() { with_cmake "$(source_of libjpeg-turbo)" -DENABLE_SHARED=OFF -DWITH_TURBOJPEG=OFF; }

build_libde265() {
    local options=(-DENABLE_SDL=OFF -DENABLE_ENCODER=OFF -DENABLE_DECODER=OFF)  # without programs; the library itself can always decode
    [ "$target" != web ] || options+=(-DDISABLE_SSE=ON)
    with_cmake "$(source_of libde265)" "${options[@]}"
}
# Builds libheif for HEIC only; AVIF would need a second decoder.
build_libheif() {
    local source tool options=(-DENABLE_PLUGIN_LOADING=OFF)
    source=$(source_of libheif) || return
    for tool in X265 DAV1D AOM_ENCODER AOM_DECODER SvtEnc RAV1E EXAMPLES; do options+=("-DWITH_$tool=OFF"); done
    if [ "$target" = web ]; then
        options+=(-DENABLE_MULTITHREADING_SUPPORT=OFF)
        # By default, libheif for WebAssembly skips two of HEVC's filters and adds a JavaScript interface. These edits prevent both.
        sed -i -e 's/^#if defined(__EMSCRIPTEN__)/#if 0/' -e '/de265_start_worker_threads/d' \
            "$source/libheif/heif.cc" "$source/libheif/plugins/heif_decoder_libde265.cc"
    fi
    with_cmake "$source" "${options[@]}"
}

for library in "${@:2}"; do
    # Builds a library once per version of its function.
    stamp=$prefix/.$library.$(declare -f "build_$library" | md5sum | cut -c 1-8)
    [ -e "$stamp" ] || { "build_$library" >&2 && touch "$stamp"; } || { printf '%s does not build for %s\n' "$library" "$target" >&2 && exit 1; }
done
printf '%s\n' "$prefix"
