#include <ldi/kernels/gemm_u8.hpp>
#include <tests/support/random_bytes.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace {

constexpr std::uint8_t untouched_byte = 77;
constexpr int max_segments = ldi::gemm_u8_data::max_segments;

struct product {
    std::size_t segments, inputs, outputs, pixels, stride;
    int weight_zero, input_zero;
    ldi::buffer<std::uint8_t> weights, input;  // input: per segment, `pixels` pixels `stride` bytes apart, then 3 readable bytes
    ldi::buffer<std::int32_t> bias;
    ldi::requantization output;

    std::size_t segment_bytes() const { return (pixels == 0 ? 0 : (pixels - 1) * stride + inputs) + 3; }
    std::vector<const std::uint8_t*> starts() const {
        std::vector<const std::uint8_t*> result;
        for (std::size_t s = 0; s < segments; ++s) result.push_back(input.data() + s * segment_bytes());
        return result;
    }
    ldi::gemm_u8_weights pack(ldi::isa set) const {
        return ldi::pack_gemm_u8(set, weights, static_cast<std::uint8_t>(weight_zero), bias, segments,
                                 static_cast<std::uint8_t>(input_zero), output);
    }
    ldi::buffer<std::uint8_t> compute(const ldi::gemm_u8_weights& packed) const {
        ldi::buffer<std::uint8_t> result(pixels * outputs + 1, untouched_byte);
        ldi::gemm_u8(packed, starts().data(), stride, pixels, result.data());
        return result;
    }
    ldi::buffer<std::uint8_t> definition() const {
        ldi::buffer<std::uint8_t> result;
        for (std::size_t p = 0; p < pixels; ++p)
            for (std::size_t o = 0; o < outputs; ++o) {
                int sum = bias[o];
                for (std::size_t s = 0; s < segments; ++s)
                    for (std::size_t i = 0; i < inputs; ++i)
                        sum +=
                            (starts()[s][p * stride + i] - input_zero) * (weights[(o * segments + s) * inputs + i] - weight_zero);
                result.push_back(ldi::requantize(sum, output));
            }
        result.push_back(untouched_byte);  // gemm_u8() must not write after the result
        return result;
    }
};

product any_product(ldi::testing::random_bytes& random, std::size_t segments, std::size_t inputs, std::size_t outputs,
                    std::size_t pixels) {
    product made{segments, inputs, outputs, pixels, inputs + random.size_in(0, 5), 128, random.in(0, 255), {}, {}, {}, {}};
    made.output = ldi::make_requantization(0.0021F, random.in(0, 1) == 0 ? std::uint8_t{0} : random.byte());
    made.weights = random.bytes(outputs * segments * inputs);
    made.input = random.bytes(segments * made.segment_bytes());
    made.bias = random.integers(outputs, -20000, 20000);
    return made;
}

/// Returns the set for which weights are packed if `set` is requested: `set`, or its fallback if the outputs do not fill the
/// lanes of `set`.
ldi::isa expected_target(const product& p, ldi::isa set) {
    const bool fills_lanes = p.outputs >= ldi::find_kernel(ldi::gemm_u8_kernels, set).min_outputs;
    return fills_lanes ? set : ldi::find_instruction_set(set).otherwise;
}

}  // namespace

TEST_CASE("gemm_u8 matches the requantized product of the operands minus their zero points, for sizes around its tiles") {
    ldi::testing::random_bytes random;
    for (std::size_t outputs : {1U, 7U, 8U, 9U, 24U})
        for (std::size_t inputs : {1U, 3U, 8U, 27U, 100U})
            for (std::size_t pixels : {0U, 1U, 3U, 4U, 5U, 13U}) {
                product p = any_product(random, 1 + outputs % 3, inputs, outputs, pixels);
                p.weight_zero = random.in(0, 255);
                CHECK(p.compute(p.pack(ldi::isa::scalar)) == p.definition());
            }
}

