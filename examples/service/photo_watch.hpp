// Measures how long a worker has been processing its current photo, and finds photos that take too long.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace ldi::examples {

/// The photo that a worker is processing. Any thread may call the functions.
class photo_watch {
public:
    struct current_photo {
        std::string job, photo;
        double seconds;  ///< since the beginning of the photo
        double silent;   ///< since the beginning of the photo or the last call of excuse()
    };

    void begin(const std::string& job, const std::string& photo) {
        const std::lock_guard lock(mutex_);
        job_ = job, photo_ = photo, is_running_ = true;
        begun_ = excused_ = clock::now();
    }

    void end() {
        const std::lock_guard lock(mutex_);
        is_running_ = false;
    }

    /// Restarts the time limit, because the photo is waiting for something else, which has a limit of its own.
    void excuse() {
        const std::lock_guard lock(mutex_);
        excused_ = clock::now();
    }

    /// Returns the current photo, if there is one.
    std::optional<current_photo> current() const {
        const std::lock_guard lock(mutex_);
        if (!is_running_) return std::nullopt;
        return current_photo{job_, photo_, since(begun_), since(excused_)};
    }

private:
    using clock = std::chrono::steady_clock;

    static double since(clock::time_point time) { return std::chrono::duration<double>(clock::now() - time).count(); }

    mutable std::mutex mutex_;
    std::string job_, photo_;
    bool is_running_ = false;
    clock::time_point begun_, excused_;
};

}  // namespace ldi::examples
