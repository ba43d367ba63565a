#include <ldi/formats/detail/json.hpp>

#include "tests/support/files.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <random>
#include <string>

using namespace ldi;
using namespace ldi::detail;
using Catch::Contains;

namespace {

constexpr int deep = 12;

/// A random value with random spelling, nested at most `depth` deep.
std::string random_json(std::mt19937& random, int depth) {
    const auto below = [&](std::size_t limit) { return static_cast<unsigned>(random() % limit); };
    const auto space = [&] { return std::string(below(3), " \t\n\r"[below(4)]); };
    const auto text = [&] {
        static const char* const pieces[] = {"a",
                                             "Z",
                                             " ",
                                             "\\n",
                                             "\\\"",
                                             "\\\\",
                                             "\\/",
                                             "\\u0041",
                                             "\\u00e9",
                                             "\\u20AC",
                                             "\\ud83d\\ude00",
                                             "\xC3\xA9",
                                             "\xE2\x82\xAC",
                                             "\xF0\x9F\x98\x80",
                                             "{",
                                             "]",
                                             ","};
        std::string result = "\"";
        for (unsigned count = below(6); count > 0; --count) result += pieces[below(std::size(pieces))];
        return result + "\"";
    };
    const auto list = [&](char open, char close, auto&& part) {
        std::string result(1, open);
        const unsigned count = below(4);
        for (unsigned i = 0; i < count; ++i) result += (i == 0 ? "" : ",") + space() + part(i) + space();
        return result + close;
    };
    switch (below(depth == 0 ? 5 : 8)) {
        case 0: return text();
        case 1: return std::to_string(random() % (below(2) == 0 ? 10U : 4000000000U));
        case 2: return "-" + std::to_string(below(100)) + "." + std::to_string(below(1000));
        case 3: return std::to_string(below(10)) + (below(2) == 0 ? "e" : "E+") + std::to_string(below(30));
        case 4: return below(3) == 0 ? "null" : below(2) == 0 ? "true" : "false";
        case 5: return list('[', ']', [&](unsigned) { return random_json(random, depth - 1); });
        default:
            return list('{', '}', [&](unsigned i) {
                std::string name = text();
                name.insert(name.size() - 1, std::to_string(i));  // names must differ
                return name + space() + ":" + space() + random_json(random, depth - 1);
            });
    }
}

/// Whether both readers agree on a value and all values in it.
bool same(const json_value& found, const nlohmann::json& expected) {
    switch (found.kind) {
        case json_kind::none: return false;
        case json_kind::null: return expected.is_null();
        case json_kind::boolean: return expected.is_boolean() && expected.get<bool>() == (found.text == "true");
        case json_kind::string: return expected.is_string() && expected.get<std::string>() == unescaped(found.text);
        case json_kind::number: {
            if (!expected.is_number() || nlohmann::json::parse(found.text) != expected) return false;
            const std::optional<std::uint64_t> whole = whole_number(found);
            return whole.has_value() == expected.is_number_unsigned() && (!whole || *whole == expected.get<std::uint64_t>());
        }
        case json_kind::array: {
            std::size_t count = 0;
            bool good = expected.is_array();
            for_each_element(found, [&](const json_value& value) {
                good = good && count < expected.size() && same(value, expected[count]);
                ++count;
            });
            return good && count == expected.size();
        }
        case json_kind::object: {
            std::size_t count = 0;
            bool good = expected.is_object();
            for_each_member(found, [&](const std::string& name, const json_value& value) {
                good = good && expected.contains(name) && same(value, expected[name]);
                ++count;
            });
            return good && count == expected.size();
        }
    }
    return false;
}

std::string complaint(const std::string& text, int depth = deep) {
    return testing::message_of([&] { read_json_object(text, depth, "text"); });
}

}  // namespace

TEST_CASE("random documents are read as nlohmann/json reads them") {
    std::mt19937 random(1);
    for (int i = 0; i < 3000; ++i) {
        const std::string text = " {\"value\" : " + random_json(random, 4) + "}\n";
        CAPTURE(text);
        REQUIRE(same(read_json_object(text, deep, "text"), nlohmann::json::parse(text)));
    }
}

