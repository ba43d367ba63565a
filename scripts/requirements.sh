#!/usr/bin/env bash
# Installs missing packages. Scripts in bench/, examples/, packaging/ and tests/, and .ci/run, source this file. To run it by hand:
#
#   scripts/requirements.sh GROUP...      build io photo3d video viewer lessons bench tests clang ...: the packages of needs_GROUP below
#
#   require NEED...   installs missing packages with apt-get. Without apt-get, or with LDI_INSTALL_PACKAGES=0 in the environment,
#                     lists the missing needs and exits with an error. NEED is "KIND NAME;Debian package". KIND is command, header
#                     (also "header NAME|OTHER"), module (of the system's Python), shared (a shared library), library (of clang)
#                     or file.
#   with_screen COMMAND...        runs a command with a virtual screen
#   install_npm_packages FOLDER   installs the packages of the folder's package-lock.json, unless they are installed

# shellcheck shell=bash disable=SC2034

# Tools.
readonly needs_compiler=("command g++;g++")
readonly needs_clang=("command clang++;clang" "command clang-format;clang-format" "library libclang_rt.fuzzer;libclang-rt-dev")
readonly needs_build=("command cmake;cmake" "command ninja;ninja-build")

# Parts of the repository.
readonly needs_weight_files=("header protozero/pbf_reader.hpp;libprotozero-dev")
readonly needs_io=(
    "header stb/stb_image.h;libstb-dev" "header png.h;libpng-dev" "${needs_weight_files[@]}"
    "header libheif/heif.h;libheif-dev" "header webp/decode.h;libwebp-dev" "header tiffio.h;libtiff-dev"
    "header jpeglib.h;libjpeg-dev"
    "header lcms2.h;liblcms2-dev" "header pugixml.hpp;libpugixml-dev")
readonly needs_photo3d=("header CLI/CLI.hpp;libcli11-dev" "header nlohmann/json.hpp;nlohmann-json3-dev"
    "header meshoptimizer.h;libmeshoptimizer-dev" "header webp/encode.h;libwebp-dev")
readonly needs_video=("command ffmpeg;ffmpeg")
readonly needs_lessons=("header nlohmann/json.hpp;nlohmann-json3-dev" "header eigen3/Eigen/Core;libeigen3-dev"
    "header xtensor/xtensor.hpp;libxtensor-dev" "header benchmark/benchmark.h;libbenchmark-dev" "command python3;python3" "module PIL;python3-pil")
readonly needs_viewer=("command node;nodejs" "command npm;npm")
readonly needs_web=("command em++;emscripten" "command node;nodejs" "command npm;npm" "header stb/stb_image.h;libstb-dev")
readonly needs_python=("command python3;python3" "header python3.11/Python.h|python3.12/Python.h|python3.13/Python.h;python3-dev" "header pybind11/pybind11.h;pybind11-dev"
    "module pybind11;python3-pybind11" "module numpy;python3-numpy" "module pip;python3-pip" "module venv;python3-venv"
    "module ensurepip;python3-venv" "module setuptools;python3-setuptools" "module wheel;python3-wheel" "module pytest;python3-pytest"
    "module mypy;mypy")
readonly needs_service=("header amqp.h;librabbitmq-dev" "header curl/curl.h;libcurl4-openssl-dev"
    "header openssl/evp.h;libssl-dev"
    "header prometheus/registry.h;prometheus-cpp-dev" "header httplib.h;libcpp-httplib-dev" "command pkg-config;pkg-config"
    "command curl;curl" "command python3;python3" "command rabbitmqctl;rabbitmq-server")
readonly needs_training=("command python3;python3" "module torch;python3-torch" "module cv2;python3-opencv" "module numpy;python3-numpy" "module matplotlib;python3-matplotlib"
    "header nlohmann/json.hpp;nlohmann-json3-dev" "module scipy;python3-scipy" "module flatbuffers;python3-flatbuffers" "shared libopenblas.so.0;libopenblas0-pthread")  # torch multiplies 30 times faster with it

# Tests.
readonly needs_tests=("header catch2/catch.hpp|catch2/catch_all.hpp;catch2" "header eigen3/Eigen/Core;libeigen3-dev" "header xtensor/xtensor.hpp;libxtensor-dev"
    "header tiny_gltf.h;libtinygltf-dev" "header zlib.h;zlib1g-dev" "header benchmark/benchmark.h;libbenchmark-dev"
    "command python3;python3" "command ffmpeg;ffmpeg" "command pkg-config;pkg-config" "command git;git")
readonly needs_hostile=("command python3;python3" "module numpy;python3-numpy" "module PIL;python3-pil" "command heif-enc;libheif-examples"
    "command ffmpeg;ffmpeg")
readonly needs_validator=("command node;nodejs" "command npm;npm")
readonly needs_browser=("command chromium;chromium")
readonly needs_web_browsers=("command chromium;chromium" "command firefox-esr;firefox-esr" "command xvfb-run;xvfb" "command xauth;xauth"
    "command ffprobe;ffmpeg" "command heif-enc;libheif-examples")
readonly needs_service_tests=("module prometheus_client;python3-prometheus-client" "command ip;iproute2" "command ffmpeg;ffmpeg"
    "command node;nodejs" "command npm;npm" "command slurmctld;slurmctld" "command slurmd;slurmd" "command sbatch;slurm-client"
    "command munged;munge" "command amqp-publish;amqp-tools")
