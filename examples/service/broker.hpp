// Connections to RabbitMQ through librabbitmq. Every failure raises error_code::unavailable; the user of a connection then
// closes it and opens another. The broker delivers all unacknowledged messages of a closed connection again.
#pragma once

#include "message.hpp"

#include <ldi/base/error.hpp>

#include <amqp.h>
#include <amqp_framing.h>
#include <amqp_tcp_socket.h>

#include <sys/time.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace ldi::examples {

/// A message that the broker delivered.
struct delivery {
    std::uint64_t tag = 0;  ///< identifies the message on its connection
    std::string queue, body;
    std::uint64_t earlier = 0;    ///< number of earlier deliveries, each without acknowledgment
    std::string reason_of_death;  ///< reason why the broker made it a dead letter; empty: it is not one
};

/// A connection with one channel. One thread at a time may use it. Only the constructor and confirm() wait long. One of the
/// functions must be called every few seconds, because they also send the heartbeats that keep the connection alive.
class broker_connection {
public:
    /// url  amqp://USER:PASSWORD@HOST:PORT/VIRTUAL_HOST
    ///
    /// Raises invalid_option, unavailable.
    explicit broker_connection(std::string url) : state_(amqp_new_connection()) {
        amqp_connection_info at;
        if (amqp_parse_url(url.data(), &at) != AMQP_STATUS_OK || at.ssl != 0)
            raise(error_code::invalid_option, "--broker", "amqp://USER:PASSWORD@HOST:PORT/VIRTUAL_HOST", "a different address");
        const char* const host =
            *at.vhost == '\0' ? "/" : at.vhost;  // the virtual host of amqp://localhost/ and amqp://localhost
        const timeval patience{10, 0};
        amqp_set_handshake_timeout(state_.get(), &patience);
        amqp_set_rpc_timeout(state_.get(), &patience);
        amqp_socket_t* const socket = amqp_tcp_socket_new(state_.get());
        where_ = std::string("broker ") + at.host + ":" + std::to_string(at.port);
        check(socket == nullptr ? AMQP_STATUS_NO_MEMORY : amqp_socket_open_noblock(socket, at.host, at.port, &patience));
        constexpr int frame_bytes = 131072, heartbeat_seconds = 30;
        check(amqp_login(state_.get(), host, 0, frame_bytes, heartbeat_seconds, AMQP_SASL_METHOD_PLAIN, at.user, at.password));
        amqp_channel_open(state_.get(), channel);
        check();
    }
    ~broker_connection() { amqp_connection_close(state_.get(), AMQP_REPLY_SUCCESS); }
    broker_connection(const broker_connection&) = delete;
    broker_connection& operator=(const broker_connection&) = delete;

    /// Creates the three queues unless they exist. All survive a restart of the broker; in a cluster, they survive the loss of a
    /// minority of brokers. A message that was delivered `delivery_limit` times without being acknowledged becomes a dead
    /// letter.
    void declare(const queue_names& names) {
        const auto text = [](const char* value) {
            amqp_field_value_t field{};
            field.kind = AMQP_FIELD_KIND_UTF8, field.value.bytes = amqp_cstring_bytes(value);
            return field;
        };
        amqp_field_value_t limit{};
        limit.kind = AMQP_FIELD_KIND_I32,
        limit.value.i32 = static_cast<std::int32_t>(delivery_limit) - 1;  // times that the queue delivers a message again
        const amqp_table_entry_t quorum{amqp_cstring_bytes("x-queue-type"), text("quorum")};
        declare(names.dead, {quorum});
        declare(names.results, {quorum});
        declare(names.photos, {quorum,
                               {amqp_cstring_bytes("x-delivery-limit"), limit},
                               {amqp_cstring_bytes("x-dead-letter-exchange"), text("")},
                               {amqp_cstring_bytes("x-dead-letter-routing-key"), text(names.dead.c_str())},
                               // A dead letter stays in this queue until the other queue has stored it. This requires that full
                               // queues refuse new messages.
                               {amqp_cstring_bytes("x-dead-letter-strategy"), text("at-least-once")},
                               {amqp_cstring_bytes("x-overflow"), text("reject-publish")}});
    }

