// libFuzzer: any bytes are a weight file or an error, and any weight file is an inpainting network or an error. Built by clang++
// -fsanitize=fuzzer,address,undefined; start from tests/fuzz/corpus/safetensors.
#include <ldi/formats/farbrausch_file.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

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
    return 0;
}
