// SIGINT, SIGTERM and SIGHUP end the program at once and leave nothing unfinished behind. One thread waits for them: what it does
// then needs none of the care that signal handlers need.
#pragma once

#include "file_set.hpp"

#include <pthread.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <functional>
#include <mutex>
#include <thread>
#include <unordered_set>
#include <utility>

namespace ldi::examples {

/// The program that writes a file for us now, or 0.
inline std::atomic<pid_t> helping_process{0};

/// While it exists, a signal discards what is being written before it ends the program. To be made before other threads, which
/// are to leave signals to this one.
class interruption {
public:
    /// discard  called on a thread of its own while others work; nothing is to be written after it
    explicit interruption(std::function<void()> discard) : discard_(std::move(discard)) {
        std::signal(SIGPIPE, SIG_IGN);  // who does not read on shows in what write() returns
        sigemptyset(&signals_);
        sigaddset(&signals_, wake_up);
        for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
            struct sigaction now;
            // What is ignored from the start (nohup, a job in the background) stays so.
            if (sigaction(number, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) sigaddset(&signals_, number);
        }
        pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
        thread_ = std::thread([this] { wait(); });
    }
    interruption(const interruption&) = delete;
    interruption& operator=(const interruption&) = delete;
    ~interruption() {
        is_done_ = true;
        pthread_kill(thread_.native_handle(), wake_up);
        thread_.join();
    }

    /// Does not return where a signal came: what failed then failed because of it, and is not worth a word.
    void end_if_signaled() const {
        while (is_ending_) pause();
    }

private:
    static constexpr int wake_up = SIGUSR1;

    void wait() {
        int number = 0;
        while (sigwait(&signals_, &number) != 0) {
        }
        if (is_done_) return;
        is_ending_ = true;
        if (const pid_t helper = helping_process; helper > 0) kill(helper, SIGKILL);
        discard_();  // waits while files are put in their places
        std::signal(number, SIG_DFL);
        sigset_t this_one;
        sigemptyset(&this_one);
        sigaddset(&this_one, number);
        kill(getpid(), number);
        pthread_sigmask(SIG_UNBLOCK, &this_one, nullptr);
        for (;;) pause();
    }

    std::function<void()> discard_;
    sigset_t signals_;
    std::atomic<bool> is_ending_{false}, is_done_{false};
    std::thread thread_;
};

/// The sets of files that are being written. A signal discards all of them.
class sets_in_work {
public:
    void add(file_set& files) {
        const std::lock_guard lock(mutex_);
        sets_.insert(&files);
    }
    void remove(file_set& files) {
        const std::lock_guard lock(mutex_);
        sets_.erase(&files);
    }
    /// From here on nobody begins with another: the program ends.
    void discard() {
        mutex_.lock();
        for (file_set* files : sets_) files->discard();
    }

private:
    std::mutex mutex_;
    std::unordered_set<file_set*> sets_;
};

}  // namespace ldi::examples
