// Memory that the whole conversion uses, and its behavior when memory is exhausted. This program replaces operator new to
// count its calls.
#include "tests/support/counted_memory.hpp"
#include "tests/support/lifted_scene.hpp"

#include <ldi/io/weight_files.hpp>
#include <ldi/ldi.hpp>

#include <catch2/catch.hpp>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <random>
#include <utility>

namespace {

/// Calls of operator new anywhere in this program; not counted while negative.
std::atomic<long> calls_of_new{-1};

struct counting {
    counting() { calls_of_new = 0; }
    ~counting() { calls_of_new = -1; }
    long calls() const { return calls_of_new; }
};

ldi::image<std::uint8_t> noisy_photo(std::size_t rows, std::size_t columns) {
    std::mt19937 random(8);
    ldi::image<std::uint8_t> photo(rows, columns, 3);
    for (std::uint8_t& value : photo) value = static_cast<std::uint8_t>(random());
    return photo;
}

/// Presents a given map as the result of a network, after running one.
struct network_and_map {
    const ldi::tiefenrausch& network;
    const ldi::image<float>& map;

    template <ldi::executor Executor>
    ldi::image<float> disparity(ldi::image_view<const std::uint8_t> photo, const ldi::progress_listener& progress,
                                Executor&& threads) const {
        network.disparity(photo, progress, threads);
        return map;
    }
    float quantization_step() const { return 1.0F; }
};

const std::filesystem::path tests = std::filesystem::path(LDI_SOURCE_DIR) / "tests";

}  // namespace

// With the address sanitizer, calls are not counted, because the sanitizer has its own operator new, which some libraries call.
// The sanitizer itself detects memory that is not released.
#if defined(__SANITIZE_ADDRESS__)
#define LDI_TEST_COUNTS_NEW 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define LDI_TEST_COUNTS_NEW 0
#endif
#endif
#ifndef LDI_TEST_COUNTS_NEW
#define LDI_TEST_COUNTS_NEW 1
#endif

#if LDI_TEST_COUNTS_NEW
// Not inlined: otherwise g++ would report that free() does not match operator new.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
    if (calls_of_new >= 0) ++calls_of_new;
    if (void* block = std::malloc(bytes > 0 ? bytes : 1)) return block;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }
#endif

TEST_CASE("every stage and all three networks allocate only from the caller's memory") {
    const ldi::tiefenrausch depth = ldi::load_depth_network(tests / "io/files/tiefenrausch_weights.safetensors");
    const ldi::farbrausch inpainter = ldi::load_farbrausch(tests / "networks/files/farbrausch_weights.safetensors");
    const ldi::silhouette_network silhouettes =
        ldi::load_silhouettes(tests.parent_path() / "examples/models/silhouettes.safetensors");
    std::mt19937 random(9);
    const ldi::image<float> map = ldi::testing::random_disparity(random, 48, 64);
    const ldi::given_disparity coarse{ldi::testing::random_disparity(random, 24, 32)};
    const ldi::image<std::uint8_t> photo = noisy_photo(48, 64);
    ldi::thread_pool threads(3);
    ldi::testing::counted_memory own;
    {
        const ldi::memory_scope scope(own.source);
        ldi::photo3d serial, parallel;
        {
            const counting elsewhere;
#if LDI_TEST_COUNTS_NEW
            ::operator delete(::operator new(4));
            CHECK(elsewhere.calls() == 1);  // calls are counted
            calls_of_new = 0;
#endif
            serial = ldi::make_photo3d(photo, network_and_map{depth, map}, inpainter);
            CHECK(elsewhere.calls() == 0);
            parallel = ldi::make_photo3d(photo, network_and_map{depth, map}, inpainter, {}, threads);
            CHECK(elsewhere.calls() == 0);
            ldi::make_photo3d(photo, coarse, ldi::network_decider(&silhouettes), inpainter, {}, threads);
            CHECK(elsewhere.calls() == 0);
        }
        CHECK(own.blocks > 0);
        CHECK(serial.layers.size() > photo.height() * photo.width());
        CHECK(serial.mesh.positions == parallel.mesh.positions);
    }
    CHECK(own.blocks == 0);
}

TEST_CASE(
    "the peak memory for sheets, excluding the photo, grows by less than one sheet if the photo has four times the pixels") {
    const auto peak_of = [&](std::size_t rows, std::size_t columns) {
        std::mt19937 random(10);
        const ldi::image<std::uint8_t> photo = noisy_photo(rows, columns);
        const ldi::given_disparity depth{ldi::testing::random_disparity(random, 60, 80)};
        ldi::sheet_options sheets;
        sheets.max_side = 512;
        ldi::photo3d_options options;
        options.long_side = 160;
        ldi::testing::counted_memory own;
        const ldi::memory_scope scope(own.source);
        const ldi::photo3d made =
            ldi::make_photo3d(photo, depth, ldi::diffusion_inpainter{}, ldi::for_sheets(options, rows, columns, sheets));
        sheets.margin = made.facts.margin;
        const ldi::sheet_layout layout = ldi::lay_out_sheets(made.layers, made.charts, made.atlas, rows, columns, sheets);
        const ldi::textured_mesh mesh = ldi::move_to_sheets(made.mesh, made.charts, made.atlas, layout);
        for (std::size_t i = 1; i < layout.sizes.size(); ++i)
            ldi::draw_sheet(layout, i, made.charts, made.atlas, made.photo, photo);
        CHECK(layout.sizes.size() > 4);
        CHECK(mesh.part_count() == layout.sizes.size());
        return own.peak;
    };
    const std::size_t smaller = peak_of(720, 960), larger = peak_of(1440, 1920);
    CAPTURE(smaller, larger);
    CHECK(larger < smaller + 512 * 512 * 3);  // excludes the growth of the photo itself by 6 megabytes
}

TEST_CASE("if any allocation of the conversion fails, bad_alloc is thrown and all memory is released") {
    const ldi::tiefenrausch depth = ldi::load_depth_network(tests / "io/files/tiefenrausch_weights.safetensors");
    const ldi::farbrausch inpainter = ldi::load_farbrausch(tests / "networks/files/farbrausch_weights.safetensors");
    std::mt19937 random(9);
    const ldi::image<float> map = ldi::testing::random_disparity(random, 24, 32);
    const ldi::image<std::uint8_t> photo = noisy_photo(24, 32);
    ldi::thread_pool pool(2);
    const auto runs_out = [&](std::size_t last, auto&& threads) {
        ldi::testing::counted_memory own;
        own.most = last;
        bool thrown = false;
        try {
            const ldi::memory_scope scope(own.source);
            ldi::make_photo3d(photo, network_and_map{depth, map}, inpainter, {}, threads);
        } catch (const std::bad_alloc&) {
            thrown = true;
        }
        REQUIRE(own.blocks == 0);
        return std::pair{thrown, own.calls};
    };
    const auto [thrown, calls] = runs_out(static_cast<std::size_t>(-1), ldi::serial_executor());
    REQUIRE_FALSE(thrown);
    REQUIRE(calls > 500);
    for (std::size_t last = 0; last < calls; last += last < 200 ? 1 : 13) {
        CAPTURE(last);
        REQUIRE(runs_out(last, ldi::serial_executor()).first);
        if (last % 7 == 0) runs_out(last, pool);
    }
}
