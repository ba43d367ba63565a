// Executors run ldi's work on the caller's threads. Every parallel stage accepts an executor. The only threads that ldi itself
// starts are those of a thread_pool. Results never depend on the executor or on its number of threads.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/memory.hpp>

#include <algorithm>
#include <concepts>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// An executor has two members: `concurrency()`, the number of ranges that may run at once (at least 1), and `run(count,
/// function, data)`, which calls `function(data, index)` once for every index in [0, count), on any threads in any order, and
/// returns after all calls. An engine wraps its own job system in these members. The functions that ldi passes to run() let no
/// exception escape, so that C code may call them.
template <class T>
concept executor = requires(T& e, std::size_t count, void (*function)(void*, std::size_t), void* data) {
    { e.concurrency() } -> std::convertible_to<std::size_t>;
    e.run(count, function, data);
};

/// Runs everything on the calling thread.
struct serial_executor {
    std::size_t concurrency() const { return 1; }
    void run(std::size_t count, void (*function)(void*, std::size_t), void* data) const {
        for (std::size_t i = 0; i < count; ++i) function(data, i);
    }
};

/// Calls `body(first, last)` on consecutive pieces that together cover [0, count), each of at least `grain` indices unless
/// `count` is less than `grain`. The work on `grain` indices should take longer than passing a piece to a thread, which costs a
/// few microseconds. The boundaries of pieces depend on the executor, so results must not depend on them. If a call throws,
/// parallel_for() skips the pieces that have not started, waits for the others, and rethrows the first exception.
template <executor Executor, class Body>
void parallel_for(Executor& threads, std::size_t count, std::size_t grain, Body&& body) {
    if (count == 0) return;
    const std::size_t wanted = threads.concurrency() * 4;  // several pieces per thread balance uneven work
    const std::size_t possible = count / std::max<std::size_t>(grain, 1);
    const std::size_t pieces = threads.concurrency() <= 1 ? 1 : std::min<std::size_t>(wanted, possible);
    if (pieces <= 1) {
        body(std::size_t{0}, count);
        return;
    }
    struct task {
        std::remove_reference_t<Body>* body;
        std::size_t piece, longer_pieces;       // the first `longer_pieces` pieces have one index more
        const memory& from = current_memory();  // memory for all threads that work on this range
        std::mutex mutex{};
        std::exception_ptr failure{};

        std::size_t start(std::size_t i) const { return i * piece + std::min<std::size_t>(i, longer_pieces); }
        void run(std::size_t i) {
            const memory_scope scope(from);
#if LDI_HAS_EXCEPTIONS
            {
                const std::lock_guard lock(mutex);
                if (failure != nullptr) return;
            }
            try {
                (*body)(start(i), start(i + 1));
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (failure == nullptr) failure = std::current_exception();
            }
#else
            (*body)(start(i), start(i + 1));
#endif
        }
    } shared{&body, count / pieces, count % pieces};
    threads.run(
        pieces, [](void* data, std::size_t i) { static_cast<task*>(data)->run(i); }, &shared);
    if (shared.failure != nullptr) std::rethrow_exception(shared.failure);
}

namespace detail {

/// Calls one() and other(), which must not depend on each other: at the same time if there are several threads, else in this
/// order. Passes exceptions on like parallel_for().
template <executor Executor, class One, class Other>
void run_both(Executor& threads, One&& one, Other&& other) {
    parallel_for(threads, 2, 1, [&](std::size_t first, std::size_t last) {
        if (first == 0) one();
        if (last == 2) other();
    });
}

}  // namespace detail

/// A pool with a fixed number of threads. The thread that calls run() also works. Not reentrant: a function that runs on the
/// pool must not call run() of the same pool, which would deadlock; an assertion checks this.
class thread_pool {
public:
    /// threads  number of working threads, including the caller's; 0 means one per processor. If the system cannot start all of
    ///          them, the pool is smaller
    explicit thread_pool(std::size_t threads = 0) {
        if (threads == 0) threads = std::max<std::size_t>(std::thread::hardware_concurrency(), 1);
        for (std::size_t i = 1; i < threads; ++i)
            if (!start_worker()) break;
    }
    thread_pool(const thread_pool&) = delete;
    thread_pool& operator=(const thread_pool&) = delete;
    ~thread_pool() {
        {
            const std::lock_guard lock(mutex_);
            stop_ = true;
        }
        wake_.notify_all();
        for (std::thread& worker : workers_) worker.join();
    }

    std::size_t concurrency() const { return workers_.size() + 1; }

    /// Returns after all calls have ended. If a call throws, starts no further calls and rethrows the first exception.
    void run(std::size_t count, void (*function)(void*, std::size_t), void* data) {
        LDI_ASSERT(pool_of_thread() != this);
        const std::lock_guard one_at_a_time(run_mutex_);
        std::unique_lock lock(mutex_);
        function_ = function, data_ = data, next_ = 0, count_ = count, running_ = 0, failure_ = nullptr;
        wake_.notify_all();
        drain(lock);
        done_.wait(lock, [this] { return next_ == count_ && running_ == 0; });
        if (failure_ != nullptr) std::rethrow_exception(std::exchange(failure_, nullptr));
    }

private:
    bool start_worker() {
#if LDI_HAS_EXCEPTIONS
        try {
            workers_.emplace_back([this] { work(); });
        } catch (const std::exception&) {
            return false;
        }
#else
        workers_.emplace_back([this] { work(); });
#endif
        return true;
    }

    void work() {
        std::unique_lock lock(mutex_);
        while (true) {
            wake_.wait(lock, [this] { return stop_ || next_ < count_; });
            if (stop_) return;
            drain(lock);
        }
    }

    void drain(std::unique_lock<std::mutex>& lock) {
        while (next_ < count_) {
            const std::size_t index = next_++;
            ++running_;
            lock.unlock();
            std::exception_ptr failure = call(index);
            lock.lock();
            if (failure != nullptr) {
                if (failure_ == nullptr) failure_ = failure;
                next_ = count_;  // skips the other calls: their results would be discarded
            }
            if (--running_ == 0 && next_ == count_) done_.notify_all();
        }
    }

    /// The pool for which this thread is working.
    static const thread_pool*& pool_of_thread() {
        static thread_local const thread_pool* pool = nullptr;
        return pool;
    }

    std::exception_ptr call(std::size_t index) {
        struct work_scope {
            const thread_pool* before;
            ~work_scope() { pool_of_thread() = before; }
        } const scope{std::exchange(pool_of_thread(), this)};
#if LDI_HAS_EXCEPTIONS
        try {
            function_(data_, index);
        } catch (...) {
            return std::current_exception();
        }
#else
        function_(data_, index);
#endif
        return nullptr;
    }

    std::vector<std::thread> workers_;
    std::mutex run_mutex_, mutex_;
    std::condition_variable wake_, done_;
    void (*function_)(void*, std::size_t) = nullptr;
    void* data_ = nullptr;
    std::size_t next_ = 0, count_ = 0, running_ = 0;
    std::exception_ptr failure_;
    bool stop_ = false;
};

}}  // namespace ldi
