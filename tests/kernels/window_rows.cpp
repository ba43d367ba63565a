#include <ldi/kernels/window_rows.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <numeric>
#include <vector>

TEST_CASE("every window holds its k x k pixels row by row, and the padding value outside the image") {
    for (std::size_t side : {1U, 3U, 5U, 7U})
        for (std::size_t stride : {1U, 2U})
            for (std::size_t width : {1U, 4U, 5U}) {
                const ldi::window_geometry g{3, width, 2, side, stride, 200};
                std::vector<std::uint8_t> image(g.height * g.width * g.channels);
                std::iota(image.begin(), image.end(), std::uint8_t{0});
                for (std::size_t y = 0; y < g.result_height(); ++y)
                    for (std::size_t first = 0; first < g.result_width(); ++first) {
                        const std::size_t count = g.result_width() - first;
                        std::vector<std::uint8_t> expected;
                        const auto reach = static_cast<std::ptrdiff_t>(side / 2);
                        for (std::size_t x = first; x < g.result_width(); ++x)
                            for (std::ptrdiff_t dy = -reach; dy <= reach; ++dy)
                                for (std::ptrdiff_t dx = -reach; dx <= reach; ++dx)
                                    for (std::size_t c = 0; c < g.channels; ++c) {
                                        const std::ptrdiff_t at_y = static_cast<std::ptrdiff_t>(y * stride) + dy;
                                        const std::ptrdiff_t at_x = static_cast<std::ptrdiff_t>(x * stride) + dx;
                                        const bool inside =
                                            at_y >= 0 && at_y < 3 && at_x >= 0 && at_x < static_cast<std::ptrdiff_t>(width);
                                        expected.push_back(inside ? image[(static_cast<std::size_t>(at_y) * width +
                                                                           static_cast<std::size_t>(at_x)) *
                                                                              2 +
                                                                          c]
                                                                  : std::uint8_t{200});
                                    }
                        std::vector<std::uint8_t> found(expected.size());
                        ldi::window_rows(g, image.data(), y, first, count, found.data());
                        CHECK(found == expected);
                    }
            }
}
