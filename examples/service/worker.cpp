// A worker: receives messages that name photos, converts the photos of one storage to GLB files in another, and publishes a
// document per photo. It acknowledges a message after the broker has stored all its documents, so nothing is lost if the worker
// stops or crashes. One thread converts; another communicates with the broker.

#include "../photo3d/arguments.hpp"
#include "../photo3d/batch_list.hpp"
#include "../photo3d/channel.hpp"
#include "../photo3d/heap.hpp"
#include "../photo3d/messages.hpp"
#include "../photo3d/options.hpp"
#include "../photo3d/spare_memory.hpp"
#include "../photo3d/usage_error.hpp"
#include "broker.hpp"
#include "conversion_job.hpp"
#include "message.hpp"
#include "operations.hpp"
#include "photo_watch.hpp"
#include "s3_storage.hpp"
#include "storage.hpp"

#include <curl/curl.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace ldi::examples { namespace {

static_assert(std::atomic<bool>::is_always_lock_free);  // set by a signal handler
std::atomic<bool> is_ending{false};

struct worker_options {
    std::string broker = "amqp://guest:guest@127.0.0.1:5672", queue = "photos", photos, outputs, http;
    double photo_timeout = 900;  // seconds; 0: none
    double patience = 600;       // seconds; less than the half hour after which RabbitMQ delivers a message again
    std::uint16_t prefetch = 1;  // with more, a crash also uses up one delivery of each other message that the worker holds
    std::vector<std::string> conversion;
};

struct task {
    std::uint64_t connection;  ///< connection on which the tag is valid
    delivery message;
};

struct finished_task {
    std::uint64_t connection, tag;
    finished_message done;
};

/// Publishes the documents of one message at a time. Does not wait for the broker's confirmations, and tries again on a new
/// connection after an error. The connection that receives messages is therefore not affected.
class publisher {
public:
    publisher(const std::string& url, const queue_names& names) : url_(url), names_(names) { connect(); }

    /// Publishes the documents of a message. Returns true once the broker has stored all of them. Until then, call it again with
    /// the same message; this publishes nothing twice, unless the connection fails. Must be called every few seconds, because it
    /// also sends heartbeats.
    ///
    /// done  nullptr: there is nothing to publish
    bool store(const finished_message* done) {
        if (std::chrono::steady_clock::now() < next_attempt_) return false;
        try {
            if (!out_) connect();
            out_->rest();
            if (done == nullptr) return false;
            if (!is_published_) publish(*done);
            if (!out_->is_confirmed()) return false;
            is_published_ = false;
            return true;
        } catch (const error& failed) {
            if (failed.code() != error_code::unavailable) throw;
            log_event("warning", "publishing failed", {{"message", escaped(failed.what())}});
        }
        out_.reset();
        next_attempt_ = std::chrono::steady_clock::now() + std::chrono::seconds(5);
        return false;
    }

    bool is_connected() const { return out_.has_value(); }

private:
    void connect() {
        out_.emplace(url_);
        out_->declare(names_);  // somebody may have deleted a queue
        out_->begin_publishing();
        is_published_ = false;
    }

    void publish(const finished_message& done) {
        for (const nlohmann::ordered_json& document : done.results)
            out_->publish(names_.results, id_of(document), to_line(document));
        for (const nlohmann::ordered_json& document : done.dead) out_->publish(names_.dead, id_of(document), to_line(document));
        for (const photo_message& part : done.parts) out_->publish(names_.photos, "", to_text(part));
        is_published_ = true;
    }

    const std::string& url_;
    const queue_names& names_;
    std::optional<broker_connection> out_;
    bool is_published_ = false;
    std::chrono::steady_clock::time_point next_attempt_{};
};

/// Ends the process if it processes one photo for too long, whatever the thread that converts waits for. The broker then delivers
/// the message again.
class watchdog {
public:
    /// seconds  limit of one photo; 0: none
    watchdog(const photo_watch& watch, double seconds) {
        if (seconds > 0) thread_ = std::thread([this, &watch, seconds] { run(watch, seconds); });
    }
    ~watchdog() {
        if (!thread_.joinable()) return;
        {
            const std::lock_guard lock(mutex_);
            is_stopped_ = true;
        }
        stopped_.notify_all();
        thread_.join();
    }
    watchdog(const watchdog&) = delete;
    watchdog& operator=(const watchdog&) = delete;

private:
    void run(const photo_watch& watch, double seconds) {
        std::unique_lock lock(mutex_);
        while (!stopped_.wait_for(lock, std::chrono::milliseconds(500), [&] { return is_stopped_; })) {
            const std::optional<photo_watch::current_photo> photo = watch.current();
            if (photo && photo->silent > seconds) end_process(*photo);
        }
    }

    [[noreturn]] static void end_process(const photo_watch::current_photo& photo) {
        try {
            log_event("error", "photo timeout", {{"job", photo.job}, {"photo", photo.photo}, {"seconds", photo.seconds}});
        } catch (const std::exception&) {  // the log can't be written
        }
        std::_Exit(exit_try_again);  // without destructors, which would wait for the other threads
    }

