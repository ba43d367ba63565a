# Sourced by scripts that need a broker of their own: RabbitMQ on a free port, with all that it keeps in one folder.
#
#   start_broker FOLDER    starts it, or starts it again on what it keeps there; sets broker_url
#   stop_broker            ends it, as a restart of its machine would
#   remove_broker          ends it and what Erlang leaves running

# shellcheck shell=bash disable=SC2034

# Prints so many ports that are free now. None is of those that the system gives to who connects: who asks for such a port before
# somebody listens there may get it for both ends, and be connected to itself. To be used as <<<"$(free_ports N)", which waits until
# nobody listens there any more.
free_ports() {
    python3 -c 'import random, socket, sys
sockets = []
while len(sockets) < int(sys.argv[1]):
    try:
        sockets.append(socket.create_server(("127.0.0.1", random.randrange(10000, 30000))))
    except OSError:
        pass
print(*(s.getsockname()[1] for s in sockets))' "$1"
}

start_broker() {
    local folder=$1 waited=0
    if [ -z "${broker_port:-}" ]; then
        read -r broker_port broker_distribution_port broker_names_port <<<"$(free_ports 3)"
        mkdir -p "$folder"
        # Nobody but this machine gets in.
        printf '%s\n' "listeners.tcp.1 = 127.0.0.1:$broker_port" 'log.console = false' >"$folder/broker.conf"
        : >"$folder/environment"
        : >"$folder/plugins"
    fi
    broker_url=amqp://guest:guest@127.0.0.1:$broker_port
    # Debian's own wrapper in the PATH would go on as another user, on the system's folders. Under systemd this script becomes the broker
    # instead of starting it, so that its process is the one to be ended. It is not to wait for work by keeping cores busy: workers share
    # them.
    env RUNNING_UNDER_SYSTEMD=1 RABBITMQ_SERVER_ADDITIONAL_ERL_ARGS="+sbwt none +sbwtdcpu none +sbwtdio none" HOME="$folder" ERL_EPMD_PORT="$broker_names_port" ERL_EPMD_ADDRESS=127.0.0.1 RABBITMQ_CONF_ENV_FILE="$folder/environment" \
        RABBITMQ_NODENAME="ldi-$broker_port@localhost" RABBITMQ_DIST_PORT="$broker_distribution_port" \
        RABBITMQ_CONFIG_FILE="$folder/broker.conf" RABBITMQ_ENABLED_PLUGINS_FILE="$folder/plugins" \
        RABBITMQ_MNESIA_BASE="$folder/data" RABBITMQ_LOG_BASE="$folder/log" \
        /usr/lib/rabbitmq/bin/rabbitmq-server >>"$folder/output" 2>&1 </dev/null &
    broker_process=$!
    until (exec 3<>"/dev/tcp/127.0.0.1/$broker_port") 2>/dev/null; do
        sleep 0.2
        waited=$((waited + 1))
        if [ "$waited" -gt 300 ] || ! kill -0 "$broker_process" 2>/dev/null; then
            printf 'The broker does not start:\n' >&2
            tail -n 20 "$folder/output" >&2
            return 1
        fi
    done
}

stop_broker() {
    kill -TERM "$broker_process" 2>/dev/null || true
    for _ in $(seq 100); do
        kill -0 "$broker_process" 2>/dev/null || break
        sleep 0.1
    done
    kill -KILL "$broker_process" 2>/dev/null || true
    wait "$broker_process" 2>/dev/null || true
}

remove_broker() {
    [ -n "${broker_process:-}" ] || return 0
    stop_broker
    ERL_EPMD_PORT=$broker_names_port epmd -kill >/dev/null 2>&1 || true
}
