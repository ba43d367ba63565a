// SIGINT, SIGTERM and SIGHUP, or Ctrl-C on Windows, end the program immediately and leave no unfinished files. A separate
// thread waits for signals, so that the restrictions of signal handlers do not apply to the code that reacts to them.
#pragma once

#include "file_set.hpp"

#if defined(_WIN32)
#include "windows_api.hpp"
#else
#include <pthread.h>
#include <sys/types.h>
#include <unistd.h>
#endif

#include <atomic>
#include <csignal>
#include <functional>
#include <mutex>
#include <thread>
#include <unordered_set>
#include <utility>

namespace ldi::examples {

#if defined(_WIN32)

/// While this object exists, Ctrl-C and closing the console discard the unfinished files before they end the program. Only one
/// object may exist at a time.
class interruption {
public:
    /// discard  called on a separate thread while others work; must prevent all later writes
    explicit interruption(std::function<void()> discard) {
        discard_ = std::move(discard);
        SetConsoleCtrlHandler(&interruption::end, TRUE);
    }
    interruption(const interruption&) = delete;
    interruption& operator=(const interruption&) = delete;
    ~interruption() { SetConsoleCtrlHandler(&interruption::end, FALSE); }

    /// Does not return after Ctrl-C, because failures that Ctrl-C causes need no message.
    void end_if_signaled() const {
        while (is_ending_) Sleep(INFINITE);
    }

private:
    static BOOL WINAPI end(DWORD) {  // Windows calls it on a separate thread
        is_ending_ = true;
        discard_();  // waits while files are put in place
        ExitProcess(128 + SIGINT);
    }

    static inline std::function<void()> discard_;
    static inline std::atomic<bool> is_ending_{false};
};

#else

/// Process ID of the program (ffmpeg) that currently writes a file for this one, or 0.
inline std::atomic<pid_t> helping_process{0};

/// While this object exists, a signal discards the unfinished files before it ends the program. Create the object before other
/// threads start: they inherit its mask of blocked signals, so that only the object's own thread receives signals.
class interruption {
public:
    /// discard  called on a separate thread while others work; must prevent all later writes
    explicit interruption(std::function<void()> discard) : discard_(std::move(discard)) {
        sigemptyset(&signals_);
        sigaddset(&signals_, wake_up);
        for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
            struct sigaction now;
            // Signals that are ignored from the start (nohup, background jobs) stay ignored.
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

    /// Does not return after a signal, because failures that the signal causes need no message.
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
        discard_();  // waits while files are put in place
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

#endif

/// Sets of files that are being written. A signal discards all of them.
class active_sets {
public:
    void add(file_set& files) {
        const std::lock_guard lock(mutex_);
        sets_.insert(&files);
    }
    void remove(file_set& files) {
        const std::lock_guard lock(mutex_);
        sets_.erase(&files);
    }
    /// Discards all sets and blocks new ones, because the program ends.
    void discard() {
        mutex_.lock();
        for (file_set* files : sets_) files->discard();
    }

private:
    std::mutex mutex_;
    std::unordered_set<file_set*> sets_;
};

}  // namespace ldi::examples
