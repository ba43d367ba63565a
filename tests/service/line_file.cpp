#include <examples/service/line_file.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

using namespace ldi;
using namespace ldi::examples;
using ldi::testing::raised;
using ldi::testing::scratch_folder;

namespace {

/// During its lifetime, makes writes beyond this file size fail, as on a full disk.
class file_size_limit {
public:
    explicit file_size_limit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~file_size_limit() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    file_size_limit(const file_size_limit&) = delete;
    file_size_limit& operator=(const file_size_limit&) = delete;

private:
    rlimit before_{};
    void (*handler_)(int);
};

std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::string line(int i) { return document_of("job", "photo" + std::to_string(i)).dump() + "\n"; }

}  // namespace

TEST_CASE(
    "on a full disk, a file of documents keeps its complete lines, and a later save() appends each remaining document once") {
    const scratch_folder folder;
    const std::filesystem::path path = folder / "results";
    line_file file(path);
    file.add(document_of("job", "photo0")), file.save();
    std::string expected = line(0);
    for (int i = 1; i <= 9; ++i) {
        file.add(document_of("job", "photo" + std::to_string(i)));
        for (std::size_t left = 0; left < line(0).size(); ++left) {
            const file_size_limit limit(expected.size() + left);
            REQUIRE(raised([&] { file.save(); }) == error_code::file_access);
            REQUIRE(text_of(path) == expected);
        }
        if (i % 3 == 0) {
            file.save();
            expected += line(i - 2) + line(i - 1) + line(i);
            REQUIRE(text_of(path) == expected);
        }
    }
}

TEST_CASE("if a file of documents ends in the middle of a line, new documents are appended after the last complete one") {
    const scratch_folder folder;
    const std::filesystem::path path = folder / "results";
    for (std::size_t left = 0; left <= line(2).size(); ++left) {
        std::ofstream(path) << line(1) << line(2).substr(0, left);
        line_file file(path);
        REQUIRE(file.ids().size() == (left + 1 < line(2).size() ? 1 : 2));
        REQUIRE(file.add(document_of("job", "photo2")) == (file.ids().size() == 1 || left + 1 < line(2).size()));
        REQUIRE(file.add(document_of("job", "photo3")));
        REQUIRE_FALSE(file.add(document_of("job", "photo1")));
        file.save();
        REQUIRE(text_of(path) == line(1) + line(2) + line(3));
    }
}

TEST_CASE("a file of documents can have only one writer at a time") {
    const scratch_folder folder;
    const std::filesystem::path path = folder / "results";
    {
        const line_file first(path);
        CHECK(raised([&] { line_file second(path); }) == error_code::invalid_option);
    }
    CHECK_NOTHROW(line_file(path));
}

TEST_CASE("only documents that a file of documents accepts when it is opened again count as documents") {
    const scratch_folder folder;
    const std::filesystem::path path = folder / "results";
    std::string long_numbers = R"({"job": "j", "photo": "p", "values": [1e9)";
    while (long_numbers.size() < max_document_bytes - 10) long_numbers += ",1e9";  // 1000000000.0 when written
    for (const auto& [text, is_one] : {std::pair<std::string, bool>{R"({"job": "j", "photo": "p"})", true},
                                       {R"({"message": "nonsense", "error": {}})", true},
                                       {R"({"test": 1})", false},
                                       {R"({"job": "j"})", false},
                                       {long_numbers + "]}", false}}) {
        const auto document = parse_document(text);
        REQUIRE(document);
        CHECK(is_document(*document) == is_one);
        std::ofstream(path) << to_line(*document) << "\n";
        CHECK(raised([&] { line_file file(path); }) == (is_one ? std::nullopt : std::optional(error_code::invalid_data)));
    }
}

TEST_CASE("a file that another program wrote is refused and stays unchanged") {
    const scratch_folder folder;
    const std::filesystem::path path = folder / "notes";
    for (const std::string& text :
         {std::string("my only notes, one line"), line(1) + "notes", std::string("notes\n"), line(1) + "{\n", std::string("\n"),
          std::string("{\"title\": \"mine\"}\n"), std::string("{\"title\": \"mine\"}"), line(1) + "{\"title\": \"mi",
          "{\"job\":\"" + std::string(100'000, 'a')}) {
        std::ofstream(path) << text;
        CHECK(raised([&] { line_file file(path); }) == error_code::invalid_data);
        CHECK(text_of(path) == text);
    }
}
