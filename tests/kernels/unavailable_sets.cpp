// Tests that packing for an instruction set that this processor lacks raises an error. Kernels of this set would execute an
// illegal instruction.
#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <tests/support/random_bytes.hpp>

#include <catch2/catch.hpp>

#include <cstdint>

namespace {

/// Checks that packing succeeds for every available set that has a kernel in the table, and raises an error for every set that
/// this processor lacks.
template <class Table, class Pack>
void pack_for_all(const Table& table, const Pack& pack) {
    for (const auto& kernel : table) {
        INFO("instruction set " << std::string(to_string(kernel.set)));
        if (ldi::is_available(kernel.set)) CHECK(pack(kernel.set)->target == kernel.set);
    }
    for (const ldi::instruction_set& set : ldi::instruction_sets) {
        INFO("instruction set " << std::string(set.name));
        if (!ldi::is_available(set.id)) CHECK_THROWS_AS(pack(set.id), ldi::error);
    }
}

}  // namespace

TEST_CASE("packing for an instruction set that the processor lacks raises an error in every family") {
    const ldi::buffer<std::uint8_t> weights(9 * 20, 130), zero_points(9, 128);
    const ldi::buffer<std::int8_t> signed_weights(9 * 20, 1);
    const ldi::buffer<float> float_weights(9 * 20, 1.0F), scales(20, 1.0F);
    const ldi::buffer<std::int32_t> bias(20, 3);
    const ldi::requantization output = ldi::make_requantization(0.0021F, 7);
    const ldi::quantized_addition sum = ldi::make_quantized_addition({1.0F, 0}, {1.0F, 0}, {1.0F, 0});
    pack_for_all(ldi::gemm_u8_kernels, [&](ldi::isa set) { return ldi::pack_gemm_u8(set, weights, 128, bias, 1, 5, output); });
    pack_for_all(ldi::depthwise_u8_kernels,
                 [&](ldi::isa set) { return ldi::pack_depthwise_u8(set, weights, 128, bias, 1, 5, output); });
    pack_for_all(ldi::add_u8_kernels, [&](ldi::isa set) { return ldi::prepare_add_u8(set, sum); });
    pack_for_all(ldi::conv_f32_kernels,
                 [&](ldi::isa set) { return ldi::pack_conv_f32(set, float_weights, scales, 1, ldi::relu); });
    pack_for_all(ldi::conv_u8_kernels, [&](ldi::isa set) {
        return ldi::pack_conv_u8(set, signed_weights, zero_points, scales, scales, 1, ldi::relu, 0);
    });
}
