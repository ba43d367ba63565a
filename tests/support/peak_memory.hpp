// Peak memory of a call, including allocations of libraries.
#pragma once

#if defined(__linux__)
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#if defined(__SANITIZE_ADDRESS__)
#define LDI_TEST_COUNTS_BLOCKS
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define LDI_TEST_COUNTS_BLOCKS
#endif
#endif
#include <atomic>
#include <cstddef>
#include <optional>

#if defined(LDI_TEST_COUNTS_BLOCKS)
// From sanitizer/allocator_interface.h, which clang has and g++ does not.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void*, std::size_t),
                                                         void (*)(const volatile void*));
extern "C" std::size_t __sanitizer_get_allocated_size(const volatile void*);
#endif

namespace ldi::testing {

#if defined(__linux__)
inline constexpr bool measures_memory = true;
#else
inline constexpr bool measures_memory = false;
#endif

/// Whether resident memory is measured. Otherwise, allocated memory is measured, much of which libraries do not touch.
#if defined(LDI_TEST_COUNTS_BLOCKS)
inline constexpr bool measures_resident_memory = false;
#else
inline constexpr bool measures_resident_memory = measures_memory;
#endif

#if defined(LDI_TEST_COUNTS_BLOCKS)
inline std::atomic<long long> bytes_out{0}, max_bytes_out{0};

/// Counts allocated bytes. With the address sanitizer, resident memory is meaningless, because the sanitizer keeps freed memory.
inline void count_blocks() {
    __sanitizer_install_malloc_and_free_hooks(
        [](const volatile void*, std::size_t bytes) {
            const long long out = bytes_out += static_cast<long long>(bytes);
            long long most = max_bytes_out;
            while (out > most && !max_bytes_out.compare_exchange_weak(most, out)) {
            }
        },
        [](const volatile void* block) { bytes_out -= static_cast<long long>(__sanitizer_get_allocated_size(block)); });
}
#endif

#if defined(__linux__)
/// Bytes that a child process needs for a call; nothing if a signal ends the process.
template <class Call>
std::optional<double> peak_of_child(Call&& call) {
    int channel[2];
    if (pipe(channel) != 0) return std::nullopt;
    const pid_t child = fork();
    if (child == 0) {
#if defined(__GLIBC__)
        mallopt(M_MMAP_THRESHOLD, 1 << 16);  // returns freed memory at once
        mallopt(M_TRIM_THRESHOLD, 1 << 16);
#endif
#if defined(LDI_TEST_COUNTS_BLOCKS)
        count_blocks();
#endif
        try {
            call();
        } catch (...) {
        }
        double counted = 0;
#if defined(LDI_TEST_COUNTS_BLOCKS)
        counted = static_cast<double>(max_bytes_out);
#endif
        _exit(write(channel[1], &counted, sizeof counted) == sizeof counted ? 0 : 1);
    }
    close(channel[1]);
    int status = 0;
    rusage used = {};
    double counted = 0;
    const bool has_ended = child > 0 && wait4(child, &status, 0, &used) == child && status == 0 &&
                           read(channel[0], &counted, sizeof counted) == sizeof counted;
    close(channel[0]);
    if (!has_ended) return std::nullopt;
#if defined(LDI_TEST_COUNTS_BLOCKS)
    return counted;
#else
    return static_cast<double>(used.ru_maxrss) * 1024;
#endif
}
#endif

/// Bytes of memory that a call needs, beyond those of an empty call. The call runs in a child process, and may throw. Returns
/// nothing if the process ends by a signal, and 0 if memory is not measured.
template <class Call>
std::optional<double> peak_memory(Call&& call) {
#if defined(__linux__)
#if defined(__GLIBC__)
    malloc_trim(0);  // otherwise the child would reuse memory that was freed before
#endif
    const std::optional<double> before = peak_of_child([] {}), after = peak_of_child(call);
    if (!before || !after) return std::nullopt;
    return *after - *before;
#else
    try {
        call();
    } catch (...) {
    }
    return 0.0;
#endif
}

}  // namespace ldi::testing
