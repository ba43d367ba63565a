// Both ends of the queues: `submit` reads keys of photos, one per line, and sends them in messages; `collect` writes the
// documents of photos to files, one line per photo, even if a document arrives several times. A photo that fails, and succeeds
// when its job is submitted again, has a line in both files.

#include "../photo3d/batch_log.hpp"
#include "../photo3d/line_reader.hpp"
#include "../photo3d/messages.hpp"
#include "../photo3d/option_checks.hpp"
#include "../photo3d/spare_memory.hpp"
#include "../photo3d/usage_error.hpp"
#include "broker.hpp"
#include "line_file.hpp"
#include "message.hpp"

#include <ldi/base/error.hpp>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::examples { namespace {

struct queue_options {
    std::string broker = "amqp://guest:guest@127.0.0.1:5672", queue = "photos", job;
    std::size_t photos_per_message = 16, expected = 0;
    std::filesystem::path results, dead;
};

double seconds_since(std::chrono::steady_clock::time_point begun) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

/// Sends messages in groups. Sends a group again if it is unknown whether the broker received it; workers convert the photos of
/// one job only once.
class submitter {
public:
    explicit submitter(const queue_options& options) : options_(options) {}

    void send(const photo_message& message) {
        constexpr std::size_t together = 256;
        waiting_.push_back(to_text(message)), ++count_;
        if (waiting_.size() == together) finish();
    }

    /// Returns after the broker has stored all messages. Raises unavailable if this takes too long, and the errors of the
    /// connection.
    void finish() {
        constexpr double patience = 60;
        for (const auto begun = std::chrono::steady_clock::now(); !waiting_.empty();) {
            try {
                send_waiting();
            } catch (const error& failed) {
                connection_.reset();
                if (failed.code() != error_code::unavailable || seconds_since(begun) > patience) throw;
                say(failed.what());
                sleep(1);
            }
        }
    }

    std::size_t count() const { return count_; }
    bool has_sent_some() const { return count_ > waiting_.size(); }

private:
    void send_waiting() {
        const queue_names names(options_.queue);
        if (!connection_) {
            connection_.emplace(options_.broker);
            connection_->declare(names);
            connection_->begin_publishing();
        }
        for (const std::string& text : waiting_) connection_->publish(names.photos, "", text);
        connection_->confirm();
        waiting_.clear();
    }

    const queue_options& options_;
    std::optional<broker_connection> connection_;
    std::vector<std::string> waiting_;
    std::size_t count_ = 0;
};

void submit(const queue_options& options) {
    const auto begun = std::chrono::steady_clock::now();
    submitter to(options);
    std::size_t photos = 0;
    struct advisor {
        const submitter& to;
        const std::string& job;
        bool is_done = false;
        ~advisor() {
            if (!is_done && to.has_sent_some())
                say("some photos were already sent; to send all of them without converting any twice, use --job " + job);
        }
    } advice{to, options.job};
    photo_message next{options.job, {}};
    for (line_reader lines(std::cin); lines.next();) {
        if (lines.is_blank()) continue;
        check_photo_key(lines.text(), "standard input, line " + std::to_string(lines.number()));
        next.photos.push_back(lines.text()), ++photos;
        if (next.photos.size() < options.photos_per_message) continue;
        to.send(next);
        next.photos.clear();
    }
    if (!next.photos.empty()) to.send(next);
    to.finish();
    advice.is_done = true;
    write_line({{"job", options.job}, {"photos", photos}, {"messages", to.count()}, {"seconds", seconds_since(begun)}});
}

/// Calls take(document) for each document of a message. A dead letter that the broker made contains the original message; take()
/// then gets one document per photo, with the error.
template <class Take>
void for_each_document(const delivery& message, Take take) {
    if (message.reason_of_death.empty()) {
        const std::optional<nlohmann::ordered_json> document = parse_document(message.body);
        if (document && is_document(*document)) return take(*document);
        return take(
            document_of_refused(message.body, {exit_never, "invalid data", "expected a photo's document, found something else"}));
    }
    const failure why{
        exit_try_again, message.reason_of_death,
        "delivered " + std::to_string(broker_connection::delivery_limit) + " times, but no worker completed the message"};
    photo_message names;
    try {
        names = parse_message(message.body);
    } catch (const error&) {
        return take(document_of_refused(message.body, why));
    }
    for (const std::string& photo : names.photos) {
        nlohmann::ordered_json document = document_of(names.job, photo);
        document["error"] = line_error(why);
        take(document);
    }
}

class collector {
public:
    explicit collector(const queue_options& options) : options_(options), results_(options.results), dead_(options.dead) {
        for (const std::string& id : results_.ids()) recovered_ += dead_.ids().count(id);
    }