    std::mutex mutex_;
    std::condition_variable stopped_;
    bool is_stopped_ = false;
    std::thread thread_;
};

class worker {
public:
    worker(const worker_options& options, const arguments& a)
        : options_(options),
          photos_(open_storage(options.photos, &is_ending), patient_storage::duration(options.patience), is_ending, on_failure_),
          outputs_(open_storage(options.outputs, &is_ending), patient_storage::duration(options.patience), is_ending,
                   on_failure_),
          job_(a, photos_, outputs_, metrics_, is_ending),
          server_(options.http, metrics_, [this] { return health(); }) {}

    void run() {
        const watchdog limit(metrics_.watch, options_.photo_timeout);
        std::thread converting([this] { convert(); });
        try {
            while (!is_ending) serve_or_wait();
        } catch (...) {
            end_with(std::current_exception());
        }
        tasks_.close();
        converting.join();
        if (failed_) std::rethrow_exception(failed_);
        log_event("info", "end");
    }

private:
    nlohmann::ordered_json health() const {
        return {{"broker", has_broker_.load()}, {"photos", photos_.is_there()}, {"outputs", outputs_.is_there()}};
    }

    /// Stops the worker; the broker then delivers its messages to other workers. Any thread may call it.
    void end_with(std::exception_ptr failure) {
        const std::lock_guard lock(mutex_);
        if (!failed_) failed_ = std::move(failure);
        is_ending = true;
    }

    bool has_failed() {
        const std::lock_guard lock(mutex_);
        return failed_ != nullptr;
    }

    void serve_or_wait() {
        std::string why;
        try {
            return serve();
        } catch (const error& failed) {
            if (failed.code() != error_code::unavailable) throw;  // such as an invalid --broker
            why = failed.what();
        }
        has_broker_ = false;
        connection_ = 0;  // ends the work on messages that the broker delivers again
        log_event("warning", "broker lost", {{"message", escaped(why)}});
        std::this_thread::sleep_for(std::chrono::seconds(1));
    }

    /// Receives and acknowledges messages on one connection until it fails. Publishes on another, because a broker that is short
    /// of memory or disk blocks connections that publish; acknowledgments and heartbeats must still pass.
    void serve() {
        const queue_names names(options_.queue);
        broker_connection in(options_.broker);
        publisher out(options_.broker, names);
        connection_ = ++connections_;
        in.declare(names);
        // before the first message arrives, because an exception, such as one of a full log disk, would use up one of its
        // deliveries
        log_event("info", "broker found", {{"connection", connection_.load()}});
        in.consume(names.photos, options_.prefetch);
        has_broker_ = true;
        metrics_.connections.Increment();
        std::size_t held = 0;               // messages that are neither acknowledged nor given back
        std::optional<finished_task> sent;  // published, but not confirmed
        const auto process = [&] {
            if (std::optional<delivery> message = in.receive(std::chrono::milliseconds(5))) {
                tasks_.push({connection_, std::move(*message)});
                ++held;
            }
            if (!sent) sent = next_finished();
            if (sent && sent->done.is_given_back) {
                in.give_back(sent->tag);
                metrics_.given_back.Increment();
                sent.reset(), --held;
            } else if (out.store(sent ? &sent->done : nullptr)) {
                in.acknowledge(sent->tag);
                count(sent->done);
                sent.reset(), --held;
            }
            has_broker_ = out.is_connected();
        };
        while (!is_ending) process();
        // Publishes the current photo's document, and returns the other messages. If the broker accepts nothing for a minute,
        // other workers get the message.
        constexpr std::chrono::seconds patience(60);
        in.stop_consuming(names.photos);
        for (auto since = std::chrono::steady_clock::now();
             held > 0 && !has_failed() && std::chrono::steady_clock::now() - since < patience;) {
            process();
            if (!sent) since = std::chrono::steady_clock::now();  // the photo is not finished
        }
    }

    /// Counts a message after its acknowledgment. Until then, another delivery could follow and count its failures again.
    void count(const finished_message& done) {
        metrics_.messages.Increment();
        for (const nlohmann::ordered_json& document : done.dead)
            if (document.contains("photo")) metrics_.count_failure(document["error"]["code"]);
    }

    /// Returns a finished task, unless there is none. Drops those of earlier connections, which the broker delivers again.
    std::optional<finished_task> next_finished() {
        while (std::optional<finished_task> finished = finished_.try_pop())
            if (finished->connection == connection_) return finished;
        return std::nullopt;
    }

    void convert() try {
        while (std::optional<task> next = tasks_.pop()) {
            spare_memory::reserve();
            const auto is_ours = [&] { return next->connection == connection_; };
            if (is_ours()) finished_.push({next->connection, next->message.tag, job_.work_on(next->message, is_ours)});
        }
    } catch (...) {
        end_with(std::current_exception());
    }

