# Part of tests/service/run.sh: the unit file for systemd.

# shellcheck shell=bash disable=SC2154

unit='photo3d_worker@.service'
mkdir -p "$work/units"
read -r port <<<"$(free_ports 1)"
sed "s|/usr/local/bin|$(realpath "$PROGRAMS")|; s|:291%i|:$port|; s|^User=.*|User=$(id -un)|" "examples/service/$unit" >"$work/units/$unit"

# Runs the unit's command, which must get as far as looking for a broker.
starts_from_unit() {
    local command line
    command=$(sed -n 's/^ExecStart=//p' "$work/units/$unit")
    line=$(PHOTO3D_BROKER=amqp://127.0.0.1:1 PHOTO3D_PHOTOS=$work PHOTO3D_OUTPUTS=$work timeout 20 bash -c "exec $command" 2>/dev/null | head -n 1)
    [[ $line == *'"broker lost"'* ]]
}
count_step "the command in the unit file starts a worker" starts_from_unit
if command -v systemd-analyze >/dev/null; then
    count_step "systemd accepts the unit file" systemd-analyze verify --man=no "$work/units/$unit"
else
    printf 'skipped: the check of the unit file needs systemd-analyze (Debian: systemd)\n'
fi
