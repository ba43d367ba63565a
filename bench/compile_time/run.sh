#!/usr/bin/env bash
# Measures what including ldi adds to a user's build. Compiles each of several files 5 times, and prints a table of the median processor
# time and the peak memory. Installs missing packages.
# CXX selects another compiler, RUNS another number of runs: CXX=clang++ RUNS=1 bench/compile_time/run.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
require "${needs_compiler[@]}" "command python3;python3" "file /usr/bin/time;time" >&2
compiler=${CXX:-g++} runs=${RUNS:-5}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

echo '#include <ldi/ldi.hpp>' >"$work/umbrella.cpp"
(cd include && printf '#include <%s>\n' ldi/core/*.hpp) >"$work/core.cpp"
# Standard headers that ldi.hpp includes, for comparison.
cat >"$work/standard.cpp" <<'END'
#include <algorithm>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <variant>
#include <vector>
#if defined(__x86_64__)
#include <immintrin.h>
#endif
END
cat >"$work/photo3d.cpp" <<'END'
#include <ldi/ldi.hpp>
ldi::buffer<std::byte> convert(ldi::image_view<const std::uint8_t> photo, std::span<const std::byte> depth, std::span<const std::byte> inpainting) {
    const ldi::photo3d made = ldi::make_photo3d(photo, ldi::decode_tiefenrausch(depth), ldi::decode_farbrausch(inpainting));
    return ldi::encode_glb(made.mesh, made.atlas.color);
}
END

# measure NAME FILE FLAG...: compiles the file RUNS times and prints a row of the table.
measure() {
    local name=$1 file=$2 run
    shift 2
    for ((run = 0; run < runs; ++run)); do
        /usr/bin/time -f '%U %S %M' "$compiler" -std=c++20 -Iinclude "$@" "$work/$file" 2>&1 | tail -n 1
    done | awk '{ print $1 + $2, $3 }' | sort -n | awk -v name="$name" '
        { seconds[NR] = $1; kilobytes[NR] = $2 }
        END { middle = int((NR + 1) / 2); printf "| %s | %.2f | %d |\n", name, seconds[middle], kilobytes[middle] / 1000 }'
}

echo '| file | processor time, s | memory, MB |'
echo '|---|---|---|'
measure 'all of `core/`, `-O0 -fsyntax-only`' core.cpp -O0 -fsyntax-only
measure '`ldi.hpp`, `-O0 -fsyntax-only`' umbrella.cpp -O0 -fsyntax-only
measure 'the standard headers that it needs' standard.cpp -O0 -fsyntax-only
measure '`make_photo3d` with both networks, `-O2`' photo3d.cpp -O2 -c -o "$work/photo3d.o"
