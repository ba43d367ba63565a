// AMX is rare, so its matrix product is tested three ways: on every machine with its tiles in software, with what compilers make
// of it wherever there is AVX-512 VNNI but no AMX, and on AMX itself by tests/kernels/gemm_u8.cpp.
#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <tests/support/emulated_tiles.hpp>
#include <tests/support/random_bytes.hpp>
#include <tests/support/trapped_tiles.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace {

constexpr std::uint8_t untouched = 77;

struct shape {
    std::size_t segments, inputs, outputs, pixels;
};

/// A product in buffers that end where the contract of gemm_u8() says.
struct product {
    shape size;
    std::size_t stride;
    ldi::gemm_u8_weights reference, tiled;
    ldi::buffer<ldi::buffer<std::uint8_t>> input;  // by segment
    std::vector<const std::uint8_t*> starts;

    product(ldi_test::random_bytes& random, const shape& s) : size(s), stride(s.inputs + random.size_in(0, 5)) {
        const auto weight_zero = static_cast<std::uint8_t>(random.in(127, 128)), input_zero = random.byte();
        const ldi::requantization output =
            ldi::make_requantization(0.0021F, random.in(0, 1) == 0 ? std::uint8_t{0} : random.byte());
        const ldi::buffer<std::uint8_t> weights = random.bytes(s.outputs * s.segments * s.inputs);
        const ldi::buffer<std::int32_t> bias = random.integers(s.outputs, -20000, 20000);
        reference = ldi::pack_gemm_u8(ldi::isa::scalar, weights, weight_zero, bias, s.segments, input_zero, output);
        // As pack_gemm_u8() does where there is AMX.
        tiled.segments = s.segments, tiled.inputs = s.inputs, tiled.outputs = s.outputs, tiled.output = output;
        tiled.target = ldi::detail::choose_target(ldi::isa::amx_int8, weights, weight_zero, bias, output, tiled.fast);
        REQUIRE(tiled.target == ldi::isa::amx_int8);
        ldi::detail::fold_zero_points(tiled, weights, weight_zero, bias, input_zero);
        ldi::detail::pack_tiles(tiled, weights, weight_zero);
        for (std::size_t i = 0; i < s.segments; ++i)
            input.push_back(random.bytes((s.pixels == 0 ? 0 : (s.pixels - 1) * stride + s.inputs) + 3));
        for (const ldi::buffer<std::uint8_t>& segment : input) starts.push_back(segment.data());
    }

    ldi::buffer<std::uint8_t> expected() const {
        ldi::buffer<std::uint8_t> result(size.pixels * size.outputs + 1, untouched);
        ldi::gemm_u8(reference, starts.data(), stride, size.pixels, result.data());
        return result;
    }

    void restrict_reads(ldi_test::tile_emulation& tiles) const {
        tiles.readable = {};
        std::size_t next = 0;
        for (const ldi::buffer<std::uint8_t>& segment : input) tiles.readable[next++] = {segment.data(), segment.size()};
        tiles.readable[next++] = {tiled.narrow.data(), tiled.narrow.size()};
        tiles.readable[next++] = {tiled.bias.data(), tiled.bias.size() * sizeof(std::int32_t)};
    }

    /// Whether the tiles in software give the same, without a fault.
    bool agrees_in_software() const {
        ldi::buffer<std::uint8_t> result(size.pixels * size.outputs + 1, untouched);
        ldi_test::emulated_tile_unit unit{tiled.fast, {result.data(), size.pixels * size.outputs}};
        restrict_reads(unit.hardware);
        ldi::detail::tiled_product(unit, tiled, starts.data(), stride).compute(size.pixels, result.data());
        if (unit.hardware.fault != nullptr) WARN(unit.hardware.fault);
        return unit.hardware.fault == nullptr && !unit.hardware.in_use() && result == expected();
    }
};

shape any_shape(ldi_test::random_bytes& random, int most_inputs, int most_outputs, int most_pixels) {
    return {random.size_in(1, 3), random.size_in(1, most_inputs), random.size_in(2, most_outputs),
            random.size_in(0, most_pixels)};
}

ldi_test::tile_emulation configured(const ldi::detail::tile_configuration& shapes) {
    ldi_test::tile_emulation tiles;
    tiles.load_configuration(&shapes);
    return tiles;
}

ldi::detail::tile_configuration two_by_two() {
    ldi::detail::tile_configuration shapes;
    for (std::size_t t = 0; t < 3; ++t) shapes.rows[t] = 2, shapes.row_bytes[t] = 8;
    return shapes;
}

bool is_fault(const ldi_test::tile_emulation& tiles, const std::string& kind) {
    return tiles.fault != nullptr && std::string(tiles.fault).rfind(kind, 0) == 0;
}

}  // namespace

