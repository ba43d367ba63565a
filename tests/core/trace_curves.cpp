#include <ldi/core/trace_curves.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <utility>

using namespace ldi;

TEST_CASE("a lattice with 2^31 corners or more is refused before memory is allocated") {
    for (const auto& [width, height] : {std::pair{46340, 46340}, {2147483647, 0}, {0, 2147483647}, {2147483647, 2147483647}})
        CHECK(testing::raised([&] { corner_map(width, height); }) == error_code::too_large);
    CHECK_FALSE(testing::raised([] { corner_map(1000, 0); }));
}
