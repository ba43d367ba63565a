#!/usr/bin/env bash
# Creates a minimal Debian with a copy of the committed files, and runs every command block of every page there, unchanged. Takes an hour
# or more; not part of tests/run.sh. Prints a line for each block and ends with "N passed, N failed". Needs root, for chroot.
#
#   tests/fresh/run.sh                       all pages
#   tests/fresh/run.sh --only PAGE           one page, and the pages that run before it on the same machine; repeatable
#   tests/fresh/run.sh --now                 without the blocks marked late: test suites and measurements
#   tests/fresh/run.sh --resume              without the blocks that passed in the last run, on the machines of that run
#   tests/fresh/run.sh --ccache FOLDER       compiles through a compiler cache
#
# build/fresh contains the machines and each block's output. tests/fresh/blocks.py describes how pages mark their blocks.
set -euo pipefail
repository=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
cd "$repository"
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh

only=() now=0 resume=0 ccache=
while [ $# -gt 0 ]; do
    case $1 in
        --only) only+=("$2") && shift ;;
        --now) now=1 ;;
        --resume) resume=1 ;;
        --ccache) ccache=$(realpath "$2") && shift ;;
        -h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" && exit 0 ;;
        *) printf 'unknown option %s; --help lists the options\n' "$1" >&2 && exit 2 ;;
    esac
    shift
done
if [ "$(id -u)" != 0 ]; then
    printf 'tests/fresh/run.sh needs root: it creates a Debian in a folder and runs commands there.\n' >&2
    exit 1
fi
require "${needs_fresh[@]}"

fresh=$repository/build/fresh
logs=$fresh/logs
done_before=$fresh/passed
[ "$resume" = 1 ] || rm -rf "$fresh/machines" "$logs" "$done_before"
mkdir -p "$fresh/machines" "$logs" "$fresh/packages/partial"
touch "$done_before"
rm -rf "$fresh/source"
git clone -q --no-hardlinks --depth 1 "file://$repository" "$fresh/source"
blocks() { python3 "$fresh/source/tests/fresh/blocks.py" "$@"; }

# Creates a minimal Debian with sudo and certificates.
make_base() {
    local suite
    suite=$(. /etc/os-release && printf '%s' "$VERSION_CODENAME")
    mmdebstrap --variant=minbase --mode=root --include="ca-certificates,sudo${ccache:+,ccache}" "$suite" "$fresh/base.tar" >&2
}

# new_machine NAME: creates a folder with the base system, this machine's settings for package registries, and the committed files at
# the same path as here.
new_machine() {
    local root=$fresh/machines/$1
    rm -rf "$root" && mkdir -p "$root"
    tar -x --same-owner -f "$fresh/base.tar" -C "$root"
    apt-config dump | grep '^Acquire::' >"$root/etc/apt/apt.conf.d/90this_machine" || true
    printf 'APT::Get::Assume-Yes "true";\n' >>"$root/etc/apt/apt.conf.d/90this_machine"  # answers yes for the reader
    echo force-unsafe-io >"$root/etc/dpkg/dpkg.cfg.d/quick"
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    cp -r /usr/local/share/ca-certificates "$root/usr/local/share/"
    chroot "$root" update-ca-certificates >/dev/null 2>&1
    printf '127.0.0.1 localhost %s\n' "$(hostname)" >"$root/etc/hosts"
    chroot "$root" apt-get update -q >/dev/null
    mkdir -p "$root$repository"
    cp -a "$fresh/source/." "$root$repository"
}

