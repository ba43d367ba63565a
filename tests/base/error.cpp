#include <ldi/base/error.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <vector>

using namespace ldi;

TEST_CASE("an error message states the place, what was expected, what was found, and the kind of error") {
    const error_details details{error_code::invalid_data, "photo.jpg", "a JPEG or PNG file", "0 bytes"};
    CHECK(to_string(details) == "photo.jpg: expected a JPEG or PNG file, found 0 bytes (invalid data)");
    CHECK(std::string(error(details).what()) == to_string(details));
}

static_assert(std::is_nothrow_copy_constructible_v<error>, "catching an error by value needs no memory");

TEST_CASE("raise() throws an error that states its code, its place, what was expected and what was found") {
    try {
        raise(error_code::mismatch, "lift", "640 x 480", "480 x 640");
        FAIL("did not throw");
    } catch (const error& e) {
        CHECK(e.code() == error_code::mismatch);
        CHECK(e.details().code == error_code::mismatch);
        CHECK(e.details().where == "lift");
        CHECK(e.details().expected == "640 x 480");
        CHECK(e.details().found == "480 x 640");
    }
    REQUIRE_THROWS_AS(raise(error_code::too_large, "photo", "50 megapixels", "100"), std::runtime_error);
}

TEST_CASE("every error code has a unique name") {
    std::vector<std::string_view> names;
    for (const error_code code : {error_code::invalid_option, error_code::invalid_data, error_code::unsupported,
                                  error_code::mismatch, error_code::too_large, error_code::file_access, error_code::canceled,
                                  error_code::out_of_memory, error_code::unavailable})
        names.push_back(to_string(code));
    std::sort(names.begin(), names.end());
    CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
    CHECK(std::find(names.begin(), names.end(), "unknown error") == names.end());
}

TEST_CASE("set_error_handler() returns the previous handler, and errors are still thrown as exceptions") {
    static int calls = 0;
    const error_handler counting = [](const error_details&) { ++calls; };
    REQUIRE(set_error_handler(counting) == nullptr);
    CHECK_THROWS_AS(raise(error_code::unsupported, "a.tif", "a JPEG or PNG file", "TIFF"), error);
    CHECK(calls == 0);
    CHECK(set_error_handler(nullptr) == counting);
}
