#!/usr/bin/env bash
# run.sh [PHOTO [OPTION...]]: converts PHOTO to a 3D photo: a page for a browser, and a GLB. The default is a photograph in the public
# domain from a Debian package (a portrait of the astronaut Eileen Collins, NASA). `run.sh cat` and `run.sh cup` convert two other
# photographs from that package (CC0). `run.sh sample` converts the ray-cast picture beside this script, without a download. The script
# installs missing packages, builds the program and the viewer, and prints the paths of the page and the GLB on the last two lines. It
# passes the options to the program; build/photo3d/examples/photo3d --help lists them.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

usage() {
    printf 'usage: examples/photo3d/run.sh [PHOTO|portrait|cat|cup|sample [OPTION...]]\n\n'
    sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
}
case ${1:-} in
    -h | --help)
        usage
        exit 0
        ;;
    -*)
        printf 'expected a photo before options, found %s\n\n' "$1" >&2
        usage >&2
        exit 2
        ;;
esac

# Prints the path of a photograph from Debian's python3-skimage. Downloads and unpacks the package once, without installing it.
photograph() {
    local file=$top/out/photographs/$1 package=$top/out/photographs/package
    if [ ! -f "$file" ]; then
        mkdir -p "$package"
        (cd "$package" && apt-get download -q python3-skimage || { apt-get update -q && apt-get download -q python3-skimage; }) >&2 || return
        dpkg-deb --fsys-tarfile "$package"/python3-skimage_*.deb |
            tar -xO "./usr/lib/python3/dist-packages/skimage/data/$2" >"$file.part" && mv "$file.part" "$file"
        rm -r "$package"
    fi
    printf '%s\n' "$file"
}

options=("${@:2}")
case ${1:-portrait} in
    portrait) photo=$(photograph portrait.png astronaut.png) || photo=sample ;;
    cat) photo=$(photograph cat.png chelsea.png) ;;
    cup) photo=$(photograph cup.png coffee.png) ;;
    *) photo=$1 ;;
esac
if [ "$photo" = sample ]; then
    [ "${1:-}" = sample ] || printf 'The photograph could not be downloaded: converting the ray-cast sample.\n' >&2
    photo=$here/sample.jpg
    options=(--depth "$here/sample_depth.png" --fov 56 "${options[@]}")
fi
if [ ! -f "$photo" ]; then
    printf '%s: expected a photo, found %s\n' "$photo" "$([ -d "$photo" ] && echo 'a folder (photo3d --batch converts folders)' || echo 'no such file')" >&2
    exit 1
fi

# Prints the name for a photo's files in out/: the photo's own name, with a number appended if files of another photo have that name.
name_for() {
    local source=$1 stem=$2 name=$2 number=1
    while [ -e "$top/out/.$name.source" ] && [ "$(cat "$top/out/.$name.source")" != "$source" ]; do
        number=$((number + 1)) name=$stem-$number
    done
    printf '%s\n' "$source" >"$top/out/.$name.source"
    printf '%s\n' "$name"
}

require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" >&2
cmake -S "$top" -B "$top/build/photo3d" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF -DLDI_BUILD_EXAMPLES=ON >&2
cmake --build "$top/build/photo3d" --target photo3d >&2

mkdir -p "$top/out"
file=$(basename "$photo")
made=$top/out/$(name_for "$(realpath "$photo")" "${file%.*}")
page=()
if "$top/examples/viewer/build.sh" >&2; then
    page=(--html "$made.html")
else
    printf 'The viewer could not be built: writing only the GLB.\n' >&2
fi
"$top/build/photo3d/examples/photo3d" "$photo" -o "$made.glb" "${page[@]}" "${options[@]}"
printf '%s\n' "${page[@]:1}" "$made.glb"
