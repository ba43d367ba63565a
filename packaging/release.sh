#!/usr/bin/env bash
# Makes the downloads for users without a compiler from the committed sources. Writes them to out/release, and removes the downloads of
# other versions there:
#
#   photo3d-VERSION-linux-x86_64.tar.gz     photo3d for any Linux: one static program, the weights and the viewer
#   photo3d-VERSION-windows-x86_64.zip      the same for Windows
#   ldi-VERSION-*.whl                       the Python package, which needs no library but NumPy
#   photo-3d-VERSION.tgz                    the <photo-3d> element, for npm
#   photo3d-VERSION-web.zip                 the page that makes 3D photos: one HTML file, and a folder for servers
#   SHA256SUMS
#
#   packaging/release.sh [PART...]          parts: linux windows python npm web; default: all
#
# If Debian has no static version of a library, builds it from Debian's sources (packaging/libraries.sh). Prints the paths of the files.
# tests/release/run.sh tests them.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$top"
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh

require "${needs_release[@]}" >&2
if ! git diff --quiet HEAD; then
    printf 'packaging/release.sh: expected committed sources, found changes:\n%s\n' "$(git diff --stat HEAD)" >&2
    exit 1
fi
version=$(sed -n 's/^#define LDI_VERSION_[A-Z]* //p' include/ldi/version.hpp | paste -sd .)
out=$top/out/release
staging=$top/build/release_staging
mkdir -p "$out" "$staging"
# With this time, all archives of the same commit have the same bytes.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

viewer() {
    [ -n "${viewer_built:-}" ] || examples/viewer/build.sh >&2
    viewer_built=1
}

# copy_licenses FOLDER NAME=FILE...: copies the licenses of a program's libraries.
copy_licenses() {
    local folder=$1 pair
    mkdir -p "$folder"
    cp LICENSE "$folder/ldi.txt"
    for pair in "${@:2}"; do
        cp "${pair#*=}" "$folder/${pair%%=*}.txt"
    done
}
installed() { printf '%s=/usr/share/doc/%s/copyright\n' "$1" "$2"; }
from_source() { printf '%s=build/libraries/sources/%s/unpacked/debian/copyright\n' "$1" "$2"; }  # relative, because the repository's path may contain spaces

# program PART OPTION...: builds photo3d in build/release_PART.
program() {
    cmake --preset release -B "build/release_$1" -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF -DLDI_INSTALL=OFF \
        -DCMAKE_PROJECT_ldi_INCLUDE="$top/packaging/static.cmake" "${@:2}" >&2
    cmake --build "build/release_$1" --target photo3d >&2
}

