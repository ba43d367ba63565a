#include <examples/photo3d/unknown_option.hpp>

#include <catch2/catch.hpp>

#include <string>
#include <vector>

namespace {

std::string said_of(const std::vector<std::string>& line) {
    CLI::App app;
    bool flag = false;
    std::string text;
    app.add_flag("--compress", flag);
    app.add_option("-o,--output", text);
    return ldi::examples::unknown_option(app, line);
}

}  // namespace

TEST_CASE("an unknown option is named, with the most similar known one") {
    CHECK(said_of({"--hlep"}) == "unknown option --hlep; did you mean --help?");
    CHECK(said_of({"a.jpg", "--compres=3"}) == "unknown option --compres; did you mean --compress?");
    CHECK(said_of({"--ouptut", "a"}) == "unknown option --ouptut; did you mean --output?");
    CHECK(said_of({"--nothing-like-it"}) == "unknown option --nothing-like-it");
    CHECK(said_of({"-x"}) == "unknown option -x");
    CHECK(said_of({"--" + std::string(100'000, 'x')}).size() < 100);
}

TEST_CASE("known options, numbers and file names are not reported as unknown") {
    CHECK(said_of({"--output", "a", "-o", "-", "-ob", "--compress", "-5", "-.5", "a.jpg"}).empty());
    CHECK(said_of({"--", "--hlep"}).empty());
}

TEST_CASE("options of the chosen subcommand are known, and those of the others are not") {
    CLI::App app;
    std::string text;
    app.add_subcommand("submit")->add_option("--job", text);
    app.add_subcommand("collect")->add_option("--results", text);
    CHECK_THROWS_AS(app.parse("submit --results a"), CLI::ParseError);
    CHECK(ldi::examples::unknown_option(app, {"submit", "--job", "a"}).empty());
    CHECK(ldi::examples::unknown_option(app, {"submit", "--jobb", "a"}) == "unknown option --jobb; did you mean --job?");
    CHECK(ldi::examples::unknown_option(app, {"submit", "--results", "a"}) == "unknown option --results");
}
