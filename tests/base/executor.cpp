#include <ldi/base/executor.hpp>

#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

using namespace ldi;

namespace {
/// An executor as a caller might write it: one thread per call, started in reverse order.
struct callers_executor {
    std::size_t threads;
    std::size_t calls = 0;

    std::size_t concurrency() const { return threads; }
    void run(std::size_t count, void (*function)(void*, std::size_t), void* data) {
        calls += count;
        std::vector<std::thread> running;
        for (std::size_t i = count; i > 0; --i) running.emplace_back(function, data, i - 1);
        for (std::thread& t : running) t.join();
    }
};
static_assert(executor<callers_executor> && executor<thread_pool> && executor<serial_executor> &&
              executor<const serial_executor>);
static_assert(!executor<int> && !executor<const thread_pool>);

/// An executor that offers several threads, but runs everything in order on the calling thread.
struct ordered_executor {
    std::size_t concurrency() const { return 3; }
    void run(std::size_t count, void (*function)(void*, std::size_t), void* data) const {
        serial_executor().run(count, function, data);
    }
};

/// Computes values that depend only on their index, in pieces of at least `grain` values.
template <class Executor>
std::vector<std::uint32_t> filled(Executor& threads, std::size_t count, std::size_t grain) {
    std::vector<std::uint32_t> values(count, 0);
    parallel_for(threads, count, grain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) values[i] += static_cast<std::uint32_t>(i) * 2654435761U;
    });
    return values;
}

/// Checks that the pieces of parallel_for() are consecutive, cover the range once, and are no shorter than the grain.
template <class Executor>
void cuts_soundly(Executor& threads, std::size_t count, std::size_t grain) {
    std::mutex mutex;
    std::vector<std::pair<std::size_t, std::size_t>> pieces;
    parallel_for(threads, count, grain, [&](std::size_t first, std::size_t last) {
        const std::lock_guard lock(mutex);
        pieces.emplace_back(first, last);
    });
    std::sort(pieces.begin(), pieces.end());
    std::size_t covered = 0;
    for (const auto& [first, last] : pieces) {
        REQUIRE(first == covered);
        REQUIRE(last - first >= std::min(std::max<std::size_t>(grain, 1), count));
        covered = last;
    }
    REQUIRE(covered == count);
    REQUIRE(pieces.size() <= 4 * threads.concurrency());
}
}  // namespace

TEST_CASE("the serial executor runs every index in order on the calling thread") {
    std::vector<std::size_t> seen;
    serial_executor().run(
        5, [](void* data, std::size_t i) { static_cast<std::vector<std::size_t>*>(data)->push_back(i); }, &seen);
    CHECK(seen == std::vector<std::size_t>{0, 1, 2, 3, 4});
}

TEST_CASE("a pool has the requested number of threads, and by default one per processor") {
    for (std::size_t threads = 1; threads <= 8; ++threads) CHECK(thread_pool(threads).concurrency() == threads);
    CHECK(thread_pool().concurrency() == std::max(std::thread::hardware_concurrency(), 1U));
}

TEST_CASE("a pool runs every index exactly once") {
    for (std::size_t threads = 1; threads <= 8; ++threads) {
        thread_pool pool(threads);
        for (const std::size_t count : {0U, 1U, 2U, 7U, 100U, 1000U}) {
            std::vector<std::atomic<int>> times(count);
            pool.run(
                count, [](void* data, std::size_t i) { ++(*static_cast<std::vector<std::atomic<int>>*>(data))[i]; }, &times);
            for (const std::atomic<int>& t : times) REQUIRE(t == 1);
        }
    }
}

TEST_CASE("all threads of a pool, including the calling thread, work at the same time") {
    thread_pool pool(4);
    // Not std::barrier: MinGW's GCC 12 loses its wake-ups.
    struct meeting {
        std::thread::id caller = std::this_thread::get_id();
        std::mutex mutex;
        std::condition_variable changed;
        int arrivals = 0, callers = 0;

        void wait_for_all_four() {
            std::unique_lock lock(mutex);
            if (std::this_thread::get_id() == caller) ++callers;
            const int needed = arrivals++ / 4 * 4 + 4;
            changed.notify_all();
            changed.wait(lock, [&] { return arrivals >= needed; });
        }
    } shared;
    for (int repeat = 0; repeat < 20; ++repeat)
        pool.run(
            4, [](void* data, std::size_t) { static_cast<meeting*>(data)->wait_for_all_four(); }, &shared);
    CHECK(shared.callers == 20);
}

TEST_CASE("several threads can run work on one pool at the same time") {
    thread_pool pool(3);
    std::vector<std::vector<std::uint32_t>> results(4);
    std::vector<std::thread> callers;
    for (std::vector<std::uint32_t>& result : results)
        callers.emplace_back([&] {
            for (int repeat = 0; repeat < 20; ++repeat) result = filled(pool, 1000, 10);
        });
    for (std::thread& t : callers) t.join();
    serial_executor serial;
    for (const std::vector<std::uint32_t>& result : results) CHECK(result == filled(serial, 1000, 10));
}

