# Starts an S3 server, if possible in a separate network namespace that scripts can disconnect. tests/service/run.sh sources this file.
#
#   start_s3 FOLDER BUCKET    starts the server; sets s3_server (its process) and the variables of Amazon's tools
#   cut_network               disconnects the server, or suspends it if it has no separate network
#   mend_network              undoes cut_network
#   s3_put LIST, s3_get LIST  copies files; each line of LIST is a file's path, a tab, and a key of the bucket
#   remove_s3                 stops the server and removes its network

# shellcheck shell=bash disable=SC2034

start_s3() {
    local folder=$1 address=127.0.0.1 port within=()
    read -r port <<<"$(free_ports 1)"
    s3_bucket=$2
    s3_namespace=ldi-s3-$$
    if ip netns add "$s3_namespace" 2>/dev/null; then
        address=10.213.77.2
        within=(ip netns exec "$s3_namespace")
        ip link add "ldi$$" type veth peer name inside netns "$s3_namespace"
        ip address add 10.213.77.1/30 dev "ldi$$"
        ip link set "ldi$$" up
        ip -n "$s3_namespace" address add "$address/30" dev inside
        ip -n "$s3_namespace" link set inside up
        ip -n "$s3_namespace" link set lo up
        s3_cut="its network interface goes down"
    else
        s3_namespace=
        s3_cut="the server is suspended, because no network namespace can be created here"
    fi
    "${within[@]}" node tests/service/node_modules/s3rver/bin/s3rver.js --silent --directory "$folder" --address "$address" \
        --port "$port" --no-vhost-buckets --configure-bucket "$s3_bucket" >/dev/null &
    s3_server=$!
    export AWS_ENDPOINT_URL=http://$address:$port AWS_ACCESS_KEY_ID=S3RVER AWS_SECRET_ACCESS_KEY=S3RVER AWS_REGION=us-east-1
    until curl -s -o "$folder/answer" "$AWS_ENDPOINT_URL"; do
        kill -0 "$s3_server" || return
        sleep 0.1
    done
}

cut_network() {
    if [ -n "$s3_namespace" ]; then ip -n "$s3_namespace" link set inside down; else kill -STOP "$s3_server"; fi
}

mend_network() {
    if [ -n "$s3_namespace" ]; then ip -n "$s3_namespace" link set inside up; else kill -CONT "$s3_server"; fi
}

# s3_copy OPTION LIST: copies all files with one curl, which signs the requests.
s3_copy() {
    python3 -c 'import sys, urllib.parse
option, place, path = sys.argv[1:]
for line in open(path).read().splitlines():
    file, key = line.split("\t")
    print(f"url = \"{place}/{urllib.parse.quote(key)}\"\n{option} = \"{file}\"")' "$1" "$AWS_ENDPOINT_URL/$s3_bucket" "$2" |
        curl -s -S -g --fail --create-dirs -H 'x-amz-content-sha256: UNSIGNED-PAYLOAD' --aws-sigv4 "aws:amz:$AWS_REGION:s3" --user "$AWS_ACCESS_KEY_ID:$AWS_SECRET_ACCESS_KEY" -K - >/dev/null
}
s3_put() { s3_copy upload-file "$1"; }
s3_get() { s3_copy output "$1"; }

remove_s3() {
    [ -z "${s3_server:-}" ] || { kill -KILL "$s3_server" && wait "$s3_server"; } 2>/dev/null || true
    [ -z "${s3_namespace:-}" ] || ip netns delete "$s3_namespace" 2>/dev/null || true
}