    /// Subscribes to a queue. The broker then sends at most `prefetch` unacknowledged messages at a time. Raises unavailable.
    void consume(const std::string& queue, std::uint16_t prefetch) {
        amqp_basic_qos(state_.get(), channel, 0, prefetch, 0);
        check();
        amqp_basic_consume(state_.get(), channel, bytes(queue), bytes(queue), 0, 0, 0, amqp_empty_table);
        check();
    }

    /// Ends the subscription to a queue. receive() may still return messages that the broker sent before. Raises unavailable.
    void stop_consuming(const std::string& queue) {
        amqp_basic_cancel(state_.get(), channel, bytes(queue));
        check();
    }

    /// Returns the next message, or nothing if none arrives within `patience`. Raises unavailable.
    std::optional<delivery> receive(std::chrono::milliseconds patience) {
        amqp_envelope_t envelope;
        const timeval time{patience.count() / 1000, patience.count() % 1000 * 1000};
        amqp_maybe_release_buffers(state_.get());
        const amqp_rpc_reply_t reply = amqp_consume_message(state_.get(), &envelope, &time, 0);
        if (reply.reply_type == AMQP_RESPONSE_LIBRARY_EXCEPTION && reply.library_error == AMQP_STATUS_TIMEOUT)
            return std::nullopt;
        check(reply);
        const std::unique_ptr<amqp_envelope_t, decltype(&amqp_destroy_envelope)> owner(&envelope, amqp_destroy_envelope);
        amqp_bytes_t body = envelope.message.body;
        body.len = std::min(body.len, max_body_bytes);
        delivery result{envelope.delivery_tag, text(envelope.consumer_tag), text(body), 0, {}};
        const amqp_basic_properties_t& properties = envelope.message.properties;
        if ((properties._flags & AMQP_BASIC_HEADERS_FLAG) == 0) return result;
        for (int i = 0; i < properties.headers.num_entries; ++i) {
            const amqp_table_entry_t& header = properties.headers.entries[i];
            if (text(header.key) == "x-delivery-count") result.earlier = number(header.value);
            if (text(header.key) == "x-first-death-reason" && header.value.kind == AMQP_FIELD_KIND_UTF8)
                result.reason_of_death = text(header.value.value.bytes);
        }
        return result;
    }

    /// Acknowledges a message. Raises unavailable.
    ///
    /// tag           delivery::tag
    /// with_earlier  also acknowledges all earlier messages of this connection
    void acknowledge(std::uint64_t tag, bool with_earlier = false) {
        check(amqp_basic_ack(state_.get(), channel, tag, with_earlier ? 1 : 0));
    }

    /// Returns a message to the queue. The broker counts this as a delivery. Raises unavailable.
    void give_back(std::uint64_t tag) { check(amqp_basic_nack(state_.get(), channel, tag, 0, 1)); }

    /// Enables confirm() for all messages published from now on.
    void begin_publishing() {
        amqp_confirm_select(state_.get(), channel);
        check();
    }

    /// Publishes a persistent message. Raises unavailable.
    ///
    /// id    message id; omitted if it has more than 255 bytes
    /// body  JSON
    void publish(const std::string& queue, const std::string& id, const std::string& body) {
        constexpr std::uint8_t persistent = 2;
        amqp_basic_properties_t properties{};
        properties._flags = AMQP_BASIC_CONTENT_TYPE_FLAG | AMQP_BASIC_DELIVERY_MODE_FLAG;
        properties.content_type = amqp_cstring_bytes("application/json"), properties.delivery_mode = persistent;
        if (id.size() < 256) properties._flags |= AMQP_BASIC_MESSAGE_ID_FLAG, properties.message_id = bytes(id);
        check(amqp_basic_publish(state_.get(), channel, amqp_empty_bytes, bytes(queue), 1, 0, &properties, bytes(body)));
        unconfirmed_.insert(++published_);
    }

    /// Waits until the broker has stored all published messages on disk. Raises unavailable if the broker refuses a message or
    /// sends nothing for 30 seconds.
    void confirm() {
        while (!is_confirmed())
            if (!read_frame(std::chrono::seconds(30))) check(AMQP_STATUS_TIMEOUT);
    }

    /// Whether the broker has stored all published messages on disk, according to the responses that rest() and confirm() have
    /// read.
    bool is_confirmed() const { return unconfirmed_.empty(); }

