#include <ldi/io/published_network.hpp>

#include <catch2/catch.hpp>

#include <filesystem>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

TEST_CASE("the published network loads from its folder, and the error for a missing folder names it") {
    CHECK_THROWS_WITH(ldi::load_tiefenrausch("no/such/folder"),
                      Catch::Contains("no/such/folder") && Catch::Contains("tiefenrausch.pb"));
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch/model";
    if (!std::filesystem::exists(folder)) {
        WARN("skipped: " << folder << " is absent");
        return;
    }
    CHECK(ldi::load_tiefenrausch(folder).quantization_step() == Approx(1.0189).epsilon(1e-3));
}
