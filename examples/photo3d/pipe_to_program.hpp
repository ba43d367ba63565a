// Starts a program that reads from a pipe: ffmpeg, for videos. Not supported on Windows.
#pragma once

#include "interruption.hpp"

#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/system_error.hpp>

#if !defined(_WIN32)
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#if defined(_WIN32)

namespace ldi::examples {

inline std::optional<std::filesystem::path> find_program(const std::string&) { return std::nullopt; }

class pipe_to_program {
public:
    explicit pipe_to_program(const std::vector<std::string>& command) {
        raise(error_code::unsupported, command[0], "a system with POSIX pipes", "Windows");
    }
    void write(const image<std::uint8_t>&) {}
    void finish() {}
};

}  // namespace ldi::examples

#else

extern char** environ;

namespace ldi::examples {

/// Finds a program in the PATH, as the shell does.
inline std::optional<std::filesystem::path> find_program(const std::string& name) {
    const char* folders = std::getenv("PATH");
    const std::string all = folders == nullptr ? "" : folders;
    for (std::size_t first = 0; first <= all.size();) {
        const std::size_t last = std::min(all.find(':', first), all.size());
        const std::filesystem::path candidate = std::filesystem::path(all.substr(first, last - first)) / name;
        if (access(candidate.c_str(), X_OK) == 0) return candidate;
        first = last + 1;
    }
    return std::nullopt;
}

/// A program that reads from a pipe. Started without a shell, so that file names are never interpreted.
class pipe_to_program {
public:
    explicit pipe_to_program(std::vector<std::string> command) : name_(command[0]) {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) fail("a pipe");
        std::vector<char*> words;
        for (std::string& word : command) words.push_back(word.data());
        words.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
        posix_spawnattr_t attributes;  // resets signals to what a shell would set
        posix_spawnattr_init(&attributes);
        sigset_t none, piped;
        sigemptyset(&none), sigemptyset(&piped);
        sigaddset(&piped, SIGPIPE);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setsigdefault(&attributes, &piped);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
        const int failure = posix_spawnp(&process_, words[0], &actions, &attributes, words.data(), environ);
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&actions);
        close(ends[0]);
        input_ = ends[1];
        if (failure != 0) {
            close(input_);
            errno = failure;
            fail("a program that can be started");
        }
        helping_process = process_;
    }
    pipe_to_program(const pipe_to_program&) = delete;
    pipe_to_program& operator=(const pipe_to_program&) = delete;
    ~pipe_to_program() {
        if (input_ >= 0) wait();
    }

    void write(const image<std::uint8_t>& frame) {
        const std::uint8_t* data = frame.data();
        for (std::size_t left = frame.size(); left > 0;) {
            const ssize_t written = ::write(input_, data, left);
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) fail("a program that reads all frames");
            data += written, left -= static_cast<std::size_t>(written);
        }
    }

    /// Waits until the program ends. Raises unavailable if the program failed, usually because the disk is full. The program has
    /// then printed its own message.
    void finish() {
        const int status = wait();
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
            raise(error_code::unavailable, name_, "success", "a failure (see its message above)");
    }

private:
    int wait() {
        close(std::exchange(input_, -1));
        siginfo_t ended;
        while (waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
        }
        helping_process = 0;  // before the system can reuse the number
        int status = 0;
        while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
        }
        return status;
    }
    [[noreturn]] void fail(const char* expected) const {
        const int reason = errno;
        raise_system_error(reason, name_, expected);
    }

    std::string name_;
    int input_ = -1;
    pid_t process_ = 0;
};

}  // namespace ldi::examples

#endif
