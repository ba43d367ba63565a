// libFuzzer: arbitrary bytes either decode to an 8-bit network that runs, or raise an error. Fused layers must produce the
// results of single layers. Compile with clang++ -fsanitize=fuzzer,address,undefined. The corpus is
// tests/fuzz/corpus/quantized_weights.
#include <ldi/io/weight_files.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

namespace {

// Memory limit of a run. Small files may request much more, which would be slow.
constexpr std::size_t max_bytes = std::size_t{1} << 21;

void run(const ldi::quantized_network& network, std::size_t height, std::size_t width) {
    if (network.working_bytes({height, width}, 1) > max_bytes) return;
    ldi::image<std::uint8_t> input(height, width, network.input_channels());
    for (std::size_t i = 0; i < input.size(); ++i) input.data()[i] = static_cast<std::uint8_t>(37 * i);
    ldi::serial_executor threads;
    const ldi::image<std::uint8_t> fused = network.run(input, threads);
    network.run_observed(input, threads, [&](std::size_t layer, std::string_view, const ldi::image<std::uint8_t>& tensor) {
        if (layer + 1 == network.layer_count() && !std::equal(fused.data(), fused.data() + fused.size(), tensor.data()))
            std::abort();
    });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);
    try {
        ldi::decode_tiefenrausch(bytes);
    } catch (const ldi::error&) {
    }
    try {  // also accepts files that are not depth networks
        const ldi::quantized_network network(ldi::read_quantized_network(ldi::decode_safetensors(bytes)));
        run(network, 32, 32);
        run(network, 5, 3);
    } catch (const ldi::error&) {
    }
    return 0;
}
