// Passes values between threads.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace ldi::examples {

/// A queue with limited capacity: push() waits while the queue is full.
template <class T>
class channel {
public:
    explicit channel(std::size_t capacity) : capacity_(capacity) {}

    void push(T value) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return values_.size() < capacity_; });
        values_.push_back(std::move(value));
        changed_.notify_all();
    }

    /// Waits for a value. Returns an empty optional once the channel is closed and has no more values.
    std::optional<T> pop() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !values_.empty() || is_closed_; });
        if (values_.empty()) return std::nullopt;
        std::optional<T> value(std::move(values_.front()));
        values_.pop_front();
        changed_.notify_all();
        return value;
    }

    /// Returns a value if one is available now.
    std::optional<T> try_pop() {
        const std::lock_guard lock(mutex_);
        if (values_.empty()) return std::nullopt;
        std::optional<T> value(std::move(values_.front()));
        values_.pop_front();
        changed_.notify_all();
        return value;
    }

    /// Announces that no more values follow.
    void close() {
        const std::lock_guard lock(mutex_);
        is_closed_ = true;
        changed_.notify_all();
    }

private:
    std::size_t capacity_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<T> values_;
    bool is_closed_ = false;
};

}  // namespace ldi::examples
