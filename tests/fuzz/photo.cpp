// libFuzzer: any bytes are a photo or an error. Built by clang++ -fsanitize=fuzzer,address,undefined.
#include <ldi/formats/photo.hpp>
#include <tests/formats/support.hpp>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::byte* const first = reinterpret_cast<const std::byte*>(data);
    ldi::test::byte_string bytes(first, first + size);
    if (ldi::detail::is_png(bytes)) bytes = ldi::test::with_right_checksums(bytes);  // or no damage would reach the decoder
    try {
        ldi::decode_photo(bytes, {.limits = {.max_pixels = std::size_t{1}} << 20});
    } catch (const ldi::error&) {
    }
    return 0;
}
