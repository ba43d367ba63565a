// Constants that the silhouette network shares with its training.
#include <ldi/ldi.hpp>

#include <catch2/catch.hpp>

#include <fstream>
#include <map>
#include <regex>
#include <string>

TEST_CASE("the library and the training of the silhouette network use the same constants for bands") {
    std::ifstream file(LDI_SOURCE_DIR "/examples/training/silhouettes/band.py");
    const std::regex constant("([A-Z_]+) = ([0-9.]+) .*");
    std::map<std::string, float> trained;
    std::smatch found;
    for (std::string line; std::getline(file, line);)
        if (std::regex_match(line, found, constant)) trained[found[1]] = std::stof(found[2]);

    CHECK(trained.at("MAX_STEP") == ldi::step_band_options().max_step);
    CHECK(trained.at("MIN_STEP") == ldi::step_band_options().min_step);
    CHECK(trained.at("SIDES_RADIUS") == ldi::step_sides_radius);
    CHECK(trained.at("BAND_RADIUS") == ldi::step_band_radius);
    CHECK(trained.at("REGION_RADIUS") == ldi::step_region_radius);
}