TEST_CASE("gemm_u8 returns the same bits on every instruction set, for thousands of random shapes") {
    ldi::testing::random_bytes random;
    const std::vector<ldi::isa> sets = ldi::testing::available_isas();
    std::size_t broken = 0, packed_as_asked = 0;
    for (int round = 0; round < 2000; ++round) {
        product p =
            any_product(random, random.size_in(1, 3), random.size_in(1, 70), random.size_in(1, 90), random.size_in(0, 30));
        p.weight_zero = random.in(127, 128);
        const ldi::buffer<std::uint8_t> expected = p.compute(p.pack(ldi::isa::scalar));
        for (ldi::isa set : sets) {
            const ldi::gemm_u8_weights packed = p.pack(set);
            packed_as_asked += packed->target == expected_target(p, set);
            broken += p.compute(packed) != expected;
        }
    }
    CHECK(broken == 0);
    CHECK(packed_as_asked > sets.size() * 1990);
}

TEST_CASE("gemm_u8 returns the same bits on every instruction set for a single output with 1 to 199 inputs") {
    ldi::testing::random_bytes random;
    const std::vector<ldi::isa> sets = ldi::testing::available_isas();
    std::size_t broken = 0;
    for (std::size_t inputs = 1; inputs < 200; ++inputs) {
        product p = any_product(random, random.size_in(1, max_segments), inputs, 1, random.size_in(1, 40));
        p.weight_zero = random.in(127, 128);
        if (inputs % 2 == 0) p.output = ldi::make_requantization(0x1.fffffep-20F, 100);  // has no exact float form
        const ldi::buffer<std::uint8_t> expected = p.compute(p.pack(ldi::isa::scalar));
        for (ldi::isa set : sets) broken += p.compute(p.pack(set)) != expected;
    }
    CHECK(broken == 0);
}

TEST_CASE("gemm_u8 returns the same bits on every instruction set for long rows and for equal or overlapping windows") {
    ldi::testing::random_bytes random;
    for (int round = 0; round < 40; ++round) {
        const std::size_t inputs = round % 2 == 0 ? 16 * random.size_in(1, 8) : random.size_in(2, 100);
        product p = any_product(random, random.size_in(1, max_segments), inputs, random.size_in(2, 9), random.size_in(100, 1100));
        if (round % 4 >= 2) p.stride = random.size_in(0, static_cast<int>(inputs));
        if (round == 0) p.stride = 0;  // every pixel reads the same inputs
        const ldi::buffer<std::uint8_t> expected = p.compute(p.pack(ldi::isa::scalar));
        for (ldi::isa set : ldi::testing::available_isas()) CHECK((p.compute(p.pack(set)) == expected));
    }
}

TEST_CASE("weights and scales that an instruction set cannot represent exactly are packed for a slower set") {
    ldi::testing::random_bytes random;
    for (ldi::isa set : ldi::testing::available_isas()) {
        const bool is_neon = set == ldi::isa::neon_dot_product,
                   is_signed = set == ldi::isa::avx_vnni || set == ldi::isa::avx512vnni;
        product wide = any_product(random, 1, 40, 20, 10);
        for (int zero : {0, 100, 126, 129, 255}) {
            wide.weight_zero = zero;
            const ldi::gemm_u8_weights packed = wide.pack(set);
            CHECK(packed->target == (is_neon ? ldi::isa::scalar : is_signed ? ldi::isa::avx2 : set));
            CHECK(wide.compute(packed) == wide.definition());
        }
        product fine = any_product(random, 1, 400, 20, 10);
        fine.output = ldi::make_requantization(0x1.fffffep-20F, 100);  // has no exact float form
        const bool can_round_integers = is_neon || set == ldi::isa::wasm_simd128;
        CHECK(fine.pack(set)->target == (can_round_integers ? set : ldi::isa::scalar));
        CHECK(fine.compute(fine.pack(set)) == fine.definition());
    }
}

