// Output of a batch: one line of JSON per photo to standard output, and progress to a terminal.
#pragma once

#include "messages.hpp"
#include "outputs.hpp"
#include "system.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace ldi::examples {

/// Writes a line of JSON to standard output in one piece. Raises file_access or unavailable if the reader has closed the pipe.
inline void write_line(const nlohmann::ordered_json& line) {
    print_text(line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

/// Copies the figures for a photo's line, and the notes if there are any, from the photo's report.
inline nlohmann::ordered_json line_figures(const nlohmann::ordered_json& report) {
    const double pixels = report["width"].get<double>() * report["height"].get<double>();
    const auto rounded = [](double value, double digits) { return std::round(value * digits) / digits; };
    nlohmann::ordered_json figures{{"milliseconds", rounded(report["milliseconds"]["total"].get<double>(), 10)},
                                   {"width", report["width"]},
                                   {"height", report["height"]},
                                   {"hidden_share", rounded(report["hidden_pixels"].get<double>() / pixels, 10'000)}};
    if (!report["notes"].empty()) figures["notes"] = report["notes"];
    return figures;
}

/// Makes the member "error" of a photo's line.
inline nlohmann::ordered_json line_error(const failure& what) {
    return {{"code", what.kind},
            {"message", escaped(what.text)},
            {"exit_code", static_cast<int>(what.code)},
            {"try_again", what.code == exit_try_again}};
}

/// Result of a photo.
enum class outcome : std::size_t { converted, skipped, failed };

/// Writes a batch's result lines and its progress. Several threads may use it at the same time.
class batch_log {
public:
    /// total  number of photos, if known
    batch_log(std::optional<std::size_t> total, bool quiet)
        : total_(total), quiet_(quiet), is_terminal_(!quiet && is_terminal(stderr)) {}

    /// Prints a photo's line. Raises the errors of write_line().
    void say_line(outcome what, const nlohmann::ordered_json& line) {
        const std::lock_guard lock(mutex_);
        if (is_terminal_ && is_terminal(stdout)) std::fputs("\r\x1b[K", stderr);
        write_line(line);
        ++counts_[static_cast<std::size_t>(what)];
        const clock::time_point now = clock::now();
        if (!is_terminal_ || now - shown_ < std::chrono::milliseconds(100)) return;
        shown_ = now;
        std::fprintf(stderr, "\r%s\x1b[K", progress().c_str());
    }

    /// Prints the summary.
    ///
    /// left_out  number of entries of folders that are not files with a photo's extension
    void finish(std::size_t left_out) {
        const std::lock_guard lock(mutex_);
        if (quiet_) return;
        if (is_terminal_) std::fputs("\r\x1b[K", stderr);
        char text[64];
        std::snprintf(text, sizeof text, " in %.1f s, %.1f photos/s", seconds(), rate());
        say(std::to_string(count(outcome::converted)) + " converted, " + std::to_string(count(outcome::skipped)) + " skipped, " +
            std::to_string(count(outcome::failed)) + " failed" +
            (left_out > 0 ? ", " + std::to_string(left_out) + " left out" : std::string()) + text);
    }

private:
    using clock = std::chrono::steady_clock;

    std::size_t count(outcome what) const { return counts_[static_cast<std::size_t>(what)]; }
    double seconds() const { return std::chrono::duration<double>(clock::now() - begun_).count(); }
    double rate() const { return static_cast<double>(count(outcome::converted)) / std::max(seconds(), 1e-3); }

    /// Formats the progress: "120 of 1000 photos, 2 failed, 11.3 photos/s, 0:01:18 left".
    std::string progress() const {
        const std::size_t done = counts_[0] + counts_[1] + counts_[2];
        std::string text = std::to_string(done) + (total_ ? " of " + std::to_string(*total_) : std::string()) + " photos";
        if (count(outcome::failed) > 0) text += ", " + std::to_string(count(outcome::failed)) + " failed";
        char number[64];
        std::snprintf(number, sizeof number, ", %.1f photos/s", rate());
        text += number;
        if (total_ && count(outcome::converted) > 0) {
            const double left = static_cast<double>(*total_ - std::min(done, *total_)) / rate();
            const long whole = std::lround(std::min(left, 1e8));
            std::snprintf(number, sizeof number, ", %ld:%02ld:%02ld left", whole / 3600, whole / 60 % 60, whole % 60);
            text += number;
        }
        return text;
    }

    std::optional<std::size_t> total_;
    bool quiet_, is_terminal_;
    clock::time_point begun_ = clock::now(), shown_;
    std::mutex mutex_;
    std::array<std::size_t, 3> counts_{};
};

}  // namespace ldi::examples
