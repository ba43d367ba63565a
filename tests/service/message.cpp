#include <examples/service/message.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <optional>
#include <string>

using namespace ldi;
using namespace ldi::examples;
using ldi::testing::raised;

namespace {

std::string message(const std::string& job, const std::string& photos) {
    return R"({"job": ")" + job + R"(", "photos": )" + photos + "}";
}

}  // namespace

TEST_CASE("a written message is read back unchanged") {
    const photo_message sent{"monday \u00fc", {"a.jpg", "album/b c.png"}};
    const photo_message read = parse_message(to_text(sent));
    CHECK(read.job == sent.job);
    CHECK(read.photos == sent.photos);
}

TEST_CASE("a message with a job and keys of maximum length is read, even if the keys are escaped") {
    std::string key;
    for (int i = 0; i < 995; ++i) key += R"(\u006b)";
    std::string keys = "[";
    for (std::size_t i = 0; i < photo_message::max_photos; ++i) keys += (i == 0 ? "\"" : ",\"") + key + "\"";
    CHECK(parse_message(message(std::string(photo_message::max_job_bytes, 'j'), keys + "]")).photos.size() ==
          photo_message::max_photos);
}

TEST_CASE("malformed messages, unsafe keys and oversized messages are refused") {
    const std::string nested = std::string(200'000, '[') + std::string(200'000, ']');
    for (const std::string& bad :
         {std::string("nonsense"), std::string("3"), std::string(R"({"photos": ["a"]})"), message("a", "[]"),
          message("", R"(["a"])"), message(std::string(photo_message::max_job_bytes + 1, 'j'), R"(["a"])"),
          message("a", R"([3])"), message("a", R"(["../a"])"), message("a", R"(["a/../b"])"), message("a", R"(["/etc/passwd"])"),
          message("a", R"(["a\u0000b"])"), message("a", "[" + nested + "]"), std::string(100'000, '['),
          R"({"job": "a", "photos": ["a"], "more": )" + nested.substr(0, 100'000) + "}"})
        CHECK(raised([&] { parse_message(bad); }) == error_code::invalid_data);
    std::string many = "[\"a\"";
    for (std::size_t i = 0; i < photo_message::max_photos; ++i) many += ",\"a\"";
    CHECK(raised([&] { parse_message(message("a", many + "]")); }) == error_code::invalid_data);
    // The length of a message is checked before the message is parsed.
    CHECK(raised([&] { parse_message(std::string(photo_message::max_bytes + 1, '[')); }) == error_code::too_large);
}

TEST_CASE("a key is refused, also in a message, if the keys of its outputs would be too long") {
    CHECK_NOTHROW(output_keys(std::string(995, 'k')));
    for (const std::size_t length : {996U, 997U, 1000U})
        for (const std::optional<error_code> code : {raised([&] { output_keys(std::string(length, 'k')); }), raised([&] {
                                                         parse_message(message("a", "[\"" + std::string(length, 'k') + "\"]"));
                                                     })})
            CHECK(code == error_code::invalid_data);
    for (const std::string& bad : {std::string(996, 'k'), std::string("folder/"), std::string()})
        CHECK_THROWS_WITH(check_photo_key(bad, "keys, line 3"),
                          Catch::StartsWith("keys, line 3: expected keys of at most 995 bytes of UTF-8 without control "
                                            "characters, like folder/photo.jpg, found"));
}

TEST_CASE("a document's id is its job and photo, or the whole document if either is missing") {
    CHECK(id_of(document_of("j", "p")) == R"(["j","p"])");
    for (const char* text : {R"({"photo":"p"})", R"({"job":"j"})", "{}", "[]", "3", "null", R"("photo")"})
        CHECK(id_of(nlohmann::ordered_json::parse(text)) == text);
    const std::string odd = R"({"job":{"photo":[1]},"photo":null})";
    CHECK(id_of(nlohmann::ordered_json::parse(odd)) == R"([{"photo":[1]},null])");
}

TEST_CASE("parse_document() accepts only objects of bounded length and depth") {
    CHECK(parse_document(to_line(document_of("j", "p"))) == document_of("j", "p"));
    for (const std::string& bad :
         {std::string(), std::string("3"), std::string("[]"), std::string("{"), R"({"a":)" + std::string(100'000, '['),
          R"({"a":")" + std::string(max_document_bytes, 'a') + "\"}"})
        CHECK_FALSE(parse_document(bad));
}

TEST_CASE("the document about a refused message contains the error and has a bounded length") {
    const std::string body(10'000'000, '\xFF');
    const nlohmann::ordered_json document = document_of_refused(body, {exit_never, "invalid data", "why"});
    CHECK(to_line(document).size() < max_document_bytes);
    CHECK(document["error"]["message"] == "why");
}
