#!/usr/bin/env bash
# run.sh FILE.glb...: installs the Khronos glTF validator if it is missing. Fails if the validator reports an error or a warning.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
[ -d "$here/node_modules/gltf-validator" ] || npm ci --prefix "$here" --no-audit --no-fund >&2
node "$here/validate.mjs" "$@"