TEST_CASE("the product in tiles breaks none of their rules and gives what scalar code does, for thousands of random shapes") {
    ldi_test::random_bytes random;
    std::size_t broken = 0;
    for (int round = 0; round < 3000; ++round) {
        const bool large = round % 50 == 0;
        broken += !product(random, any_shape(random, large ? 300 : 70, large ? 100 : 50, large ? 150 : 40)).agrees_in_software();
    }
    CHECK(broken == 0);
}

TEST_CASE("the product in tiles is right for every number of pixels, of inputs and of outputs around the tiles' sizes") {
    ldi_test::random_bytes random;
    std::size_t broken = 0;
    for (std::size_t pixels = 0; pixels <= 100; ++pixels) broken += !product(random, {1, 8, 2, pixels}).agrees_in_software();
    for (std::size_t inputs = 1; inputs <= 200; ++inputs) broken += !product(random, {1, inputs, 2, 3}).agrees_in_software();
    for (std::size_t outputs = 2; outputs <= 100; ++outputs) broken += !product(random, {2, 5, outputs, 3}).agrees_in_software();
    CHECK(broken == 0);
}

TEST_CASE("inputs are cut into equal tiles that hold each of them, whole groups of four, and nothing behind the padding") {
    for (std::size_t inputs = 1; inputs <= 600; ++inputs) {
        const ldi::detail::tile_inputs cut(inputs);
        const std::size_t padded = (inputs + 3) / 4 * 4;
        bool sound = cut.tiles == (inputs + 63) / 64 && cut.bytes % 4 == 0 && cut.bytes >= 4 && cut.bytes <= 64;
        for (std::size_t tile = 0; tile < cut.tiles; ++tile) {
            sound = sound && cut.first(tile) % 4 == 0 && cut.first(tile) <= cut.first_new(tile);
            sound = sound && cut.first(tile) + cut.bytes <= padded;
            if (tile > 0) sound = sound && cut.first(tile) <= cut.first(tile - 1) + cut.bytes;
        }
        CHECK((sound && cut.first(0) == 0 && cut.first(cut.tiles - 1) + cut.bytes == padded));
    }
}

TEST_CASE("full tiles take one product for 16 x 64 x 16 multiplications") {
    ldi_test::random_bytes random;
    const product p(random, {1, 128, 32, 64});
    ldi::buffer<std::uint8_t> result(64 * 32);
    ldi_test::emulated_tile_unit unit{p.tiled.fast, {result.data(), result.size()}};
    ldi::detail::tiled_product(unit, p.tiled, p.starts.data(), p.stride).compute(64, result.data());
    CHECK(unit.products == 64 * 128 * 32 / (16 * 64 * 16));
}

TEST_CASE("tiles in software fault on what the processor does: configurations") {
    using configuration = ldi::detail::tile_configuration;
    CHECK(configured(two_by_two()).fault == nullptr);
    const auto faults = [](void (*change)(configuration&)) {
        configuration shapes = two_by_two();
        change(shapes);
        return is_fault(configured(shapes), "#GP");
    };
    CHECK(faults([](configuration& c) { c.palette = 2; }));
    CHECK(faults([](configuration& c) { c.reserved[0] = 1; }));
    CHECK(faults([](configuration& c) { c.reserved[13] = 1; }));
    CHECK(faults([](configuration& c) { c.rows[0] = 17; }));
    CHECK(faults([](configuration& c) { c.row_bytes[0] = 65; }));
    CHECK(faults([](configuration& c) { c.row_bytes[0] = 256 + 8; }));
    CHECK(faults([](configuration& c) { c.rows[0] = 0; }));
    CHECK(faults([](configuration& c) { c.row_bytes[2] = 0; }));
    CHECK(faults([](configuration& c) { c.rows[8] = 1; }));
    CHECK(faults([](configuration& c) { c.row_bytes[15] = 4; }));
}

TEST_CASE("tiles in software fault on what the processor does: products, loads and stores") {
    using configuration = ldi::detail::tile_configuration;
    std::uint8_t memory[64] = {};
    const auto product_of = [](const configuration& shapes, std::size_t sums, std::size_t a, std::size_t b) {
        ldi_test::tile_emulation tiles = configured(shapes);
        tiles.multiply_bytes(sums, a, b);
        return tiles;
    };
    configuration shapes = two_by_two();
    CHECK(product_of(shapes, 0, 1, 2).fault == nullptr);
    CHECK(is_fault(product_of(shapes, 0, 0, 2), "#UD"));
    CHECK(is_fault(product_of(shapes, 0, 1, 1), "#UD"));
    CHECK(is_fault(product_of(shapes, 0, 1, 0), "#UD"));
    CHECK(is_fault(product_of(shapes, 0, 1, 3), "#UD"));
    for (std::size_t t = 0; t < 3; ++t) {
        shapes = two_by_two(), shapes.rows[t] = 1;
        CHECK(is_fault(product_of(shapes, 0, 1, 2), "#UD"));
        shapes = two_by_two(), shapes.row_bytes[t] = 7;
        CHECK(is_fault(product_of(shapes, 0, 1, 2), "#UD"));
        shapes = two_by_two(), shapes.row_bytes[t] = 4;
        CHECK(is_fault(product_of(shapes, 0, 1, 2), "#UD"));
    }
    ldi_test::tile_emulation tiles;
    tiles.load_rows(0, memory, 8);
    CHECK(is_fault(tiles, "#UD"));  // nothing is configured
    tiles = configured(two_by_two());
    tiles.store_rows(5, memory, 8);
    CHECK(is_fault(tiles, "#UD"));  // this tile is not
    tiles = configured(two_by_two());
    tiles.release_tiles();
    tiles.load_rows(0, memory, 8);
    CHECK(is_fault(tiles, "#UD"));
    tiles = configured(two_by_two());
    tiles.readable[0] = {memory, 15};
    tiles.load_rows(0, memory, 7);
    CHECK(tiles.fault == nullptr);
    tiles.load_rows(0, memory, 8);
    CHECK(is_fault(tiles, "#PF"));  // one byte behind the last
}

