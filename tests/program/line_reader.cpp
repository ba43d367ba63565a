#include <examples/photo3d/line_reader.hpp>

#include <catch2/catch.hpp>

#include <sstream>
#include <string>
#include <vector>

using ldi::examples::line_reader;

TEST_CASE("lines are read one by one, with their numbers") {
    std::istringstream text("one\n\n \t\r\nfour");
    line_reader lines(text);
    std::vector<std::string> read;
    std::vector<bool> blank, ended;
    while (lines.next()) {
        read.push_back(lines.text()), blank.push_back(lines.is_blank()), ended.push_back(lines.has_end());
        CHECK(lines.number() == read.size());
    }
    CHECK(read == std::vector<std::string>{"one", "", " \t\r", "four"});
    CHECK(blank == std::vector<bool>{false, true, true, false});
    CHECK(ended == std::vector<bool>{true, true, true, false});
}

TEST_CASE("a line beyond the limit is truncated, and the following lines are read") {
    std::string written;
    written.append(line_reader::max_bytes, 'a').append("\n");
    written.append(line_reader::max_bytes + 5, 'b').append("\nc\n");
    std::istringstream text(written);
    line_reader lines(text);
    REQUIRE(lines.next());
    CHECK_FALSE(lines.is_too_long());
    REQUIRE(lines.next());
    CHECK(lines.is_too_long());
    CHECK(lines.text().size() == line_reader::max_bytes);
    REQUIRE(lines.next());
    CHECK_FALSE(lines.is_too_long());
    CHECK(lines.text() == "c");
    CHECK_FALSE(lines.next());
}
