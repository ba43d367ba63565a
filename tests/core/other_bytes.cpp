#include <ldi/core/other_bytes.hpp>

#include <ldi/base/buffer.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <random>

using ldi::buffer;

TEST_CASE("for_each_other_byte() visits each byte that differs from the given value once, in order") {
    std::mt19937 random(5);
    for (std::size_t count = 0; count < 40; ++count)
        for (const unsigned share : {0U, 1U, 2U, 20U}) {  // one in `share` bytes may differ; 0: none
            buffer<std::uint8_t> values(count, std::uint8_t{1});
            for (std::uint8_t& v : values)
                if (share > 0 && random() % share == 0) v = static_cast<std::uint8_t>(random());
            buffer<std::int32_t> others, unknown, found, found_unknown;
            for (std::int32_t i = 0; i < values.count(); ++i) {
                if (values[i] != 1) others.push_back(i);
                if (values[i] == 0) unknown.push_back(i);
            }
            ldi::for_each_other_byte(values, 1, [&](std::int32_t i) { found.push_back(i); });
            ldi::for_each_unknown(values, [&](std::int32_t i) { found_unknown.push_back(i); });
            CHECK(found == others);
            CHECK(found_unknown == unknown);
        }
}

TEST_CASE("a byte that a visit sets to the given value is not visited later") {
    buffer<std::uint8_t> values{0, 0, 1, 0, 1, 1, 1, 1, 0};
    int visits = 0;
    ldi::for_each_unknown(values, [&](std::int32_t i) {
        if (i + 1 < values.count()) values[i + 1] = 1;
        ++visits;
    });
    CHECK(visits == 3);
}