TEST_CASE("parallel_for returns the same result on any executor with any number of threads") {
    const serial_executor serial;
    for (const std::size_t count : {0U, 1U, 5U, 64U, 1001U})
        for (const std::size_t grain : {0U, 1U, 7U, 64U, 5000U}) {
            const std::vector<std::uint32_t> expected = filled(serial, count, grain);
            for (std::size_t threads = 1; threads <= 8; ++threads) {
                thread_pool pool(threads);
                CHECK(filled(pool, count, grain) == expected);
                callers_executor own{threads};
                CHECK(filled(own, count, grain) == expected);
            }
        }
}

TEST_CASE("parallel_for cuts the range into consecutive pieces that are at least as long as the grain") {
    for (std::size_t threads = 1; threads <= 8; ++threads) {
        thread_pool pool(threads);
        for (std::size_t count = 0; count < 70; ++count)
            for (const std::size_t grain : {0U, 1U, 2U, 3U, 4U, 10U, 33U, 100U}) cuts_soundly(pool, count, grain);
    }
}

TEST_CASE("parallel_for runs on the caller's executor, unless the range is too short to share") {
    callers_executor own{3};
    filled(own, 1000, 10);
    CHECK(own.calls > 1);
    own.calls = 0;
    filled(own, 15, 10);
    filled(own, 0, 10);
    CHECK(own.calls == 0);
}

TEST_CASE("an exception reaches the caller after all calls have ended, and the pool remains usable") {
    for (std::size_t threads = 1; threads <= 8; ++threads) {
        thread_pool pool(threads);
        for (int repeat = 0; repeat < 5; ++repeat) {
            std::atomic<int> inside{0};
            const auto body = [&](std::size_t first, std::size_t last) {
                ++inside;
                const bool fails = first <= 500 && 500 < last;
                if (!fails) std::this_thread::sleep_for(std::chrono::milliseconds(2));  // still runs when the other piece fails
                --inside;
                if (fails) throw std::runtime_error("piece of 500");
            };
            REQUIRE_THROWS_WITH(parallel_for(pool, 1000, 1, body), "piece of 500");
            REQUIRE(inside == 0);
            serial_executor serial;
            REQUIRE(filled(pool, 300, 1) == filled(serial, 300, 1));
        }
    }
}

TEST_CASE("an exception never passes through the caller's executor") {
    callers_executor own{3};  // an exception that left one of its threads would terminate the program
    const auto body = [](std::size_t first, std::size_t last) {
        if (first <= 500 && 500 < last) throw std::runtime_error("piece of 500");
    };
    REQUIRE_THROWS_WITH(parallel_for(own, 1000, 1, body), "piece of 500");
    serial_executor serial;
    CHECK(filled(own, 300, 1) == filled(serial, 300, 1));
}

TEST_CASE("run() of a pool with one thread stops at the first call that throws, and rethrows its exception") {
    thread_pool pool(1);
    for (std::size_t last = 0; last < 10; ++last) {
        std::pair<std::size_t, std::size_t> calls_and_last{0, last};
        const auto call = [](void* data, std::size_t i) {
            auto& [calls, throwing] = *static_cast<std::pair<std::size_t, std::size_t>*>(data);
            ++calls;
            if (i >= throwing) throw std::runtime_error(std::to_string(i));
        };
        CHECK_THROWS_WITH(pool.run(10, call, &calls_and_last), std::to_string(last));
        CHECK(calls_and_last.first == last + 1);
    }
}

TEST_CASE("parallel_for skips the pieces after one that throws, and rethrows its exception") {
    const ordered_executor threads;
    std::size_t calls = 0;
    const auto body = [&](std::size_t first, std::size_t) {
        ++calls;
        if (first >= 500) throw std::runtime_error("piece " + std::to_string(calls));
    };
    CHECK_THROWS_WITH(parallel_for(threads, 1200, 1, body), "piece 6");  // twelve pieces of 100 indices
    CHECK(calls == 6);
}

TEST_CASE("the caller receives one exception even if every call throws") {
    thread_pool pool(4);
    const auto body = [](std::size_t, std::size_t) { raise(error_code::invalid_data, "row", "numbers", "letters"); };
    for (int repeat = 0; repeat < 50; ++repeat) REQUIRE_THROWS_AS(parallel_for(pool, 100, 1, body), ldi::error);
}

TEST_CASE("run_both calls each function once: in order on one thread, otherwise on the caller's executor") {
    std::string order;
    const serial_executor serial;
    detail::run_both(
        serial, [&] { order += "one "; }, [&] { order += "other"; });
    CHECK(order == "one other");
    for (const std::size_t count : {2U, 5U}) {
        callers_executor threads{count};
        int one = 0, other = 0;
        detail::run_both(
            threads, [&] { ++one; }, [&] { ++other; });
        CHECK(threads.calls == 2);
        CHECK((one == 1 && other == 1));
    }
    thread_pool pool(2);
    CHECK_THROWS_WITH(detail::run_both(
                          pool, [] {}, [] { throw std::runtime_error("other"); }),
                      "other");
}
