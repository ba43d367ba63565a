// Errors of libjpeg. libjpeg reports an error by calling a function that must not return; this one jumps back to the caller.
#pragma once

#include <ldi/base/config.hpp>

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Error manager of a compressor or decompressor. After an error, libjpeg jumps to `back`, which setjmp() has set. The function
/// that calls setjmp() must not have local objects with destructors.
struct jpeg_errors {
    jpeg_error_mgr base;  // first, so that a pointer to it can be cast to a pointer to jpeg_errors
    std::jmp_buf back;

    jpeg_error_mgr* start() {
        jpeg_std_error(&base);
        base.error_exit = [](j_common_ptr state) { std::longjmp(reinterpret_cast<jpeg_errors*>(state->err)->back, 1); };
        return &base;
    }
};

}}}  // namespace ldi::detail
