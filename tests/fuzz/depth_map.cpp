// libFuzzer: any bytes decode to a depth map or raise an error. Compile with clang++ -fsanitize=fuzzer,address,undefined.
#include <ldi/io/depth_map.hpp>
#include <tests/support/files.hpp>

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::byte* const first = reinterpret_cast<const std::byte*>(data);
    ldi::testing::byte_string bytes(first, first + size);
    // Corrects checksums. Otherwise, the reader would refuse damaged files before decoding them.
    if (ldi::detail::is_png(bytes)) bytes = ldi::testing::with_right_checksums(bytes);
    try {
        ldi::depth_map_options options;
        options.limits.max_pixels = std::size_t{1} << 20;
        options.kind = size % 2 == 0 ? ldi::depth_map_kind::disparity : ldi::depth_map_kind::meters;
        options.white_is_near = size % 4 < 2;
        const ldi::image<float> map = ldi::fill_invalid(ldi::decode_depth_map(bytes, options));
        for (float v : map)
            if (!std::isfinite(v)) std::abort();
    } catch (const ldi::error&) {
    }
    return 0;
}