TEST_CASE("damaged documents are refused if nlohmann/json refuses them, and otherwise read to the same values") {
    std::mt19937 random(2);
    int refused = 0;
    for (int i = 0; i < 20000; ++i) {
        const testing::byte_string whole = testing::bytes_of("{\"value\" : " + random_json(random, 4) + "}");
        const testing::byte_string damaged = testing::damaged_copy(whole, random);
        const std::string text(reinterpret_cast<const char*>(damaged.data()), damaged.size());
        const nlohmann::json expected = nlohmann::json::parse(text, nullptr, false);
        const std::string said = complaint(text);
        CAPTURE(text, said);
        // The readers differ in three cases: ldi refuses duplicate names and accepts huge numbers, and a zero byte ends the text
        // for nlohmann/json.
        if (said.find("twice") != std::string::npos || text.find('\0') != std::string::npos ||
            (expected.is_discarded() && said == "nothing raised" && text.find_first_of("eE") != std::string::npos))
            continue;
        REQUIRE((said == "nothing raised") == expected.is_object());
        if (expected.is_object()) REQUIRE(same(read_json_object(text, deep, "text"), expected));
        refused += said != "nothing raised";
    }
    CHECK(refused > 10000);
}

TEST_CASE("errors state the byte position and what was expected there") {
    CHECK_THAT(complaint(""), Contains("text, byte 0 of its JSON: expected a JSON object, found the end"));
    CHECK_THAT(complaint("[1]"), Contains("expected a JSON object, found ["));
    CHECK_THAT(complaint("{\"a\":1,}"), Contains("byte 7") && Contains("expected a name in a JSON object, found }"));
    CHECK_THAT(complaint("{\"a\" 1}"), Contains("byte 5") && Contains("a colon"));
    CHECK_THAT(complaint("{\"a\":[1 2]}"), Contains("byte 8") && Contains("a comma or ]"));
    CHECK_THAT(complaint("{\"a\":01}"), Contains("byte 6") && Contains("a comma or }"));
    CHECK_THAT(complaint("{\"a\":1.}"), Contains("byte 7") && Contains("a digit after the point"));
    CHECK_THAT(complaint("{\"a\":nil}"), Contains("byte 5") && Contains("a JSON value"));
    CHECK_THAT(complaint("{\"a"), Contains("byte 3") && Contains("a quote") && Contains("found the end"));
    CHECK_THAT(complaint("{\"\\x\":1}"), Contains("byte 3") && Contains("a valid escape"));
    CHECK_THAT(complaint("{\"\\ud800\":1}"), Contains("low surrogate"));
    CHECK_THAT(complaint("{\"\\ude00\":1}"), Contains("high surrogate"));
    CHECK_THAT(complaint("{\"\xC0\x80\":1}"), Contains("byte 2") && Contains("UTF-8"));
    CHECK_THAT(complaint("{} {}"), Contains("byte 3") && Contains("nothing after"));
    CHECK_THAT(complaint("{\"a\":1,\"\\u0061\":2}"), Contains("a twice"));
}

TEST_CASE("nesting deeper than the caller's limit is refused") {
    CHECK(complaint("{\"a\":[[]]}", 3) == "nothing raised");
    CHECK_THAT(complaint("{\"a\":[[[]]]}", 3), Contains("at most 3 deep"));
    CHECK_THAT(complaint("{\"a\":" + std::string(1000000, '['), deep), Contains("at most 12 deep"));
}

TEST_CASE("a member is found by its name even if the name is escaped, and whole numbers are read up to 64 bits") {
    const json_value object = read_json_object("{\"\\u0061\":17,\"b\":null}", deep, "text");
    CHECK(whole_number(json_member(object, "a")) == 17);
    CHECK(json_member(object, "b").kind == json_kind::null);
    CHECK(json_member(object, "c").kind == json_kind::none);
    CHECK(whole_number({json_kind::number, "18446744073709551615"}) == 18446744073709551615U);
    CHECK_FALSE(whole_number({json_kind::number, "18446744073709551616"}));
}
