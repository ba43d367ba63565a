#include <ldi/kernels/add_u8.hpp>
#include <tests/support/random_bytes.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace {

ldi::quantized_addition any_addition(ldi::testing::random_bytes& random) {
    // Scales are not round numbers, because their ratios would cause many exact ties, which the float form rounds to even.
    const auto any = [&] { return ldi::quantization{static_cast<float>(random.in(50001, 799999)) * 1e-7F, random.byte()}; };
    return ldi::make_quantized_addition(any(), any(), any());
}

ldi::buffer<std::uint8_t> definition(const ldi::quantized_addition& sum, const ldi::buffer<std::uint8_t>& a,
                                     const ldi::buffer<std::uint8_t>& b) {
    ldi::buffer<std::uint8_t> result;
    for (std::size_t i = 0; i < a.size(); ++i) result.push_back(ldi::add_quantized(a[i], b[i], sum));
    return result;
}

}  // namespace

TEST_CASE("add_u8 matches its definition on every instruction set, for any count") {
    ldi::testing::random_bytes random;
    for (int round = 0; round < 60; ++round) {
        const ldi::quantized_addition exact = any_addition(random);
        for (ldi::isa set : ldi::testing::available_isas()) {
            const ldi::add_u8_constants sum = ldi::prepare_add_u8(set, exact);
            for (std::size_t count : {0U, 1U, 31U, 32U, 33U, 63U, 64U, 65U, 200U}) {
                const ldi::buffer<std::uint8_t> a = random.bytes(count), b = random.bytes(count);
                ldi::buffer<std::uint8_t> expected = definition(exact, a, b), found(count + 1, 77);
                expected.push_back(77);  // add_u8() must not write after the result
                ldi::add_u8(sum, a.data(), b.data(), count, found.data());
                CHECK(found == expected);
            }
        }
    }
}

TEST_CASE("add_u8 matches the integer form for all 65,536 pairs on every instruction set, and rarely needs that form") {
    ldi::testing::random_bytes random;
    for (ldi::isa set : ldi::testing::available_isas()) {
        int integer_forms = 0;
        std::size_t broken = 0;
        for (int round = 0; round < 40; ++round) {
            const ldi::quantized_addition exact = any_addition(random);
            const ldi::add_u8_constants sum = ldi::prepare_add_u8(set, exact);
            integer_forms += !sum->is_float && ldi::find_kernel(ldi::add_u8_kernels, set).has_float_form;
            ldi::buffer<std::uint8_t> b(256);
            for (std::size_t i = 0; i < 256; ++i) b[i] = static_cast<std::uint8_t>(i);
            for (std::size_t value = 0; value < 256; ++value) {
                const ldi::buffer<std::uint8_t> a(256, static_cast<std::uint8_t>(value));
                ldi::buffer<std::uint8_t> found(256);
                ldi::add_u8(sum, a.data(), b.data(), 256, found.data());
                broken += found != definition(exact, a, b);
            }
        }
        CHECK(broken == 0);
        CHECK(integer_forms <= 4);
    }
}

TEST_CASE("for any quantization, both the integer form and the float form of add_u8 match its definition") {
    ldi::testing::random_bytes random;
    ldi::buffer<std::uint8_t> a, b;
    for (int i = 0; i < 65536; ++i) {
        a.push_back(static_cast<std::uint8_t>(i / 256));
        b.push_back(static_cast<std::uint8_t>(i % 256));
    }
    for (int round = 0; round < 200; ++round) {
        // Includes extreme zero points of the result and extreme ratios. In every other round, scales have few significant
        // bits, which causes many ties.
        const auto scale = [&] {
            return round % 2 == 0 ? std::ldexp(static_cast<float>(random.in(1, 16)), random.in(-9, 0))
                                  : std::ldexp(static_cast<float>(random.in(50001, 99999)), random.in(-26, -10));
        };
        const auto zero_point = [&] {
            return round % 3 == 0 ? std::uint8_t{255} : round % 3 == 1 ? std::uint8_t{0} : random.byte();
        };
        const ldi::quantization x{scale(), zero_point()}, y{scale(), random.byte()}, z{scale(), zero_point()};
        if (!ldi::are_addition_ratios(x.scale / z.scale, y.scale / z.scale)) continue;
        const ldi::quantized_addition exact = ldi::make_quantized_addition(x, y, z);
        const ldi::buffer<std::uint8_t> expected = definition(exact, a, b);
        ldi::buffer<std::uint8_t> found(a.size());
        for (ldi::isa set : ldi::testing::available_isas()) {
            const ldi::isa existing = ldi::find_kernel(ldi::add_u8_kernels, set).set;
            ldi::add_u8_constants sum = ldi::detail::prepared_from(ldi::add_u8_data{existing, exact});
            ldi::add_u8(sum, a.data(), b.data(), a.size(), found.data());
            CHECK(found == expected);
            if (round % 10 > 1) continue;
            sum = ldi::prepare_add_u8(set, exact);
            CHECK(sum->target == existing);
            ldi::add_u8(sum, a.data(), b.data(), a.size(), found.data());
            CHECK(found == expected);
        }
    }
}

TEST_CASE("add_u8 can overwrite either input with the result") {
    ldi::testing::random_bytes random;
    const ldi::quantized_addition exact = any_addition(random);
    for (ldi::isa set : ldi::testing::available_isas()) {
        const ldi::add_u8_constants sum = ldi::prepare_add_u8(set, exact);
        const ldi::buffer<std::uint8_t> a = random.bytes(150), b = random.bytes(150), expected = definition(exact, a, b);
        ldi::buffer<std::uint8_t> first = a, second = b;
        ldi::add_u8(sum, first.data(), b.data(), 150, first.data());
        ldi::add_u8(sum, a.data(), second.data(), 150, second.data());
        CHECK(first == expected);
        CHECK(second == expected);
    }
}
