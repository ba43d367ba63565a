// The memory that a call takes at its peak, whoever allocates it: libraries, too.
#pragma once

#if defined(__linux__)
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <optional>

namespace ldi::testing {

// Sanitizers keep what has been freed.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool measures_memory = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
inline constexpr bool measures_memory = false;
#else
inline constexpr bool measures_memory = true;
#endif
#elif defined(__linux__)
inline constexpr bool measures_memory = true;
#else
inline constexpr bool measures_memory = false;
#endif

#if defined(__linux__)
namespace detail {
template <class Call>
std::optional<double> peak_of_child(Call&& call) {
    const pid_t child = fork();
    if (child == 0) {
        try {
            call();
        } catch (...) {
        }
        _exit(0);
    }
    int status = 0;
    rusage used = {};
    if (child < 0 || wait4(child, &status, 0, &used) != child || status != 0) return std::nullopt;
    return static_cast<double>(used.ru_maxrss) * 1024;
}
}  // namespace detail
#endif

/// Bytes of resident memory, of a child process, beyond those of one that does nothing. The call may throw; nothing where it ends
/// by a signal. 0 where memory is not measured.
template <class Call>
std::optional<double> peak_memory(Call&& call) {
#if defined(__linux__)
    const std::optional<double> before = detail::peak_of_child([] {}), after = detail::peak_of_child(call);
    if (!before || !after) return std::nullopt;
    return measures_memory ? *after - *before : 0.0;
#else
    try {
        call();
    } catch (...) {
    }
    return 0.0;
#endif
}

}  // namespace ldi::testing
