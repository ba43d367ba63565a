#include <ldi/base/array_view.hpp>

#include <ldi/core/layered_view.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

using namespace ldi;

namespace {
template <class From, class T>
constexpr bool converts = std::is_convertible_v<From, array_view<T>>;
}  // namespace

static_assert(converts<std::vector<float>&, float> && converts<std::vector<float>&, const float> &&
              converts<const std::vector<float>&, const float> && converts<std::span<float>&, const float> &&
              converts<buffer<float>&, float> && converts<const buffer<float>&, const float>);
static_assert(!converts<const std::vector<float>&, float> && !converts<const buffer<float>&, float> &&
                  !converts<std::span<const float>, float>,
              "a view does not make values writable");
static_assert(!converts<std::vector<float>, const float> && !converts<buffer<float>, const float>,
              "a view would outlive a temporary");
static_assert(!converts<std::vector<double>&, const float> && !converts<std::vector<bool>&, const bool>);

TEST_CASE("views refer to a graph and columns in the caller's vectors without a copy") {
    const std::vector<lattice_coordinate> x{0, 1}, y{0, 0};
    const std::vector<std::int32_t> none{no_pixel, no_pixel}, left{no_pixel, 0}, right{1, no_pixel};
    const std::vector<float> disparity{0.25F, 0.5F};
    const graph_view g(2, 1, x, y, none, none, left, right);
    const layered_view<disparity_column> layers(g, disparity);
    CHECK(g.neighbor(0, side::right) == 1);
    CHECK(layers.column<disparity_column>().data() == disparity.data());
}
