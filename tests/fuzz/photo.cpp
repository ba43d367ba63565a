// libFuzzer: any bytes decode to a photo, with or without depth inside, or raise an error. Compile with
// clang++ -fsanitize=fuzzer,address,undefined.
#include <ldi/io/photo_depth.hpp>
#include <tests/support/files.hpp>

#include <cmath>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::byte* const first = reinterpret_cast<const std::byte*>(data);
    ldi::testing::byte_string bytes(first, first + size);
    // Corrects checksums. Otherwise, the reader would refuse damaged files before decoding them.
    if (ldi::detail::is_png(bytes)) bytes = ldi::testing::with_right_checksums(bytes);
    ldi::photo_options options;
    options.limits.max_pixels = std::size_t{1} << 20, options.limits.max_scanned_samples = 1 << 24;
    options.limits.max_memory = 200'000'000;
    options.long_side = size % 2 == 0 ? 0 : 16;
    try {
        const ldi::photo_with_depth found = ldi::decode_photo_with_depth(bytes, options);
        // The reader can estimate every file that it can decode. An error here ends the fuzzer.
        [&]() noexcept { ldi::estimate_photo_with_depth(bytes, options); }();
        if (!found.depth) return 0;
        for (const float v : found.depth->disparity)
            if (std::isinf(v) || (found.depth->is_inverse_depth && v <= 0)) std::abort();
    } catch (const ldi::error&) {
    }
    return 0;
}
