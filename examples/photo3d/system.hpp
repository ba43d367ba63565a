// Functions of the operating system, except for files (file_system.hpp) and signals (interruption.hpp): the program's command
// line and path, standard input and output, memory, and processor time.
#pragma once

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#if defined(_WIN32)
#include "windows_api.hpp"

#include <fcntl.h>
#include <io.h>
#include <psapi.h>
#include <shellapi.h>
#else
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#endif

namespace ldi::examples {

/// The words of the command line in UTF-8.
class command_line {
public:
    command_line(int count, char** values) : count_(count), values_(values) {
#if defined(_WIN32)
        wchar_t** const words = CommandLineToArgvW(GetCommandLineW(), &count_);
        for (int i = 0; i < count_; ++i) words_.push_back(std::filesystem::path(words[i]).u8string());
        LocalFree(words);
        for (std::u8string& word : words_) pointers_.push_back(reinterpret_cast<char*>(word.data()));
        pointers_.push_back(nullptr);
        values_ = pointers_.data();
#endif
    }
    command_line(const command_line&) = delete;
    command_line& operator=(const command_line&) = delete;

    int count() const { return count_; }
    char** values() const { return values_; }

private:
    int count_;
    char** values_;
#if defined(_WIN32)
    std::vector<std::u8string> words_;
    std::vector<char*> pointers_;
#endif
};

/// Makes writing to a closed pipe fail instead of ending the program. On Windows, switches standard streams to binary mode, and
/// the console to UTF-8.
inline void prepare_standard_streams() {
#if defined(_WIN32)
    for (const int number : {0, 1, 2}) _setmode(number, _O_BINARY);
    SetConsoleOutputCP(CP_UTF8);
#else
    std::signal(SIGPIPE, SIG_IGN);
#endif
}

/// Whether a standard stream is a terminal: stdin, stdout or stderr.
inline bool is_terminal(std::FILE* stream) {
#if defined(_WIN32)
    return _isatty(_fileno(stream)) != 0;
#else
    return ::isatty(::fileno(stream)) == 1;
#endif
}

/// Reads at least one byte from standard input. Returns the number of bytes, 0 at the end of the input, or -1 after a failure,
/// with errno set.
inline std::ptrdiff_t read_standard_input(std::span<std::byte> bytes) {
#if defined(_WIN32)
    return _read(0, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), std::size_t{1} << 20)));
#else
    std::ptrdiff_t got = 0;
    do got = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    while (got < 0 && errno == EINTR);
    return got;
#endif
}

/// Writes all bytes to standard output. Returns 0 or an error number.
inline int write_standard_output(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
#if defined(_WIN32)
        const std::ptrdiff_t written =
            _write(1, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), std::size_t{1} << 20)));
#else
        const std::ptrdiff_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
#endif
        if (written < 0) return errno;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return 0;
}

/// Returns the path of the running program.
///
/// command  the command that started the program, for systems that do not report the path. On these, the result is wrong if the
///          shell found the program in the PATH
inline std::filesystem::path path_of_program(const char* command) {
#if defined(_WIN32)
    std::wstring path(32768, L'\0');
    path.resize(GetModuleFileNameW(nullptr, path.data(), static_cast<DWORD>(path.size())));
    if (!path.empty()) return path;
#else
    std::error_code unknown;
    if (std::filesystem::path path = std::filesystem::read_symlink("/proc/self/exe", unknown); !unknown) return path;
#endif
    return std::filesystem::absolute(command);
}

/// Processor time of the calling thread in milliseconds.
inline double processor_time_of_thread() {
#if defined(_WIN32)
    FILETIME ignored, kernel, user;  // in steps of 100 ns
    if (GetThreadTimes(GetCurrentThread(), &ignored, &ignored, &kernel, &user) == 0) return 0;
    const auto milliseconds = [](const FILETIME& t) { return 1e-4 * (4294967296.0 * t.dwHighDateTime + t.dwLowDateTime); };
    return milliseconds(kernel) + milliseconds(user);
#else
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
#endif
}

#if defined(_WIN32)
inline PROCESS_MEMORY_COUNTERS memory_counters() {
    PROCESS_MEMORY_COUNTERS counters{};
    GetProcessMemoryInfo(GetCurrentProcess(), &counters, sizeof counters);
    return counters;
}
#endif

/// Returns the memory of this process in bytes; 0 if the system does not report it.
inline std::size_t memory_in_use() {
#if defined(_WIN32)
    return memory_counters().WorkingSetSize;
#else
    unsigned long all = 0, resident = 0;
    std::FILE* const facts = std::fopen("/proc/self/statm", "r");
    if (facts == nullptr) return 0;
    if (std::fscanf(facts, "%lu %lu", &all, &resident) != 2) resident = 0;
    std::fclose(facts);
    return static_cast<std::size_t>(resident) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
#endif
}

/// Peak memory of this process in bytes.
inline std::size_t peak_memory() {
#if defined(_WIN32)
    return memory_counters().PeakWorkingSetSize;
#else
    std::ifstream facts("/proc/self/status");  // getrusage() would include the program that started this one
    for (std::string name; facts >> name; std::getline(facts, name)) {
        std::size_t kilobytes = 0;
        if (name == "VmHWM:" && facts >> kilobytes) return kilobytes * 1024;
    }
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
#endif
}

/// Returns the smallest number of bytes in the files and `otherwise`. Ignores files that are missing or hold no number, such as
/// "max".
inline std::size_t smallest_limit(std::size_t otherwise, const std::vector<std::filesystem::path>& files) {
    for (const std::filesystem::path& file : files) {
        std::size_t limit = 0;
        if (std::ifstream(file) >> limit) otherwise = std::min(otherwise, limit);
    }
    return otherwise;
}

/// Returns the files with the memory limits of this process's control group and of the groups that contain it.
///
/// groups  the text of /proc/self/cgroup: lines of NUMBER:CONTROLLERS:PATH; cgroup v2 has the number 0 and no controllers
inline std::vector<std::filesystem::path> files_of_limits(std::istream& groups) {
    std::vector<std::filesystem::path> files;
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const bool is_v2 = line.compare(0, second, "0:") == 0;
        if (!is_v2 && ("," + line.substr(first + 1, second - first - 1) + ",").find(",memory,") == std::string::npos) continue;
        const std::filesystem::path root = is_v2 ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
        const char* const name = is_v2 ? "memory.max" : "memory.limit_in_bytes";
        files.push_back(root / name);
        std::filesystem::path folder = root;
        for (const std::filesystem::path& part : std::filesystem::path(line.substr(second + 1)).relative_path())
            files.push_back((folder /= part) / name);
    }
    return files;
}

/// Memory of the machine in bytes, or the limit of the container in which the program runs, if that is smaller.
inline std::size_t available_memory() {
#if defined(_WIN32)
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof status;
    GlobalMemoryStatusEx(&status);
    return static_cast<std::size_t>(status.ullTotalPhys);
#else
    std::ifstream groups("/proc/self/cgroup");
    return smallest_limit(static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)),
                          files_of_limits(groups));
#endif
}

}  // namespace ldi::examples