TEST_CASE("gemm_u8 rounds correctly on both sides of every requantization threshold, on every instruction set") {
    ldi::testing::random_bytes random;
    for (int round = 0; round < 60; ++round) {
        const float scale = std::ldexp(static_cast<float>(random.in(1 << 23, (1 << 24) - 1)), -24 - round % 6);
        const ldi::requantization r = ldi::make_requantization(scale, round % 4 == 0 ? std::uint8_t{0} : random.byte());
        ldi::buffer<std::int32_t> sums = ldi::detail::requantization_checkpoints(r);
        // Removes the first two checkpoints, which are the ends of int32's range.
        sums.erase(sums.begin(), sums.begin() + 2);
        ldi::buffer<std::uint8_t> expected;
        for (std::int32_t sum : sums) expected.push_back(ldi::requantize(sum, r));
        // All weights equal their zero point, so that only the bias remains.
        const ldi::buffer<std::uint8_t> weights(sums.size(), 128), input(4);
        const std::uint8_t* const start = input.data();
        for (ldi::isa set : ldi::testing::available_isas()) {
            ldi::buffer<std::uint8_t> found(sums.size());
            ldi::gemm_u8(ldi::pack_gemm_u8(set, weights, 128, sums, 1, 0, r), &start, 1, 1, found.data());
            CHECK(found == expected);
        }
    }
}

TEST_CASE("gemm_u8 requantizes exactly with the constants of layers that have no exact unfused float form") {
    ldi::testing::random_bytes random;
    for (const ldi::requantization& r : {ldi::requantization{2061549696, 10, 0}, {1242206464, 11, 114}, {1313785600, 9, 0}}) {
        CHECK(!ldi::find_unfused_requantization(r).has_value());
        product p = any_product(random, 3, 192, 20, 30);
        p.weight_zero = 128;
        p.output = r;
        for (ldi::isa set : ldi::testing::available_isas()) {
            if (set == ldi::isa::wasm_simd128) CHECK(p.pack(set)->target == set);
            CHECK(p.compute(p.pack(set)) == p.definition());
        }
    }
}

TEST_CASE("gemm_u8 does not overflow at its documented limit of inputs") {
    const std::size_t inputs = 16000;  // 510 * 255 * 16000 < 2^31
    const ldi::buffer<std::uint8_t> weights(inputs, 0), input(inputs + 3, 0);
    const std::uint8_t* const start = input.data();
    const ldi::buffer<std::int32_t> bias{60000000};
    const ldi::requantization r = ldi::make_requantization(0x1p-24F, 0);
    for (ldi::isa set : ldi::testing::available_isas()) {
        std::uint8_t found = 0;
        ldi::gemm_u8(ldi::pack_gemm_u8(set, weights, 255, bias, 1, 255, r), &start, inputs, 1, &found);
        CHECK(found == ldi::requantize(255 * 255 * 16000 + 60000000, r));
        CHECK(found == 66);
    }
}

TEST_CASE("gemm_u8 does not saturate intermediate sums of the largest products on any instruction set") {
    for (ldi::isa set : ldi::testing::available_isas())
        for (std::uint8_t weight : {std::uint8_t{0}, std::uint8_t{255}}) {
            const ldi::buffer<std::uint8_t> weights(64, weight), input(67, 255);
            const std::uint8_t* const start = input.data();
            const ldi::requantization r = ldi::make_requantization(0x1.6p-15F, 128);
            std::uint8_t found = 0;
            ldi::gemm_u8(ldi::pack_gemm_u8(set, weights, 128, ldi::buffer<std::int32_t>{0}, 1, 0, r), &start, 64, 1, &found);
            CHECK(found == ldi::requantize(64 * 255 * (weight - 128), r));
        }
}

TEST_CASE("gemm_u8 returns the same bits on every instruction set for extreme weights and inputs") {
    ldi::testing::random_bytes random;
    std::size_t broken = 0;
    for (int round = 0; round < 200; ++round) {
        product p = any_product(random, 1, random.size_in(1, 40), random.size_in(2, 40), 5);
        p.weight_zero = round % 4 == 0 ? random.in(0, 255) : random.in(127, 128);
        p.output = ldi::make_requantization(0.0004F, 128);
        for (std::uint8_t& weight : p.weights) weight = random.in(0, 1) == 0 ? 0 : 255;
        for (std::uint8_t& value : p.input) value = random.in(0, 5) == 0 ? random.byte() : 255;
        const ldi::buffer<std::uint8_t> expected = p.compute(p.pack(ldi::isa::scalar));
        for (ldi::isa set : ldi::testing::available_isas()) broken += p.compute(p.pack(set)) != expected;
    }
    CHECK(broken == 0);
}
