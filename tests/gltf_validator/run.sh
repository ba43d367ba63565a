#!/usr/bin/env bash
# run.sh FILE.glb...: installs the Khronos glTF validator if it is missing. Fails if the validator reports an error or a warning.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/requirements.sh
source "$here/../../scripts/requirements.sh"
install_npm_packages "$here"
node "$here/validate.mjs" "$@"
