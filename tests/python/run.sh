#!/usr/bin/env bash
# Builds a wheel of examples/python without a network, installs it into a new virtual environment, and tests it.
# Ends with "N passed, N failed".
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh

require "${needs_compiler[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_viewer[@]}" "${needs_python[@]}"

build=$PWD/build/python
mkdir -p "$build"
rm -rf "$build"/ldi-*.whl "$build/venv"
count_step "the viewer builds" examples/viewer/build.sh
wheel() {
    (cd examples/python && /usr/bin/python3 -m pip wheel --no-build-isolation --no-deps --no-index --wheel-dir "$build" .) &&
        /usr/bin/python3 -m venv --system-site-packages "$build/venv" &&
        "$build/venv/bin/python" -m pip install --no-index --no-deps --force-reinstall "$build"/ldi-*.whl
}
count_step "a wheel builds and installs" wheel

log=$build/log
"$build/venv/bin/python" -m pytest -q -rs -p no:cacheprovider tests/python | tee "$log" || true
counts=$(tail -n 1 "$log") # "1 failed, 12 passed, 2 skipped in 0.69s"
number_of() { grep -oE "[0-9]+ $1" <<<"$counts" | cut -d ' ' -f 1 || true; }
good=$(number_of passed) bad=$(number_of failed) broken=$(number_of error) omitted=$(number_of skipped)
skipped=$((skipped + ${omitted:-0}))
add_tally "${good:-0} passed, $((${bad:-0} + ${broken:-0})) failed"
[ -n "$good$bad" ] || add_tally "no test ran"
count_step "the example makes pictures" "$build/venv/bin/python" examples/python/pictures.py examples/photo3d/sample.jpg "$build/pictures"
print_tally
