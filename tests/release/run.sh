#!/usr/bin/env bash
# Tests the files of packaging/release.sh as users without a compiler would use them: unpacks each file in a clean folder, with an empty
# environment. The GLB must equal that of the ordinary program. Makes the files first. Takes ten minutes or more; not part of tests/run.sh.
# Ends with "N passed, N failed".
#
#   tests/release/run.sh [--made] [PART...]     --made: tests the files in out/release; PART: see packaging/release.sh
set -euo pipefail
repository=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
cd "$repository"
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh

made=0
while [ $# -gt 0 ] && [[ $1 == -* ]]; do
    case $1 in
        --made) made=1 ;;
        -h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" && exit 0 ;;
        *) printf 'unknown option %s; --help lists the options\n' "$1" >&2 && exit 2 ;;
    esac
    shift
done
parts=("$@")
[ "${#parts[@]}" -gt 0 ] || parts=(linux windows python npm web)

require "command heif-enc;libheif-examples"
release=$repository/out/release
clean=$repository/build/release_test
sample=$repository/examples/photo3d/sample.jpg
rm -rf "$clean" && mkdir -p "$clean"

# Builds from a clone, without uncommitted files.
make_files() {
    local clone=$repository/build/release_clone
    if [ -d "$clone" ]; then
        git -C "$clone" fetch -q "$repository" HEAD && git -C "$clone" checkout -q --detach FETCH_HEAD
    else
        git clone -q --no-hardlinks "$repository" "$clone"
    fi && "$clone/packaging/release.sh" "${parts[@]}" && rm -rf "$release" && mkdir -p "$release" && cp "$clone"/out/release/* "$release"
}

# The ordinary program, with this machine's shared libraries. PROGRAM is the path of a built one.
ordinary=${PROGRAM:-$repository/build/photo3d/examples/photo3d}
build_ordinary() {
    [ -n "${PROGRAM:-}" ] || { cmake --preset release -B build/photo3d -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >/dev/null &&
        cmake --build build/photo3d --target photo3d; }
}
# same_glb FILE [OPTION...]: whether FILE equals the ordinary program's GLB of the sample. A GLB contains its file name.
same_glb() {
    local folder=$clean/expected name
    name=$(basename "$1" .glb)
    rm -rf "$folder" && mkdir -p "$folder" && cp "$sample" "$folder/$name.jpg" &&
        (cd "$folder" && "$ordinary" "$name.jpg" -o "$name.glb" --quiet "${@:2}") && cmp "$folder/$name.glb" "$1"
}
# Same check for a GLB converted from bytes without a file name.
same_nameless_glb() { "$ordinary" - -o - --quiet "${@:2}" <"$sample" | cmp - "$1"; }

unpacked=
unpack() {
    local archive
    archive=$(compgen -G "$release/$1") && mkdir -p "$clean/$2" || return
    case $archive in
        *.zip) unzip -q "$archive" -d "$clean/$2" ;;
        *) tar -xf "$archive" -C "$clean/$2" ;;
    esac
    unpacked=$(echo "$clean/$2"/*)
}

# Runs in a root folder that contains only the archive: no library, no shell, no /proc.
linux_alone() {
    local root=$clean/linux inside
    inside=/$(basename "$unpacked")
    cp "$sample" "$root/photo.jpg"
    if [ "$(id -u)" = 0 ]; then
        env -i "$(command -v chroot)" "$root" "$inside/photo3d" "/${photo:-photo.jpg}" "$@"
    else
        env -i "$unpacked/photo3d" "$root/${photo:-photo.jpg}" "$@"
    fi
}
linux_converts() { linux_alone && same_glb "$clean/linux/photo.glb" && grep -q model/gltf-binary "$clean/linux/photo.html"; }
linux_is_static() {
    local dynamic
    dynamic=$(readelf -d "$unpacked/photo3d") && ! grep NEEDED <<<"$dynamic"
}
linux_reads_heic() {
    local root=$clean/linux
    heif-enc "$sample" -o "$root/heic.heic" >"$clean/heif-enc.log" && cp "$root/heic.heic" "$clean/heic.heic" &&
        photo=heic.heic linux_alone --quiet && (cd "$clean" && "$ordinary" heic.heic --quiet) && cmp "$clean/heic.glb" "$root/heic.glb"
}
linux_compresses() {
    linux_alone -o /photo.glb --compress --quiet && same_glb "$clean/linux/photo.glb" --compress
}
moved() { # the renamed and moved program finds its weights, from another working folder and through a link
    mv "$unpacked" "$clean/elsewhere" && ln -s "$clean/elsewhere/photo3d" "$clean/link" &&
        (cd / && env -i "$clean/link" "$clean/linux/photo.jpg" -o "$clean/photo.glb" --quiet) && same_glb "$clean/photo.glb"
}

wine64=$(command -v wine64 || echo /usr/lib/wine/wine64)
# Wine reads file names in this locale; on Windows, they are in UTF-16.
on_windows() { env -i LANG=C.UTF-8 HOME="$clean" WINEPREFIX="$clean/wine" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" "$wine64" "$@"; }
windows_converts() {
    cp "$sample" "$unpacked/../photo.jpg" && (cd "$unpacked/.." && on_windows "$unpacked/photo3d.exe" photo.jpg) &&
        same_glb "$unpacked/../photo.glb" && grep -q model/gltf-binary "$unpacked/../photo.html"
}
windows_names() { # names that no single code page of Windows can represent; no temporary file remains
    local folder=$clean/names
    mkdir -p "$folder/Фото 写真" && cp "$sample" "$folder/Фото 写真/é😀.jpg" &&
        (cd "$folder" && on_windows "$unpacked/photo3d.exe" "Фото 写真/é😀.jpg" --quiet) && same_glb "$folder/Фото 写真/é😀.glb" &&
        [ "$(find "$folder" -type f | wc -l)" = 3 ]
}
windows_streams() { # bytes pass unchanged, without converted line ends
    on_windows "$unpacked/photo3d.exe" - -o - --quiet <"$sample" >"$clean/stream.glb" && same_nameless_glb "$clean/stream.glb"
}
windows_frames() {
    cp "$sample" "$clean" && (cd "$clean" && on_windows "$unpacked/photo3d.exe" sample.jpg --depth none --size 256 --video frames --seconds 0.2 --fps 10 --quiet) &&
        [ "$(find "$clean/frames" -name '*.png' | wc -l)" = 2 ]
}
windows_refuses_videos() {
    local said status=0
    said=$(cd "$clean" && cp "$sample" . && on_windows "$unpacked/photo3d.exe" sample.jpg --video a.mp4 2>&1) || status=$?
    [ "$status" = 2 ] && grep "PNG frames" <<<"$said" && [ ! -e "$clean/a.mp4" ]
}
windows_version() { on_windows "$unpacked/photo3d.exe" --version | grep "built without HEIC"; }
windows_batch() {
    local folder=$clean/batch
    mkdir -p "$folder" && cp "$sample" "$folder/one.jpg" && cp "$sample" "$folder/two.jpg" &&
        (cd "$folder" && on_windows "$unpacked/photo3d.exe" --batch . -o made --quiet >lines) &&
        same_glb "$folder/made/one.glb" && same_glb "$folder/made/two.glb" && [ "$(grep -c '^{' "$folder/lines")" = 2 ]
}

python_installs() {
    /usr/bin/python3 -m venv --system-site-packages "$clean/venv" &&
        env -i "$clean/venv/bin/python" -m pip install -q --no-index --no-deps --disable-pip-version-check "$release"/ldi-*.whl
}
python_converts() {
    (cd "$clean" && env -i "$clean/venv/bin/python" -c '
import sys, ldi
assert ldi.__file__.startswith(sys.argv[2]), ldi.__file__
made = ldi.photo3d(ldi.read_photo(sys.argv[1]))
open("python.glb", "wb").write(made.glb())
made.glb(compress=True)
assert "model/gltf-binary" in made.html("photo")' "$sample" "$clean/venv") && same_nameless_glb "$clean/python.glb" --arithmetic float32
}
python_has_licenses() {
    local name licenses
    licenses=$(compgen -G "$clean/venv/lib/python*/site-packages/ldi/licenses") || return 1
    for name in ldi zlib libpng lcms2 meshoptimizer libjpeg-turbo libwebp stb nlohmann-json pybind11 gcc; do
        [ -s "$licenses/$name.txt" ] || return 1
    done
}
python_needs() { # the extension links only glibc, and needs no newer symbols than the wheel's name states
    local extension wanted newest
    extension=$(compgen -G "$clean/venv/lib/python*/site-packages/ldi/_ldi*.so") &&
        ! readelf -d "$extension" | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p' | grep -vE '^(libc|libm|ld-linux-x86-64)\.so\.[0-9]$' &&
        wanted=$(compgen -G "$release/ldi-*.whl" | sed -E 's/.*manylinux_([0-9]+)_([0-9]+)_.*/\1.\2/') &&
        newest=$(objdump -T "$extension" | grep -oE 'GLIBC_[0-9.]+' | sed 's/GLIBC_//' | sort -Vu | tail -n 1) &&
        printf 'the extension needs glibc %s, and the name of the wheel states %s\n' "$newest" "$wanted" &&
        [ "$(printf '%s\n' "$newest" "$wanted" | sort -V | tail -n 1)" = "$wanted" ]
}

