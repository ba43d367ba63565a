// Tests the AVX-VNNI kernels on processors without AVX-VNNI: runs the compiled code, and emulates its only AVX-VNNI
// instruction. On processors with AVX-VNNI, the tests of each family run these kernels like all others.
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <tests/support/random_bytes.hpp>
#include <tests/support/trapped_dot_products.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

TEST_CASE("weights are packed for AVX-VNNI if requested and available") {
    if (!ldi::is_available(ldi::isa::avx_vnni)) return;
    ldi::testing::random_bytes random;
    const ldi::buffer<std::uint8_t> weights = random.bytes(9 * 20);
    const ldi::buffer<std::int32_t> bias(20, 3);
    const ldi::requantization output = ldi::make_requantization(0.0021F, 7);
    CHECK(ldi::pack_gemm_u8(ldi::isa::avx_vnni, weights, 128, bias, 1, 5, output)->target == ldi::isa::avx_vnni);
}

#if LDI_HAS_X86_KERNELS && defined(__x86_64__) && defined(__linux__)

namespace {

constexpr std::uint8_t untouched = 77;

bool can_be_emulated() {
    if (ldi::is_available(ldi::isa::avx2) && !ldi::is_available(ldi::isa::avx_vnni)) return true;
    WARN("skipped: needs a processor with AVX2 and without AVX-VNNI");
    return false;
}

/// Runs `compute` for this many values, returns the values, and sets `used` to whether it executed AVX-VNNI instructions.
template <class Value, class Compute>
std::vector<Value> emulated(std::size_t values, Compute compute, bool& used) {
    std::vector<Value> result(values + 1, Value{untouched});
    ldi::testing::trapped_dot_products trapped;
    compute(result.data());
    used = trapped.instructions > 0;
    return result;
}

}  // namespace

TEST_CASE("the compiled AVX-VNNI matrix product matches scalar code under emulation") {
    if (!can_be_emulated()) return;
    ldi::testing::random_bytes random;
    std::size_t broken = 0;
    for (int round = 0; round < 300; ++round) {
        const std::size_t segments = random.size_in(1, 3), inputs = random.size_in(1, 70), outputs = random.size_in(2, 40);
        const std::size_t pixels = random.size_in(1, 30), stride = inputs + random.size_in(0, 5);
        const ldi::buffer<std::uint8_t> weights = random.bytes(outputs * segments * inputs);
        const ldi::buffer<std::uint8_t> input = random.bytes(pixels * stride + 3);
        const ldi::buffer<std::int32_t> bias = random.integers(outputs, -20000, 20000);
        const std::vector<const std::uint8_t*> starts(segments, input.data());
        const ldi::requantization output = ldi::make_requantization(0.0021F, round % 2 == 0 ? std::uint8_t{0} : random.byte());
        const std::uint8_t weight_zero = random.byte(127, 128), input_zero = random.byte();
        const auto computed = [&](ldi::isa set, bool& used) {
            const ldi::isa existing = set == ldi::isa::avx_vnni ? ldi::isa::avx2 : set;
            ldi::gemm_u8_data data = *ldi::pack_gemm_u8(existing, weights, weight_zero, bias, segments, input_zero, output);
            REQUIRE(data.target == existing);
            if (set != existing) {  // the sets differ only in the order of the weights
                data.target = set, data.narrow.clear(), data.order.clear();
                ldi::avx_vnni::pack_gemm_u8(data, weights, weight_zero);
            }
            const ldi::gemm_u8_weights packed = ldi::detail::prepared_from(data);
            const auto compute = [&](std::uint8_t* to) { ldi::gemm_u8(packed, starts.data(), stride, pixels, to); };
            return emulated<std::uint8_t>(pixels * outputs, compute, used);
        };
        bool scalar_used = false, used = false;
        broken += computed(ldi::isa::avx_vnni, used) != computed(ldi::isa::scalar, scalar_used) || !used || scalar_used;
    }
    CHECK(broken == 0);
}

TEMPLATE_TEST_CASE("the compiled AVX-VNNI convolution of bytes matches scalar code under emulation", "", std::uint8_t, float) {
    if (!can_be_emulated()) return;
    ldi::testing::random_bytes random;
    std::size_t broken = 0;
    for (int round = 0; round < 200; ++round) {
        const std::size_t rows = random.size_in(1, 3), inputs = random.size_in(1, 40), outputs = random.size_in(1, 50);
        const std::size_t pixels = random.size_in(1, 30), stride = inputs + random.size_in(0, 5);
        ldi::buffer<std::int8_t> weights(outputs * rows * inputs);
        for (std::int8_t& w : weights) w = static_cast<std::int8_t>(random.in(-63, 63));
        const ldi::buffer<std::uint8_t> input = random.bytes(pixels * stride), zero_points = random.bytes(inputs);
        ldi::buffer<float> scales(outputs), bias(outputs), ratios(pixels);
        for (float& s : scales) s = static_cast<float>(random.in(1, 1000)) * 1e-5F;
        for (float& b : bias) b = static_cast<float>(random.in(-1000, 1000)) * 0.1F;
        for (float& r : ratios) r = static_cast<float>(random.in(1, 9));
        const std::vector<const std::uint8_t*> starts(rows, input.data());
        const auto computed = [&](ldi::isa set, bool& used) {
            const ldi::isa existing = set == ldi::isa::avx_vnni ? ldi::isa::avx2 : set;
            ldi::conv_u8_data data =
                *ldi::pack_conv_u8(existing, weights, zero_points, scales, bias, rows, ldi::leaky_relu(0.2F), 9);
            data.target = set;  // AVX-VNNI has the layout of AVX2
            const ldi::conv_u8_weights packed = ldi::detail::prepared_from(data);
            const auto compute = [&](TestType* to) {
                ldi::conv_u8(packed, starts.data(), stride, pixels, round % 2 == 0 ? nullptr : ratios.data(), to);
            };
            return emulated<TestType>(pixels * outputs, compute, used);
        };
        bool scalar_used = false, used = false;
        broken += computed(ldi::isa::avx_vnni, used) != computed(ldi::isa::scalar, scalar_used) || !used || scalar_used;
    }
    CHECK(broken == 0);
}

#endif