TEST_CASE("tiles in software load rows, multiply unsigned by signed bytes, wrap around, and store") {
    ldi::detail::tile_configuration shapes;
    shapes.rows[0] = 1, shapes.row_bytes[0] = 8;  // sums: 1 x 2
    shapes.rows[1] = 1, shapes.row_bytes[1] = 4;  // one group of four
    shapes.rows[2] = 1, shapes.row_bytes[2] = 8;
    ldi_test::tile_emulation tiles = configured(shapes);
    const std::uint8_t pixels[] = {255, 1, 2, 3};
    const std::int8_t weights[] = {-128, 0, 0, 0, 1, 2, 3, -4};
    std::int32_t sums[] = {-2147483647, 10};
    tiles.load_rows(0, sums, 0);
    tiles.load_rows(1, pixels, 0);
    tiles.load_rows(2, weights, 0);
    tiles.multiply_bytes(0, 1, 2);
    tiles.store_rows(0, sums, 0);
    CHECK(tiles.fault == nullptr);
    CHECK(sums[0] == 2147483647 - 32640 + 2);
    CHECK(sums[1] == 10 + 255 + 2 + 6 - 12);
}

TEST_CASE("where matrix products are packed for AMX, everything else is for AVX-512 VNNI") {
    ldi_test::random_bytes random;
    const ldi::requantization output = ldi::make_requantization(0.0021F, 7);
    const ldi::buffer<std::uint8_t> weights = random.bytes(9 * 20);
    const ldi::buffer<std::int32_t> one_bias{3}, bias(20, 3);
    const auto packed = [&](std::span<const std::int32_t> any_bias) {
        return ldi::pack_gemm_u8(ldi::isa::amx_int8, weights, 128, any_bias, 1, 5, output).target;
    };
    CHECK(packed(bias) == ldi::isa::amx_int8);
    CHECK(packed(one_bias) == ldi::isa::avx512vnni);  // a single output
    CHECK(ldi::pack_depthwise_u8(ldi::isa::amx_int8, weights, 128, bias, 1, 5, output).target == ldi::isa::avx512vnni);
    const ldi::buffer<float> real_weights(9 * 20, 0.5F), real_bias(20, 1.0F);
    CHECK(ldi::pack_conv_f32(ldi::isa::amx_int8, real_weights, real_bias, 3, {}).target == ldi::isa::avx512vnni);
    if (!ldi::is_available(ldi::isa::avx512vnni)) return;  // preparing an addition adds
    const ldi::quantized_addition sum = ldi::make_quantized_addition({0.05001F, 3}, {0.07003F, 4}, {0.09007F, 5});
    CHECK(ldi::prepare_add_u8(ldi::isa::amx_int8, sum).target == ldi::isa::avx512vnni);
}

#if LDI_HAS_AMX_KERNELS
TEST_CASE("what the compiler made of the AMX kernel gives what scalar code does, instruction by instruction") {
    const bool lacks_amx = (ldi::detail::cpuid_leaf(7).d >> 24U & 3U) == 0;
    if (!lacks_amx || !ldi::is_available(ldi::isa::avx512vnni)) {
        WARN("skipped: needs a processor with AVX-512 VNNI and without AMX");
        return;
    }
    ldi_test::random_bytes random;
    std::size_t broken = 0;
    for (int round = 0; round < 300; ++round) {
        const product p(random, any_shape(random, 200, 100, 70));
        ldi::buffer<std::uint8_t> found(p.size.pixels * p.size.outputs + 1, untouched);
        const char* fault = nullptr;
        {
            ldi_test::trapped_tiles trapped;
            p.restrict_reads(trapped.tiles);
            ldi::amx::gemm_u8(p.tiled, p.starts.data(), p.stride, p.size.pixels, found.data());
            fault = trapped.tiles.in_use() ? "tiles stay in use" : trapped.tiles.fault;
            broken += p.size.pixels > 0 && trapped.products == 0;
        }
        if (fault != nullptr) WARN(fault);
        broken += fault != nullptr || found != p.expected();
    }
    CHECK(broken == 0);
}
#endif