npm_imports() {
    mkdir -p "$clean/npm" && cd "$clean/npm" && printf '{"private": true, "type": "module"}\n' >package.json &&
        npm install --silent --offline --no-audit --no-fund "$release"/photo-3d-*.tgz &&
        # Outside a browser, the module loads without an error until a page creates an element.
        node --input-type=module -e 'await import("photo-3d")' &&
        node --check node_modules/photo-3d/photo-3d.js && [ -s node_modules/photo-3d/photo-3d.d.ts ] && [ -s node_modules/photo-3d/README.md ] &&
        [ -s node_modules/photo-3d/LICENSE ]
}

web_is_whole() { # every file that the service worker names exists; tests/web/run.sh tests the page in browsers
    local name names
    names=$(grep -oE '"[A-Za-z0-9_.-]+\.(html|gz)"' "$unpacked/site/offline.js" | tr -d '"') && [ "$(wc -w <<<"$names")" -ge 5 ] || return
    for name in $names heic.js.gz heic.wasm.gz; do
        [ -s "$unpacked/site/$name" ] || { printf 'no site/%s\n' "$name" && return 1; }
        [[ $name != *.gz ]] || gzip -t "$unpacked/site/$name" || return
    done
    grep -q 'id="asset depth.safetensors"' "$unpacked/photo3d.html" && [ -s "$unpacked/licenses/libheif.txt" ]
}