# common FOLDER PROGRAM: copies the files that the Linux and the Windows archive have in common.
common() {
    viewer
    rm -rf "$1" && mkdir -p "$1/models" "$1/viewer"
    cp "$2" "$1"
    cp examples/models/*.safetensors "$1/models"
    cp -r build/viewer/{viewer.html,gallery.html,photo-3d} "$1/viewer"
}

# Sets file times to the commit's time.
settle() { find "$1" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +; }

make_linux() {
    local libraries name=photo3d-$version-linux-x86_64 folder
    require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_release[@]}" >&2
    libraries=$(packaging/libraries.sh linux lcms2 meshoptimizer libde265 libheif)
    program linux -DCMAKE_PREFIX_PATH="$libraries" -DLDI_READERS="libheif;libwebp;libtiff;lcms2;pugixml;libjpeg"
    folder=$staging/$name
    common "$folder" build/release_linux/examples/photo3d
    strip "$folder/photo3d"
    mkdir -p "$folder/man/man1"
    "$folder/photo3d" --generate man | sed "s|\.\./share/ldi/||g" >"$folder/man/man1/photo3d.1"  # the data is beside the program
    "$folder/photo3d" --generate bash >"$folder/photo3d.bash"
    write_readme "$folder" ./photo3d >"$folder/README.txt"
    copy_licenses "$folder/licenses" $(installed libjpeg-turbo libjpeg62-turbo) $(installed libpng libpng-dev) \
        $(installed libwebp libwebp-dev) $(installed libtiff libtiff-dev) $(installed pugixml libpugixml-dev) \
        $(installed lerc liblerc-dev) $(installed jbigkit libjbig-dev) $(installed zstd libzstd-dev) $(installed xz liblzma-dev) \
        $(installed libdeflate libdeflate-dev) $(installed zlib zlib1g-dev) $(installed stb libstb-dev) $(installed CLI11 libcli11-dev) \
        $(installed nlohmann-json nlohmann-json3-dev) $(installed protozero libprotozero-dev) $(installed glibc libc6-dev) \
        $(installed gcc gcc-12-base) $(from_source lcms2 lcms2) $(from_source meshoptimizer meshoptimizer) \
        $(from_source libde265 libde265) $(from_source libheif libheif)
    settle "$folder"
    tar -C "$staging" --sort=name --owner=0 --group=0 --numeric-owner -cf - "$name" | gzip -9n >"$out/$name.tar.gz"
    printf '%s\n' "$out/$name.tar.gz"
}

make_windows() {
    local libraries name=photo3d-$version-windows-x86_64 folder
    require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_release[@]}" "${needs_windows[@]}" >&2
    libraries=$(packaging/libraries.sh windows zlib libpng lcms2 pugixml meshoptimizer libjpeg libwebp)
    # The folder links to the headers of these libraries only, so that the cross compiler does not find this machine's C library.
    mkdir -p build/release_headers
    local library
    for library in stb CLI nlohmann protozero; do ln -sfn "/usr/include/$library" "build/release_headers/$library"; done
    program windows -DCMAKE_TOOLCHAIN_FILE="$top/packaging/mingw.cmake" -DCMAKE_CXX_COMPILER=x86_64-w64-mingw32-g++-posix \
        -DCMAKE_FIND_ROOT_PATH="$libraries" -DCMAKE_PREFIX_PATH="$libraries" \
        -Dstb_INCLUDE_DIR="$top/build/release_headers" -Dprotozero_INCLUDE_DIR="$top/build/release_headers" \
        -DLDI_READERS="libwebp;lcms2;pugixml;libjpeg"
    folder=$staging/$name
    common "$folder" build/release_windows/examples/photo3d.exe
    x86_64-w64-mingw32-strip "$folder/photo3d.exe"
    write_readme "$folder" photo3d.exe | sed 's/$/\r/' >"$folder/README.txt"
    copy_licenses "$folder/licenses" $(from_source zlib zlib) $(from_source libpng libpng1.6) \
        $(from_source lcms2 lcms2) $(from_source pugixml pugixml) $(from_source meshoptimizer meshoptimizer) \
        $(from_source libjpeg-turbo libjpeg-turbo) $(from_source libwebp libwebp) $(installed stb libstb-dev) $(installed CLI11 libcli11-dev) \
        $(installed nlohmann-json nlohmann-json3-dev) $(installed protozero libprotozero-dev) $(installed gcc gcc-mingw-w64-base) \
        $(installed mingw-w64 mingw-w64-common)
    settle "$folder"
    rm -f "$out/$name.zip"
    (cd "$staging" && find "$name" | LC_ALL=C sort | TZ=UTC zip -qX9 "$out/$name.zip" -@)
    printf '%s\n' "$out/$name.zip"
}

# write_readme FOLDER COMMAND
write_readme() {
    cat <<EOF
photo3d $version turns a photo into a 3D photo: a web page (photo.html) and a GLB file (photo.glb).

    $2 photo.jpg        makes photo.html and photo.glb beside the photo; open the page in a browser
    $2 --help           lists all options

Nothing needs to be installed, and nothing is sent over a network. Keep photo3d, models and viewer in one folder, wherever you like.
It runs on every x86-64 processor, and is faster with AVX2 or AVX-512.

EOF
    case $2 in
        *.exe)
            cat <<'EOF'
Built without HEIC, AVIF and TIFF: convert such photos to JPEG or PNG first. "photo3d --version" lists the missing parts.
--video writes a folder of PNG frames; video files need ffmpeg, which photo3d does not start on Windows.
If Windows ends photo3d by force, a folder .ldi-NUMBER.tmp may stay beside the photo; delete it.
EOF
            ;;
        *)
            cat <<'EOF'
Built without AVIF: convert such photos to JPEG or PNG first.
--video needs the program ffmpeg for video files; without it, name a folder for PNG frames.
EOF
            ;;
    esac
    cat <<'EOF'

photo3d and the weights in models have the MIT license. The program contains the libraries whose licenses are in the folder licenses.
Some of them have the GNU Lesser General Public License: you may replace them by building photo3d from its sources with
packaging/release.sh, which says where the sources of the libraries come from.
EOF
}

make_python() {
    local libraries licenses=$staging/python_licenses
    require "${needs_compiler[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_python[@]}" "${needs_release[@]}" >&2
    libraries=$(packaging/libraries.sh python zlib libpng lcms2 meshoptimizer libjpeg libwebp)
    viewer
    rm -rf "$out"/ldi-*.whl "$licenses"
    copy_licenses "$licenses" $(installed stb libstb-dev) $(installed nlohmann-json nlohmann-json3-dev) $(installed pybind11 pybind11-dev) \
        $(installed gcc gcc-12-base) $(from_source zlib zlib) $(from_source libpng libpng1.6) $(from_source lcms2 lcms2) \
        $(from_source meshoptimizer meshoptimizer) $(from_source libjpeg-turbo libjpeg-turbo) $(from_source libwebp libwebp)
    # The wheel needs symbols of glibc up to version 2.36; tests/release/run.sh checks this.
    (cd examples/python && rm -rf build && CPATH="$libraries/include" LIBRARY_PATH="$libraries/lib" \
        LDFLAGS="-L$libraries/lib -static-libstdc++ -static-libgcc -Wl,--exclude-libs,ALL -s" LDI_READERS="libwebp;lcms2;libjpeg" LDI_LICENSES="$licenses" \
        _PYTHON_HOST_PLATFORM=manylinux_2_36_x86_64 /usr/bin/python3 -m pip wheel -q --no-build-isolation --no-deps --no-index --wheel-dir "$out" .) >&2
    printf '%s\n' "$out"/ldi-*.whl
}

make_npm() {
    local name
    require "${needs_viewer[@]}" >&2
    viewer
    rm -f "$out"/photo-3d-*.tgz
    name=$(cd "$out" && npm pack --silent "$top/build/viewer/photo-3d")
    printf '%s\n' "$out/$name"
}

make_web() {
    local name=photo3d-$version-web folder=$staging/photo3d-$version-web
    examples/web/build.sh >&2
    rm -rf "$folder" && mkdir -p "$folder"
    cp -r build/web/photo3d.html build/web/site "$folder"
    copy_licenses "$folder/licenses" $(installed stb libstb-dev) $(from_source pugixml pugixml) $(from_source lcms2 lcms2) \
        $(from_source libde265 libde265) $(from_source libheif libheif) $(installed Emscripten emscripten)
    settle "$folder"
    rm -f "$out/$name.zip"
    (cd "$staging" && find "$name" | LC_ALL=C sort | TZ=UTC zip -qX9 "$out/$name.zip" -@)
    printf '%s\n' "$out/$name.zip"
}

parts=("$@")
[ "${#parts[@]}" -gt 0 ] || parts=(linux windows python npm web)
for part in "${parts[@]}"; do
    declare -F "make_$part" >/dev/null || { printf 'no part %s; parts: linux windows python npm web\n' "$part" >&2 && exit 2; }
done
find "$out" -maxdepth 1 -type f ! -name "*-$version[-.]*" -delete
for part in "${parts[@]}"; do "make_$part"; done
(cd "$out" && find . -maxdepth 1 -type f ! -name SHA256SUMS -printf '%f\n' | LC_ALL=C sort | xargs sha256sum >SHA256SUMS)
printf '%s\n' "$out/SHA256SUMS"