    /// Sends heartbeats, and reads all responses that have arrived. Raises unavailable if the broker refuses a message.
    void rest() {
        while (read_frame(std::chrono::seconds(0))) {
        }
    }

    /// Maximum number of bytes kept of a message: one more than allowed, so that parse_message() detects longer messages.
    static constexpr std::size_t max_body_bytes = photo_message::max_bytes + 1;

    /// Deliveries of a message before it becomes a dead letter.
    static constexpr std::uint64_t delivery_limit = 5;

private:
    static constexpr amqp_channel_t channel = 1;

    static amqp_bytes_t bytes(const std::string& text) {
        amqp_bytes_t result;
        result.len = text.size(), result.bytes = const_cast<char*>(text.data());
        return result;
    }
    static std::string text(const amqp_bytes_t& bytes) { return {static_cast<const char*>(bytes.bytes), bytes.len}; }
    static std::uint64_t number(const amqp_field_value_t& field) {
        const std::int64_t value = field.kind == AMQP_FIELD_KIND_I64   ? field.value.i64
                                   : field.kind == AMQP_FIELD_KIND_I32 ? field.value.i32
                                   : field.kind == AMQP_FIELD_KIND_I16 ? field.value.i16
                                   : field.kind == AMQP_FIELD_KIND_I8  ? field.value.i8
                                   : field.kind == AMQP_FIELD_KIND_U8  ? field.value.u8
                                                                       : 0;
        return value > 0 ? static_cast<std::uint64_t>(value) : 0;
    }

    void declare(const std::string& name, std::vector<amqp_table_entry_t> entries) {
        const amqp_table_t table{static_cast<int>(entries.size()), entries.data()};
        amqp_queue_declare(state_.get(), channel, bytes(name), 0, 1, 0, 0, table);
        check();
    }

    /// Reads one frame. Returns false if none arrives in time.
    bool read_frame(std::chrono::seconds patience) {
        amqp_frame_t frame;
        const timeval time{patience.count(), 0};
        amqp_maybe_release_buffers(state_.get());
        const int status = amqp_simple_wait_frame_noblock(state_.get(), &frame, &time);
        if (status == AMQP_STATUS_TIMEOUT) return false;
        check(status);
        if (frame.frame_type != AMQP_FRAME_METHOD) return true;
        if (frame.payload.method.id != AMQP_BASIC_ACK_METHOD)  // a refused message, an unknown queue, or a closed connection
            raise(error_code::unavailable, where_, "confirmation", amqp_method_name(frame.payload.method.id));
        const auto& acknowledged = *static_cast<const amqp_basic_ack_t*>(frame.payload.method.decoded);
        if (acknowledged.multiple != 0)
            unconfirmed_.erase(unconfirmed_.begin(), unconfirmed_.upper_bound(acknowledged.delivery_tag));
        else
            unconfirmed_.erase(acknowledged.delivery_tag);
        return true;
    }

    void check() const { check(amqp_get_rpc_reply(state_.get())); }
    void check(int status) const {
        if (status < 0) raise(error_code::unavailable, where_, "a response", amqp_error_string2(status));
    }
    void check(const amqp_rpc_reply_t& reply) const {
        if (reply.reply_type == AMQP_RESPONSE_LIBRARY_EXCEPTION) check(reply.library_error);
        if (reply.reply_type != AMQP_RESPONSE_SERVER_EXCEPTION) return;
        std::string found = amqp_method_name(reply.reply.id);
        if (reply.reply.id == AMQP_CHANNEL_CLOSE_METHOD)
            found += " " + text(static_cast<const amqp_channel_close_t*>(reply.reply.decoded)->reply_text);
        if (reply.reply.id == AMQP_CONNECTION_CLOSE_METHOD)
            found += " " + text(static_cast<const amqp_connection_close_t*>(reply.reply.decoded)->reply_text);
        raise(error_code::unavailable, where_, "a response", found);
    }

    struct destroy {
        void operator()(amqp_connection_state_t state) const { amqp_destroy_connection(state); }
    };
    std::unique_ptr<amqp_connection_state_t_, destroy> state_;
    std::string where_;
    std::uint64_t published_ = 0;
    std::set<std::uint64_t> unconfirmed_;
};

}  // namespace ldi::examples