checksums() { (cd "$release" && sha256sum --quiet -c SHA256SUMS && [ "$(wc -l <SHA256SUMS)" = "$(find . -type f ! -name SHA256SUMS | wc -l)" ]); }

try_linux() {
    count_step "the Linux archive unpacks" unpack "photo3d-*-linux-x86_64.tar.gz" linux
    count_step "the Linux program needs no shared library" linux_is_static
    count_step "the Linux program converts a photo in a root folder without other files" linux_converts
    count_step "a HEIC photo becomes the same GLB as with the ordinary program" linux_reads_heic
    count_step "--compress writes the same GLB as the ordinary program" linux_compresses
    count_step "the Linux program works after it was moved" moved
}
try_windows() {
    count_step "the Windows archive unpacks" unpack "photo3d-*-windows-x86_64.zip" windows
    count_step "Wine starts" on_windows cmd /c "exit 0"
    count_step "the Windows program converts a photo" windows_converts
    count_step "the Windows program accepts file names in any script" windows_names
    count_step "the Windows program reads standard input and writes standard output without changing bytes" windows_streams
    count_step "the Windows program writes videos as frames" windows_frames
    count_step "the Windows program refuses video files with a message" windows_refuses_videos
    count_step "the Windows program converts a batch" windows_batch
    count_step "the Windows program lists with --version the formats that it does not support" windows_version
}
try_python() {
    count_step "the wheel installs without an index" python_installs
    count_step "the Python package makes the same GLB as the ordinary program" python_converts
    count_step "the Python extension needs no library except glibc" python_needs
    count_step "the wheel contains the licenses of all included libraries" python_has_licenses
}
try_npm() { count_step "the npm package installs and resolves" npm_imports; }
try_web() {
    count_step "the web folder unpacks" unpack "photo3d-*-web.zip" web
    count_step "the web folder has all files" web_is_whole
}

[ "$made" = 1 ] || count_step "packaging/release.sh ${parts[*]}" make_files
count_step "the checksums of all files match" checksums
count_step "the ordinary program builds" build_ordinary
for part in "${parts[@]}"; do "try_$part"; done
print_tally