    const worker_options& options_;
    worker_metrics metrics_;
    std::function<void(const std::string&)> on_failure_ = [this](const std::string& text) {
        metrics_.watch.excuse();  // --patience limits the retries
        metrics_.storage_failures.Increment();
        log_event("warning", "storage failed", {{"message", escaped(text)}});
    };
    patient_storage photos_, outputs_;
    conversion_job job_;
    channel<task> tasks_{1024};
    channel<finished_task> finished_{1024};
    std::uint64_t connections_ = 0;             // since the start
    std::atomic<std::uint64_t> connection_{0};  // number of the current one; 0: none
    std::atomic<bool> has_broker_{false};
    std::mutex mutex_;  // protects failed_
    std::exception_ptr failed_;
    operations_server server_;  // last, because it reads the other members
};

void describe(CLI::App& app, worker_options& options) {
    app.description("Converts the photos that the messages of a queue name. Options after -- are those of photo3d --batch.");
    app.add_option("--broker", options.broker, "amqp://USER:PASSWORD@HOST:PORT/VIRTUAL_HOST")
        ->envname("PHOTO3D_BROKER")  // other users of the machine can read command lines
        ->capture_default_str();
    app.add_option("--queue", options.queue, "name of the queue; results go to NAME.results and NAME.dead")
        ->capture_default_str();
    app.add_option("--photos", options.photos, "storage of the photos: a folder, or s3://BUCKET/PREFIX")->required();
    app.add_option("--outputs", options.outputs, "storage for GLB files and documents: a folder, or s3://BUCKET/PREFIX")
        ->required();
    app.add_option("--http", options.http, "HOST:PORT or [IPV6]:PORT that answers /metrics and /health; default: none");
    app.add_option("--prefetch", options.prefetch, "maximum number of messages that the worker holds at once")
        ->check(whole_between(1, 1000))
        ->capture_default_str();
    app.add_option("--patience", options.patience,
                   "seconds for which the worker retries failed requests to storage, before it returns a message to the queue")
        ->check(between(0, 1700))
        ->capture_default_str();
    app.add_option("--photo-timeout", options.photo_timeout,
                   "seconds for one photo, after which the worker ends with exit code 75; a failed request to storage restarts "
                   "the time; 0: no limit")
        ->check(between(0, 86400))
        ->capture_default_str();
    app.add_option("CONVERSION", options.conversion, "options of photo3d, after --");
}

/// Parses the options of photo3d. Returns false after an error, which it prints. Raises invalid_option.
bool parse_conversion_options(CLI::App& app, const std::vector<std::string>& options, const arguments& a) {
    try {
        std::vector<std::string> words = options;
        words.insert(words.begin(), {"--batch", "-"});  // messages name the photos
        std::reverse(words.begin(), words.end());       // CLI11 expects the reverse order
        app.parse(words);
        check_effects(app, a);
    } catch (const CLI::Success&) {
        raise(error_code::invalid_option, "options after --", "neither --help nor --version", "one of them");
    } catch (const CLI::ParseError& e) {
        say_usage_error(app, e, options, "photo3d");
        return false;
    }
    return true;
}

/// Reads the options of photo3d. Returns false after an error, which it prints. Raises invalid_option, file_access.
bool read_conversion_options(const std::vector<std::string>& options, const std::filesystem::path& data, arguments& a) {
    CLI::App app;
    examples::describe(app, a, data);
    if (!parse_conversion_options(app, options, a)) return false;
    apply_preset(app, a);
    const auto refuse = [](const char* option) {
        raise(error_code::invalid_option, option, "an option of the conversion after --",
              "one for files or threads, which the worker determines");
    };
    for (const char* const option : {"--output", "--html", "--report", "--gallery", "--skip-existing", "--threads"})
        if (app.count(option) > 0) refuse(option);
    if (!a.depth.empty() && a.depth != "none") refuse("--depth");
    if (a.photos.size() > 1)
        raise(error_code::invalid_option, a.photos.back().string(), "no photo, because messages name the photos", "one");
    check_batch_options(a);
    find_weights(a, data);
    return true;
}

}  // namespace
}  // namespace ldi::examples

int main(int count, char** values) {
    using namespace ldi::examples;
    program_name = "photo3d_worker";
    prepare_heap();
    spare_memory::reserve();
    CLI::App app;
    worker_options options;
    arguments a;
    try {
        describe(app, options);
        app.parse(count, values);
        if (!read_conversion_options(options.conversion, data_folder(values[0]), a)) return exit_usage;
        curl_global_init(CURL_GLOBAL_DEFAULT);
        std::signal(SIGPIPE, SIG_IGN);
        for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { is_ending = true; });
        worker(options, a).run();
    } catch (const CLI::CallForHelp& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        return say_usage_error(app, e, {values + 1, values + count}, "photo3d_worker");
    } catch (...) {
        return say_failure();
    }
    return exit_done;
}