    void run() {
        const auto begun = std::chrono::steady_clock::now();
        while (!is_complete()) {
            try {
                serve();
            } catch (const error& failed) {
                if (failed.code() != error_code::unavailable) throw;
                say(failed.what());
                sleep(1);
            }
        }
        results_.save(), dead_.save();
        write_line({{"results", results_.ids().size()},
                    {"dead", dead_.ids().size()},
                    {"dropped", dropped_},
                    {"seconds", seconds_since(begun)}});
    }

private:
    bool is_complete() const {
        return options_.expected > 0 && results_.ids().size() + dead_.ids().size() - recovered_ >= options_.expected;
    }

    /// Adds a document to its file. Returns false for a document that adds nothing: one that its file has already, and a
    /// failure of a photo that has a result. A photo that failed may still succeed when its job is submitted again.
    bool add(const nlohmann::ordered_json& document, bool is_dead) {
        if (is_dead) return results_.ids().count(id_of(document)) == 0 && dead_.add(document);
        const bool is_new = results_.add(document);
        if (is_new) recovered_ += dead_.ids().count(id_of(document));
        return is_new;
    }

    /// Collects documents on one connection, until all expected ones have arrived. Raises unavailable if the connection fails.
    void serve() {
        constexpr std::uint16_t together = 256;
        const queue_names names(options_.queue);
        broker_connection connection(options_.broker);
        connection.declare(names);
        connection.consume(names.results, together);
        connection.consume(names.dead, together);
        std::uint64_t last = 0;
        for (std::size_t waiting = 0; !is_complete() || waiting > 0;) {
            const std::optional<delivery> message = connection.receive(std::chrono::milliseconds(50));
            if (message) {
                for_each_document(*message, [&](const nlohmann::ordered_json& document) {
                    dropped_ += add(document, message->queue == names.dead) ? 0U : 1U;
                });
                last = message->tag, ++waiting;
            }
            if (waiting == 0 || (message && waiting < together / 2)) continue;
            results_.save(), dead_.save();
            connection.acknowledge(last, true);
            waiting = 0;
        }
    }

    const queue_options& options_;
    line_file results_, dead_;
    std::size_t recovered_ = 0;  ///< photos in both files
    std::size_t dropped_ = 0;
};

}  // namespace
}  // namespace ldi::examples

int main(int count, char** values) {
    using namespace ldi::examples;
    program_name = "photo3d_queue";
    spare_memory::reserve();
    CLI::App app("Sends photos to workers, and collects the results.");
    queue_options options;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    options.job = "job-" + std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(now).count());
    app.add_option("--broker", options.broker, "amqp://USER:PASSWORD@HOST:PORT/VIRTUAL_HOST")
        ->envname("PHOTO3D_BROKER")  // other users of the machine can read command lines
        ->capture_default_str();
    app.add_option("--queue", options.queue, "name of the queue")->capture_default_str();
    CLI::App* const sending = app.add_subcommand("submit", "reads keys of photos from standard input, one per line");
    sending
        ->add_option("--job", options.job,
                     "name that distinguishes these photos from earlier ones with the same keys, 1 to 200 bytes; default: made "
                     "from the current time")
        ->check(CLI::Validator(
            [](const std::string& name) {
                if (name.empty() || name.size() > photo_message::max_job_bytes)
                    return "expected 1 to 200 bytes, found " + std::to_string(name.size());
                return name == escaped(name) ? std::string()
                                             : "expected UTF-8 without control characters, found " + escaped(name);
            },
            ""));
    sending->add_option("--photos-per-message", options.photos_per_message, "1 to 64")
        ->check(whole_between(1, photo_message::max_photos))
        ->capture_default_str();
    CLI::App* const collecting = app.add_subcommand("collect", "writes a line of JSON per photo");
    collecting->add_option("--results", options.results, "file for the documents of converted photos")->required();
    collecting->add_option("--dead", options.dead, "file for the documents of failed photos")->required();
    collecting
        ->add_option("--expected", options.expected,
                     "number of photos in both files, with those of earlier runs, at which the program ends; 0: it never ends")
        ->check(whole_between(0, std::size_t{1} << 53))
        ->capture_default_str();
    app.require_subcommand(1);
    try {
        app.parse(count, values);
        if (*sending) submit(options);
        if (*collecting) collector(options).run();
    } catch (const CLI::CallForHelp& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        return say_usage_error(app, e, {values + 1, values + count}, "photo3d_queue");
    } catch (...) {
        return say_failure();
    }
    return exit_done;
}