readonly needs_fresh=("command mmdebstrap;mmdebstrap" "command python3;python3" "command git;git")

# Benchmarks.
readonly needs_bench=("header benchmark/benchmark.h;libbenchmark-dev" "header CGAL/version.h;libcgal-dev"
    "header eigen3/Eigen/Core;libeigen3-dev" "header xtensor/xtensor.hpp;libxtensor-dev" "command python3;python3")
readonly needs_bench_comparison=("file /usr/share/benchmark/compare.py;libbenchmark-tools" "module scipy;python3-scipy")
readonly needs_peers=("module torch;python3-torch" "module onnx;python3-onnx" "module cv2;python3-opencv" "command node;nodejs"
    "command npm;npm" "command taskset;util-linux" "header benchmark/benchmark.h;libbenchmark-dev")

# Other processors and systems.
readonly needs_neon=("command aarch64-linux-gnu-g++;g++-aarch64-linux-gnu" "command qemu-aarch64;qemu-user")
readonly needs_webassembly=("command em++;emscripten" "command node;nodejs")
readonly needs_windows=("command x86_64-w64-mingw32-g++-posix;g++-mingw-w64-x86-64-posix" "command wine;wine" "header catch2/catch.hpp;catch2")

# Releases.
readonly needs_sources=("command dpkg-source;dpkg-dev" "command patch;patch")
readonly needs_release=("${needs_sources[@]}" "command git;git" "command gcc;gcc" "command strip;binutils" "command zip;zip" "command unzip;unzip")

# missing_needs NEED...: prints the needs (see above) that this machine lacks.
missing_needs() {
    local need kind name headers=""
    for need in "$@"; do
        read -r kind name <<<"${need%%;*}"
        case $kind in
            command) command -v "$name" >/dev/null || printf '%s\n' "$need" ;;
            header) headers+="#if !(__has_include(<${name//|/>) || __has_include(<}>))"$'\n'"$need"$'\n'"#endif"$'\n' ;;
            module) /usr/bin/python3 -c "import $name" 2>/dev/null || printf '%s\n' "$need" ;;
            file) [ -e "$name" ] || printf '%s\n' "$need" ;;
            shared) compgen -G "/usr/lib/*/$name*" >/dev/null || printf '%s\n' "$need" ;;
            library) compgen -G "/usr/lib/llvm-*/lib/clang/*/lib/*/$name*" >/dev/null || printf '%s\n' "$need" ;;
        esac
    done
    if [ -n "$headers" ]; then
        # shellcheck disable=SC2086  # CXX may have arguments, such as in "ccache g++"
        printf '%s' "$headers" | ${CXX:-g++} -E -P -x c++ - | sed '/^ *$/d'
    fi
}

require() {
    local missing
    # The compiler comes first, because the search for headers uses it.
    if [ -n "${CXX:-}" ] && ! command -v "${CXX%% *}" >/dev/null; then
        printf 'CXX: expected a compiler in PATH, found %s\n' "$CXX" >&2
        exit 1
    fi
    if [ -z "${CXX:-}" ] && ! command -v g++ >/dev/null; then
        install_or_end "${needs_compiler[@]}"
    fi
    mapfile -t missing < <(missing_needs "$@")
    if [ "${#missing[@]}" -gt 0 ]; then
        install_or_end "${missing[@]}"
        mapfile -t missing < <(missing_needs "$@")
        if [ "${#missing[@]}" -gt 0 ]; then
            printf 'Still missing after installing: %s\n' "${missing[@]}" >&2
            exit 1
        fi
    fi
}

install_or_end() {
    local as_root=()
    [ "$(id -u)" = 0 ] || as_root=(sudo)
    if [ "${LDI_INSTALL_PACKAGES:-1}" = 0 ] || ! command -v apt-get >/dev/null; then
        printf 'Missing, and not installed automatically (no apt-get, or LDI_INSTALL_PACKAGES=0). Install these packages, then run the script again:\n' >&2
        printf '  %s)\n' "${@/;/ (Debian package }" >&2
        exit 1
    fi
    printf 'Installing:%s\n' "$(printf ' %s' "${@#*;}")" >&2
    "${as_root[@]}" apt-get update -q >&2
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${@#*;}" >&2
}

# with_screen COMMAND...: runs a command with a virtual screen, without which Firefox has no WebGL.
with_screen() { xvfb-run -a -s "-screen 0 1600x1200x24" "$@"; }

install_npm_packages() {
    # npm records the installed packages in this file.
    if [ ! "$1/node_modules/.package-lock.json" -nt "$1/package-lock.json" ]; then
        npm ci --prefix "$1" --no-audit --no-fund >&2
    fi
}

if [ "${BASH_SOURCE[0]}" = "$0" ]; then
    set -euo pipefail
    for group in "$@"; do
        if ! declare -p "needs_$group" >/dev/null 2>&1; then
            printf 'unknown group %s; groups: %s\n' "$group" "$(compgen -v needs_ | sed 's/^needs_//' | paste -sd ' ')" >&2
            exit 1
        fi
        declare -n needs=needs_$group
        require "${needs[@]}"
    done
fi
