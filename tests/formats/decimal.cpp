#include <ldi/formats/detail/decimal.hpp>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace {

std::string written(double value) {
    ldi::buffer<char> text;
    ldi::detail::append_decimal(text, value);
    return std::string(text.data(), text.size());
}

void check(double value) {
    const std::string text = written(value);
    REQUIRE(text == nlohmann::json(value).dump());
    REQUIRE(std::stod(text) == value);
}

}  // namespace

TEST_CASE("a number is written in the digits that nlohmann/json writes, and reads back as itself") {
    for (double value :
         {0.0, 1.0, 10.0, 0.1, -0.25, 1e15, 1e16, 123456789012345.0, 1234567890123456.0, 1e-4, 1e-5, 1e-300, 1e300})
        check(value);
    CHECK(written(-0.0) == "-0.0");
    CHECK(written(100) == "100.0");
    CHECK(written(1e-5) == "1e-05");
    CHECK(written(0.001) == "0.001");
    for (int exponent = -1022; exponent < 1024; ++exponent) check(std::ldexp(1.0, exponent));
    std::mt19937_64 random(2);
    for (int i = 0; i < 20000; ++i) {
        check(static_cast<double>(std::uniform_real_distribution<float>(-20, 20)(random)));
        const std::uint64_t bits = random();
        double value;
        std::memcpy(&value, &bits, sizeof value);
        if (std::isnormal(value)) check(value);
    }
}
