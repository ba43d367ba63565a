// libFuzzer: any bytes decode to a weight file or raise an error, and any weight file decodes to an inpainting network or raises
// an error. The shipped network, in 8-bit arithmetic, inpaints any picture with any holes. Compile with clang++
// -fsanitize=fuzzer,address,undefined. The corpus is tests/fuzz/corpus/safetensors.
#include <ldi/io/weight_files.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

namespace {

/// Inpaints a picture. The bytes are its height, its width and its colors. The lowest bit of a pixel's first color value states
/// whether the pixel is known.
void inpaint_in_bytes(std::span<const std::byte> bytes) {
    static const ldi::farbrausch network =
        ldi::load_farbrausch(LDI_SOURCE_DIR "/examples/models/farbrausch.safetensors", ldi::arithmetic::int8);
    if (bytes.size() < 3) return;
    const auto byte = [&](std::size_t i) { return std::to_integer<std::uint8_t>(bytes[i % bytes.size()]); };
    ldi::image<std::uint8_t> color(1 + byte(0) % 16, 1 + byte(1) % 16, 3), known(color.height(), color.width(), 1);
    for (std::size_t i = 0; i < color.size(); ++i) color.data()[i] = byte(2 + i);
    for (std::size_t i = 0; i < known.size(); ++i) known.data()[i] = byte(2 + 3 * i) & 1;
    ldi::serial_executor threads;
    if (network.inpaint(color, known, {}, threads).size() != color.size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);
    try {
        ldi::decode_safetensors(bytes);
    } catch (const ldi::error&) {
    }
    try {
        const ldi::farbrausch network = ldi::decode_farbrausch(bytes);
        ldi::serial_executor threads;
        ldi::image<std::uint8_t> known(5, 6, 1, std::uint8_t{1});
        known(2, 3, 0) = 0;
        network.inpaint(ldi::image<std::uint8_t>(5, 6, 3, std::uint8_t{90}), known, {}, threads);
    } catch (const ldi::error&) {
    }
    try {
        inpaint_in_bytes(bytes);
    } catch (const ldi::error&) {
    }
    return 0;
}
