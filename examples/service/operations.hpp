// Output for the operators of a worker: metrics in the format of Prometheus, health, and log lines in JSON.
#pragma once

#include "../photo3d/batch_log.hpp"
#include "message.hpp"
#include "photo_watch.hpp"

#include <ldi/base/error.hpp>

#include <httplib.h>
#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

namespace ldi::examples {

/// Counters of one worker since its start. Any thread may use them.
class worker_metrics {
    // first, because all other members register in it
    prometheus::Registry registry_{prometheus::Registry::InsertBehavior::Merge};

public:
    prometheus::Counter& converted = photos("converted");
    prometheus::Counter& already_done = photos("already_done");  // an earlier delivery of the message had converted it
    prometheus::Counter& failed = photos("failed");              // permanently, counted when the message is acknowledged
    prometheus::Counter& try_again = photos("try_again");        // temporarily, so that the message was returned to the queue
    prometheus::Counter& bytes_read = counter("photo3d_read_bytes_total", "Bytes of photos that were read.");
    prometheus::Counter& bytes_written = counter("photo3d_written_bytes_total", "Bytes of GLB files that were written.");
    prometheus::Counter& messages = counter("photo3d_messages_total", "Messages that were acknowledged.");
    prometheus::Counter& given_back = counter("photo3d_messages_given_back_total", "Messages that were returned to the queue.");
    prometheus::Counter& storage_failures = counter("photo3d_storage_failures_total", "Failed requests to storage.");
    prometheus::Counter& connections = counter("photo3d_broker_connections_total", "Connections made to the broker.");

    photo_watch watch;  ///< of the current photo

    worker_metrics() {  // publishes every code, because a rate needs the 0 before the first failure
        for (int code = 0; code <= static_cast<int>(error_code::unavailable); ++code)
            failures_.Add({{"code", std::string(to_string(static_cast<error_code>(code)))}});
        failures_.Add({{"code", "defect"}});
    }

    /// Counts a photo that failed permanently.
    ///
    /// code  member of its document's error
    void count_failure(const std::string& code) {
        failed.Increment();
        failures_.Add({{"code", code}}).Increment();
    }

    void observe_stage(const std::string& stage, double seconds) { stages_.Add({{"stage", stage}}, bounds()).Observe(seconds); }
    void observe_photo(double seconds) { durations_.Observe(seconds); }

    std::string text() const {
        const std::optional<photo_watch::current_photo> photo = watch.current();
        age_.Set(photo ? photo->seconds : 0);
        return prometheus::TextSerializer().Serialize(registry_.Collect());
    }

private:
    prometheus::Counter& counter(const char* name, const char* help) {
        return prometheus::BuildCounter().Name(name).Help(help).Register(registry_).Add({});
    }
    prometheus::Counter& photos(const char* outcome) {
        return prometheus::BuildCounter()
            .Name("photo3d_photos_total")
            .Help("Photos by outcome.")
            .Register(registry_)
            .Add({{"outcome", outcome}});
    }

    /// Upper bounds of the intervals of a histogram, in seconds.
    static prometheus::Histogram::BucketBoundaries bounds() {
        return {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120, 300};
    }

    prometheus::Gauge& age_ = prometheus::BuildGauge()
                                  .Name("photo3d_current_photo_seconds")
                                  .Help("Seconds for which the worker has been processing its current photo; 0 if there is none.")
                                  .Register(registry_)
                                  .Add({});
    prometheus::Family<prometheus::Counter>& failures_ = prometheus::BuildCounter()
                                                             .Name("photo3d_failures_total")
                                                             .Help("Photos that failed permanently, by code.")
                                                             .Register(registry_);
    prometheus::Family<prometheus::Histogram>& stages_ = prometheus::BuildHistogram()
                                                             .Name("photo3d_stage_seconds")
                                                             .Help("Duration of a stage for one photo, in seconds.")
                                                             .Register(registry_);
    prometheus::Histogram& durations_ = prometheus::BuildHistogram()
                                            .Name("photo3d_photo_seconds")
                                            .Help("Duration of a photo, converted, failed or already done.")
                                            .Register(registry_)
                                            .Add({}, bounds());
};

/// Answers requests for /metrics and /health over HTTP on its own thread.
class operations_server {
public:
    /// address  HOST:PORT, or [HOST]:PORT for an IPv6 address; empty: no server
    /// health   returns an object with one member per dependency: true if it is available, else false
    ///
    /// Raises invalid_option, unavailable.
    operations_server(const std::string& address, const worker_metrics& metrics, std::function<nlohmann::ordered_json()> health) {
        if (address.empty()) return;
        const std::size_t colon = std::min(address.rfind(':'), address.size());
        const char* const end = address.data() + address.size();
        std::uint16_t port = 0;
        const std::from_chars_result read = std::from_chars(std::min(address.data() + colon + 1, end), end, port);
        if (read.ec != std::errc() || read.ptr != end || port == 0)
            raise(error_code::invalid_option, "--http", "HOST:PORT", address);
        server_.Get("/metrics", [&metrics](const httplib::Request&, httplib::Response& answer) {
            answer.set_content(metrics.text(), "text/plain; version=0.0.4; charset=utf-8");
        });
        server_.Get("/health", [health = std::move(health)](const httplib::Request&, httplib::Response& answer) {
            const nlohmann::ordered_json facts = health();
            for (const auto& [name, is_there] : facts.items())
                if (is_there == false) answer.status = 503;
            answer.set_content(to_line(facts) + "\n", "application/json");
        });
        server_.set_socket_options([](socket_t socket) {  // the library's own options would let two workers share an address
            const int yes = 1;
            setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        });
        std::string host = address.substr(0, colon);
        if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
        server_.new_task_queue = [] { return new httplib::ThreadPool(4); };  // the library's default has a thread per core
        server_.set_keep_alive_max_count(1);                                 // an idle connection would occupy a thread
        if (!server_.bind_to_port(host, port))
            raise(error_code::unavailable, "--http", "an address of this machine that no other program uses", address);
        thread_ = std::thread([this] { server_.listen_after_bind(); });
    }
    ~operations_server() {
        if (!thread_.joinable()) return;
        while (!server_.is_running()) std::this_thread::yield();  // stop() has no effect before the server runs
        server_.stop();
        thread_.join();
    }
    operations_server(const operations_server&) = delete;
    operations_server& operator=(const operations_server&) = delete;

private:
    httplib::Server server_;
    std::thread thread_;
};

/// Writes a line of JSON to standard output. Any thread may call it.
inline void log_event(const char* level, const char* event,
                      const nlohmann::ordered_json& facts = nlohmann::ordered_json::object()) {
    const auto now = std::chrono::system_clock::now();
    const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
    std::tm date{};
    gmtime_r(&seconds, &date);
    char day[32], time[48];
    std::strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &date);
    const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
    std::snprintf(time, sizeof time, "%s.%03dZ", day, static_cast<int>(milliseconds));
    nlohmann::ordered_json line{{"time", time}, {"level", level}, {"event", event}, {"process", getpid()}};
    line.update(facts);
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    write_line(line);
}

}  // namespace ldi::examples