# in_machine NAME SCRIPT: runs a script in a machine, in separate namespaces, so that its processes and mounts end with it.
inside=
trap '[ -z "$inside" ] || kill -KILL "$inside" 2>/dev/null' EXIT
trap 'exit 130' INT TERM HUP
in_machine() {
    local root=$fresh/machines/$1 network=() name
    for name in npm_config_cafile npm_config_registry; do
        local value
        value=$(npm config get "${name#npm_config_}" 2>/dev/null || true)
        case $value in ''|null|undefined) ;; *) network+=("$name=$value") ;; esac
    done
    while IFS='=' read -r name value; do
        case $name in http_proxy|https_proxy|no_proxy|NODE_EXTRA_CA_CERTS|SSL_CERT_FILE|CURL_CA_BUNDLE) network+=("$name=$value") ;; esac
    done < <(env)
    unshare --mount --pid --ipc --fork --kill-child --propagation private bash -euc '
        root=$1 repository=$2 packages=$3 ccache=$4
        mount --bind "$root" "$root"
        cd "$root"
        mount -t proc proc proc
        mount --rbind /sys sys
        mount --rbind /dev dev
        mount -t tmpfs tmpfs dev/shm
        mount -t tmpfs tmpfs run
        mount --bind "$packages" var/cache/apt/archives
        if [ -d "$repository/../shared" ]; then
            mkdir -p "$root$repository/../shared"
            mount --bind -o ro "$repository/../shared" "$root$repository/../shared"
        fi
        if [ -n "$ccache" ]; then
            mkdir -p root/.cache/ccache
            mount --bind "$ccache" root/.cache/ccache
        fi
        exec chroot . /usr/bin/env -i "${@:6}" HOME=/root USER=root LANG=C.UTF-8 TERM=dumb DEBIAN_FRONTEND=noninteractive \
            PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin bash -c "cd \"$repository\" && $5"
    ' in_machine "$root" "$repository" "$fresh/packages" "$ccache" "$2" "${network[@]}" </dev/null &
    inside=$!
    local status=0
    wait "$inside" || status=$?
    inside=
    return "$status"
}

declare -A machine_of=() page_before=()
left_out=()

run_block() {
    local page=$1 line=$2 machine=$3 log start=$SECONDS script key
    log=$logs/${page//\//_}.$line
    script=$(blocks script "$page" "$line")
    key="$page $(md5sum <<<"$script")"
    if grep -qxF "$key" "$done_before"; then
        passed=$((passed + 1))
        printf 'passed before       %s:%s\n' "$page" "$line"
        return
    fi
    [ -d "$fresh/machines/$machine" ] || new_machine "$machine"
    # The machine's copy has a single commit, possibly of an earlier run.
    git -C "$fresh/machines/$machine$repository" fetch -q --depth 1 "file://$fresh/source" HEAD
    git -C "$fresh/machines/$machine$repository" reset -q --hard FETCH_HEAD
    if in_machine "$machine" "$script" >"$log" 2>&1; then
        passed=$((passed + 1))
        printf '%s\n' "$key" >>"$done_before"
        printf 'passed  %6d s    %s:%s\n' $((SECONDS - start)) "$page" "$line"
    else
        failed=$((failed + 1))
        printf 'FAILED  %6d s    %s:%s    %s\n' $((SECONDS - start)) "$page" "$line" "$log"
        tail -n 5 "$log" | sed 's/^/    /'
    fi
}

wanted() {
    [ "${#only[@]}" = 0 ] && return
    local page
    for page in "${only[@]}"; do
        while [ "$page" != - ]; do
            [ "$page" != "$1" ] || return 0
            page=${page_before[$page]:--}
        done
    done
    return 1
}

main() {
    [ "$resume" = 1 ] && [ -f "$fresh/base.tar" ] || make_base
    while IFS=$'\t' read -r page before; do
        page_before[$page]=$before
        machine_of[$page]=${machine_of[$before]:-${page//\//_}}
    done < <(blocks pages)

    for when in now late; do
        [ "$when" = now ] || [ "$now" = 0 ] || break
        while IFS=$'\t' read -r page line block_when reason <&3; do
            [ "$block_when" = "$when" ] && wanted "$page" || continue
            if [ "$reason" != - ]; then
                left_out+=("$page:$line: $reason")
            else
                run_block "$page" "$line" "${machine_of[$page]}"
            fi
        done 3< <(blocks list)
    done

    [ "$failed" != 0 ] || [ "$now" = 1 ] || rm -rf "$fresh/machines"
    printf '\nskipped, %d blocks:\n' "${#left_out[@]}"
    [ "${#left_out[@]}" = 0 ] || printf '  %s\n' "${left_out[@]}"
    print_tally
}
main; exit  # on one line, so that a change to this file does not affect a run in progress
