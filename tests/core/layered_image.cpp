#include <ldi/core/coarsening.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/core/single_layer.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <new>
#include <string>
#include <type_traits>

using namespace ldi;

namespace {
struct normal_column {
    using scalar = double;
    static constexpr std::size_t channels = 3;
};
struct name_column {  // a payload need not be a number
    using scalar = std::string;
    static constexpr std::size_t channels = 1;
};
struct other_disparity_column {  // columns of equal scalar and size are distinguished by their types
    using scalar = float;
    static constexpr std::size_t channels = 1;
};
using users_layers = layered_image<normal_column, disparity_column, name_column, other_disparity_column>;

struct throwing_tag : other_disparity_column {  // layered images never construct tags
    throwing_tag() { throw 1; }
};
struct not_constructible_tag : other_disparity_column {
    not_constructible_tag() = delete;
};
static_assert(payload_column<normal_column> && payload_column<name_column>);
static_assert(detail::check_rules<normal_column>() && detail::check_rules<name_column>());
static_assert(std::is_default_constructible_v<users_layers> && std::is_copy_constructible_v<users_layers>);
static_assert(std::is_nothrow_move_constructible_v<users_layers> && std::is_move_assignable_v<users_layers>);
static_assert(!std::is_polymorphic_v<photo_layers>);
static_assert(!std::is_convertible_v<graph, photo_layers>, "a graph does not convert to a layered image implicitly");
static_assert(std::is_same_v<decltype(std::declval<photo_layers&>().column<color_column>()), array_view<std::uint8_t>>);
static_assert(std::is_same_v<decltype(std::declval<const photo_layers&>().column<disparity_column>()), array_view<const float>>);
static_assert(std::is_same_v<decltype(std::declval<users_layers&>().at<normal_column>(0)), std::span<double, 3>>);
static_assert(std::is_same_v<decltype(std::declval<const users_layers&>().at<normal_column>(0)), std::span<const double, 3>>);

// Code that makes these changes could give columns and graph different lengths. It must not compile for layered images.
template <class L>
concept can_change_topology = requires(L& l) {
    l.topology() = graph();
}
|| requires(L& l) { l.topology().add_pixel(0, 0); }
|| requires(L& l) { l.topology = graph(); };
template <class L>
concept can_resize_columns = requires(L& l) {
    l.resize_columns(1);
}
|| requires(L& l) { l.template column<disparity_column>().push_back(1); }
|| requires(L& l) { l.template column<disparity_column>().resize(1); };
template <class L>
concept can_take = requires(L& l, L other) {
    l.take(std::move(other));
};
template <class L>
concept can_move_pixels = requires(L& l) {
    l.keep(std::span<const std::uint8_t>());
}
|| requires(L& l) { l.reorder(std::span<const std::int32_t>()); }
|| requires(L& l) { l.grow(nullptr); };
static_assert(!can_change_topology<photo_layers> && !can_resize_columns<photo_layers> && !can_take<photo_layers>);
static_assert(can_move_pixels<photo_layers>, "the concept holds for a type that has the functions");
static_assert(!can_change_topology<photo_layer> && !can_resize_columns<photo_layer> && !can_take<photo_layer>);
static_assert(!can_move_pixels<photo_layer>);
static_assert(!std::is_convertible_v<photo_layer, photo_layers> && !std::is_constructible_v<photo_layers, photo_layer>,
              "only expand() turns a single layer into a layered image");
static_assert(!std::is_base_of_v<photo_layers, photo_layer>);
template <class G>
concept can_receive_columns = requires(G& g, const graph_builder& b) {
    g.index_columns::operator=(b);
};
static_assert(!can_receive_columns<graph>, "a graph does not accept unchecked columns after build()");
template <class B>
concept has_writable_column = requires(B& b) {
    b.write_x();
}
|| requires(B& b) { b.x()[0] = 1; }
|| requires(B& b) { b.x_; }
|| requires(B& b) { b.left()[0] = 1; };
static_assert(!has_writable_column<graph_builder> && !has_writable_column<graph>,
              "a view of a column cannot change a graph after build()");
static_assert(std::is_final_v<graph> && std::is_final_v<graph_view>);
struct thief : detail::index_columns<detail::owned_columns> {
    template <class T = thief>
    static constexpr bool reaches_columns = requires {
        &T::x_;
    }
    || requires { &T::neighbors_; }
    || requires { T(); };
};
static_assert(!thief::reaches_columns<>, "a derived class cannot access the columns");
static_assert(!std::is_copy_constructible_v<link_editor> && !std::is_constructible_v<link_editor, graph_builder&>);
static_assert(std::is_constructible_v<layered_view<disparity_column>, const graph&, const buffer<float>&>);

// Views of temporaries would dangle. Code that creates them must not compile.
template <class L>
concept shows_temporary_column = requires(L&& l) {
    std::move(l).template column<disparity_column>();
}
|| requires(L&& l) { std::move(l).template at<disparity_column>(0); }
|| requires(const L&& l) { std::move(l).template column<disparity_column>(); }
|| requires(L&& l) { std::move(l).topology(); };
static_assert(!shows_temporary_column<photo_layers> && !shows_temporary_column<photo_layer>);
static_assert(shows_temporary_column<layered_view<disparity_column>>, "columns of a temporary view stay valid");
static_assert(!std::is_constructible_v<layered_view<disparity_column>, graph, const buffer<float>&>);
static_assert(!std::is_constructible_v<layered_view<disparity_column>, const graph&, buffer<float>>);
static_assert(!std::is_constructible_v<layered_view<disparity_column>, photo_layers>);
static_assert(std::is_constructible_v<layered_view<disparity_column>, const photo_layers&>);
static_assert(!std::is_convertible_v<graph, graph_view> && !std::is_convertible_v<const graph, graph_view>);
static_assert(std::is_convertible_v<graph&, graph_view> && std::is_convertible_v<const graph&, graph_view>);
template <class G>
concept shows_temporary_index_column = requires(G&& g) {
    std::move(g).x();
}
|| requires(G&& g) { std::move(g).y(); }
|| requires(G&& g) { std::move(g).neighbors(side::left); }
|| requires(G&& g) { std::move(g).up(); }
|| requires(G&& g) { std::move(g).down(); }
|| requires(G&& g) { std::move(g).left(); }
|| requires(G&& g) { std::move(g).right(); };
static_assert(!shows_temporary_index_column<graph> && !shows_temporary_index_column<const graph>);
static_assert(!shows_temporary_index_column<graph_builder>);
static_assert(shows_temporary_index_column<graph_view>, "columns of a temporary view stay valid");
static_assert(!std::is_constructible_v<array_view<const float>, buffer<float>>);
static_assert(!std::is_constructible_v<array_view<float>, buffer<float>>);
static_assert(!std::is_constructible_v<array_view<const float>, const buffer<float>>);
static_assert(!std::is_constructible_v<array_view<const float>, std::vector<float>>);
static_assert(!std::is_constructible_v<array_view<const float>, const std::vector<float>>);
static_assert(!std::is_constructible_v<layered_view<disparity_column>, const graph&, const std::vector<float>>);
static_assert(std::is_constructible_v<layered_view<disparity_column>, const graph&, const std::vector<float>&>);
static_assert(std::is_convertible_v<std::vector<float>&, array_view<float>>);
static_assert(std::is_convertible_v<const std::vector<float>&, array_view<const float>>);
static_assert(std::is_convertible_v<buffer<float>&, array_view<float>>);
static_assert(std::is_convertible_v<const buffer<float>&, array_view<const float>>);

// A caller's type with the functions of a layered image.
struct layers_of_the_caller {
    template <class Column>
    static constexpr bool has = std::is_same_v<Column, disparity_column>;
    graph own_topology;
    buffer<float> disparity;
    const graph& topology() const { return own_topology; }
    template <class Column>
    array_view<const float> column() const {
        return disparity;
    }
};
static_assert(std::is_constructible_v<layered_view<disparity_column>, const layers_of_the_caller&>);
static_assert(!std::is_constructible_v<layered_view<disparity_column>, layers_of_the_caller>, "the view would dangle");
static_assert(std::is_constructible_v<layered_view<disparity_column>, layered_view<color_column, disparity_column>>);
struct columns_without_topology {
    template <class Column>
    static constexpr bool has = true;
    template <class Column>
    array_view<const float> column() const;
};
static_assert(!std::is_constructible_v<layered_view<disparity_column>, const columns_without_topology&>);

// Access to a column that the layers do not have must not compile, and a concept must be able to detect this.
template <class L, class Column>
concept offers_column = requires(L& l) {
    l.template column<Column>();
}
|| requires(L& l) { l.template at<Column>(0); }
|| requires(L& l) { l.template set_column<Column>(buffer<typename Column::scalar>()); };
static_assert(offers_column<photo_layers, color_column> && !offers_column<photo_layers, normal_column>);
static_assert(offers_column<photo_layer, color_column> && !offers_column<photo_layer, normal_column>);
static_assert(offers_column<layered_view<color_column>, color_column> &&
              !offers_column<layered_view<color_column>, normal_column>);

/// Checks that every column has one row per pixel, and that the topology is valid.
template <class... Columns>
bool is_sound(const layered_image<Columns...>& layers) {
    return !validate(graph_view(layers.topology())) &&
           ((layers.template column<Columns>().size() == layers.size() * Columns::channels) && ...);
}

/// Memory that is exhausted after `left` allocations.
struct short_memory {
    std::size_t left = 0;
    memory source{this,
                  [](void* self, std::size_t bytes, std::size_t alignment) -> void* {
                      if (static_cast<short_memory*>(self)->left == 0) return nullptr;
                      --static_cast<short_memory*>(self)->left;
                      return current.allocate(current.context, bytes, alignment);
                  },
                  [](void*, void* block, std::size_t bytes) { current.release(current.context, block, bytes); }};
    static inline const memory current = current_memory();
};
}  // namespace

#if LDI_HAS_EXCEPTIONS
TEST_CASE("if memory runs out during a change, every column still has one row per pixel") {
    using small_layers = layered_image<normal_column, disparity_column>;
    const auto make = [] {
        small_layers layers(make_grid(4, 4));
        for (std::int32_t i = 0; i < 16; ++i)
            layers.at<normal_column>(i)[0] = i, layers.at<disparity_column>(i)[0] = static_cast<float>(i);
        return layers;
    };
    const small_layers original = make();
    buffer<std::int32_t> backwards;
    for (std::int32_t i = 15; i >= 0; --i) backwards.push_back(i);
    buffer<std::uint8_t> kept(16, 1);
    kept[3] = 0;
    const auto unchanged = [&](const small_layers& l) {
        return l.topology() == original.topology() && l.column<normal_column>() == original.column<normal_column>() &&
               l.column<disparity_column>() == original.column<disparity_column>();
    };
    // Runs `change` with memory for 0, 1, 2... allocations, until it succeeds. `check` inspects the image after every failure.
    const auto fail_everywhere = [&](auto&& change, auto&& check) {
        for (std::size_t n = 0;; ++n) {
            short_memory source;
            small_layers layers = make();
            {
                const memory_scope scope(source.source);
                source.left = n;
                try {
                    change(layers);
                    REQUIRE(is_sound(layers));
                    REQUIRE(n > 0);
                    return;
                } catch (const std::bad_alloc&) {
                }
            }
            REQUIRE(is_sound(layers));
            check(layers);
        }
    };
    const auto is_unchanged = [&](const small_layers& l) { REQUIRE(unchanged(l)); };
    fail_everywhere([&](small_layers& l) { l.keep(kept); }, is_unchanged);
    fail_everywhere([&](small_layers& l) { l.reorder(backwards); }, is_unchanged);
    fail_everywhere([&](small_layers& l) { l = small_layers(make_grid(9, 9)); }, is_unchanged);
    const small_layers other(make_grid(5, 7));
    fail_everywhere([&](small_layers& l) { l = other; }, is_unchanged);
    fail_everywhere([&](small_layers& l) { layered_image<disparity_column, known_column> more(std::move(l)); }, is_unchanged);
    fail_everywhere(
        [](small_layers& l) {
            l.grow([](graph_builder b) {
                b.add_pixel(0, 0);
                return grown_pixels{std::move(b).build(), {{0, 16, false}, {0, 1, true}}, {5}};
            });
        },
        [](const small_layers& l) { REQUIRE(l.size() == 0); });
    fail_everywhere(
        [](small_layers& l) {
            graph_builder b(4, 4);
            try {
                for (std::int32_t i = 0; i < 16; ++i) b.add_pixel(i % 4, i / 4);
            } catch (const std::bad_alloc&) {
                const graph partial = std::move(b).build();
                REQUIRE_FALSE(validate(graph_view(partial)));
                throw;
            }
            l = small_layers(std::move(b).build());
        },
        is_unchanged);
    short_memory source;  // must outlive g
    graph g = make_grid(3, 3);
    const graph before = g, larger = make_grid(30, 30);
    for (std::size_t n = 0; g.size() == 9; ++n) {
        const memory_scope scope(source.source);
        source.left = n;
        try {
            g = larger;
        } catch (const std::bad_alloc&) {
            REQUIRE(g == before);
        }
    }
}
#endif

TEST_CASE("the image is empty while edit_links() or grow() runs its callback, so the callback cannot change it directly") {
    layered_image<disparity_column> layers(make_grid(4, 4));
    layers.edit_links([&](link_editor& links) {
        CHECK(layers.size() == 0);
        layers.keep({});
        layers.set_column<disparity_column>({});
        links.unlink(0, side::right);
    });
    CHECK(layers.size() == 16);
    CHECK(is_sound(layers));
    CHECK(layers.topology().neighbor(0, side::right) == no_pixel);
    layers.grow([&](graph_builder b) {
        CHECK(layers.size() == 0);
        layers.set_column<disparity_column>({});
        return grown_pixels{std::move(b).build(), {{0, 16, false}}, {}};
    });
    CHECK(layers.size() == 16);
    CHECK(is_sound(layers));
}

TEST_CASE("grow() refuses an assignment to the image and leaves it empty") {
    layered_image<disparity_column> layers(make_grid(4, 4));
    const layered_image<disparity_column> other(make_grid(2, 2));
    CHECK(testing::raised([&] {
              layers.grow([&](graph_builder b) {
                  layers = other;
                  return grown_pixels{std::move(b).build(), {{0, 16, false}}, {}};
              });
          }) == error_code::mismatch);
    CHECK(layers.size() == 0);
}

TEST_CASE("edit_links() refuses an assignment to the image, and grow() refuses a smaller lattice") {
    layered_image<disparity_column> layers(make_grid(4, 4));
    const layered_image<disparity_column> other(make_grid(2, 2));
    CHECK(testing::raised([&] { layers.edit_links([&](link_editor&) { layers = other; }); }) == error_code::mismatch);
    CHECK(layers.size() == 16);
    CHECK(is_sound(layers));
    for (const auto& [width, height] : {std::pair{8, 2}, {2, 8}}) {
        layered_image<disparity_column> flat(make_grid(4, 4));
        CHECK(testing::raised([&, w = width, h = height] {
                  flat.grow([&](graph_builder) { return grown_pixels{make_grid(w, h), {{0, 16, false}}, {}}; });
              }) == error_code::mismatch);
        CHECK(flat.size() == 0);
    }
}

TEST_CASE("no function of a layered image constructs a column tag, so a tag's constructor may throw or be deleted") {
    using tagged = layered_image<disparity_column, throwing_tag, not_constructible_tag>;
    tagged layers(layered_image<disparity_column>(make_grid(4, 4)));
    CHECK(is_sound(layers));
    layers.grow([](graph_builder b) { return grown_pixels{std::move(b).build(), {{0, 16, false}}, {}}; });
    CHECK(is_sound(layers));
    CHECK(is_sound(coarsen(layers).layers));
}

TEST_CASE("new columns have one row per pixel and are zero") {
    const users_layers layers(make_grid(4, 3));
    REQUIRE(layers.size() == 12);
    CHECK(layers.column<normal_column>() == buffer<double>(36, 0.0));
    CHECK(layers.column<disparity_column>() == buffer<float>(12, 0.0F));
    CHECK(layers.column<name_column>() == buffer<std::string>(12));
    CHECK(users_layers().size() == 0);
}

TEST_CASE("columns with the same scalar type and channels are separate") {
    users_layers layers(make_grid(2, 1));
    layers.column<disparity_column>()[1] = 0.5F;
    CHECK(layers.column<other_disparity_column>()[1] == 0.0F);
}

TEST_CASE("the channels of a pixel are adjacent in its column") {
    users_layers layers(make_grid(2, 2));
    layers.at<normal_column>(2)[1] = 7.0;
    CHECK(layers.column<normal_column>()[2 * 3 + 1] == 7.0);
    const users_layers& fixed = layers;
    CHECK(fixed.at<normal_column>(2).data() == fixed.column<normal_column>().data() + 6);
}

TEST_CASE("grow() derives new rows from their origins by the rule of each column, and keeps the old rows") {
    testing::for_random_graphs(61, 200, [](const testing::random_layers& random_layers, std::mt19937& random) {
        if (random_layers.topology().size() == 0) return;
        using grown_layers = layered_image<disparity_column, known_column, name_column>;
        grown_layers layers(random_layers.topology());
        layers.set_column<disparity_column>(random_layers.disparity);
        for (std::int32_t i = 0; i < layers.topology().count(); ++i)
            layers.at<known_column>(i)[0] = 1, layers.at<name_column>(i)[0] = std::to_string(i);
        const grown_layers before = layers;

        // New pixels come before and after the old ones.
        const std::int32_t old_count = before.topology().count(), first = testing::below(random, 4);
        const std::int32_t last = testing::below(random, 4);
        buffer<std::int32_t> origins;
        for (std::int32_t i = 0; i < first + last; ++i) origins.push_back(testing::below(random, old_count));
        layers.grow([&](graph_builder b) {
            REQUIRE(b.count() == old_count);
            for (const std::int32_t origin : origins) b.add_pixel(b.x()[origin], b.y()[origin]);
            buffer<std::int32_t> order;
            for (std::int32_t i = 0; i < first; ++i) order.push_back(old_count + i);
            for (std::int32_t i = 0; i < old_count; ++i) order.push_back(i);
            for (std::int32_t i = 0; i < last; ++i) order.push_back(old_count + first + i);
            buffer<grown_piece> pieces;
            if (first > 0) pieces.push_back({0, first, true});
            pieces.push_back({0, old_count, false});
            if (last > 0) pieces.push_back({first, last, true});
            const graph unordered = std::move(b).build();
            return grown_pixels{ldi::reordered(unordered, order), pieces, origins};
        });
        REQUIRE(layers.topology().count() == first + old_count + last);
        for (std::int32_t i = 0; i < layers.topology().count(); ++i) {
            const bool is_old = i >= first && i < first + old_count;
            const std::int32_t from = is_old ? i - first : origins[i < first ? i : i - old_count];
            REQUIRE(layers.at<disparity_column>(i)[0] == before.at<disparity_column>(from)[0]);
            REQUIRE(layers.at<name_column>(i)[0] == std::to_string(from));
            REQUIRE(layers.at<known_column>(i)[0] == (is_old ? 1 : 0));
            REQUIRE(layers.topology().x()[i] == before.topology().x()[from]);
        }
    });
}

TEST_CASE("an exception in grow() leaves an empty image, and one in edit_links() leaves a sound image") {
    photo_layers layers(make_grid(3, 2));
    CHECK_THROWS(layers.edit_links([](link_editor& links) {
        links.unlink(0, side::right);
        throw 1;
    }));
    CHECK(layers.size() == 6);
    CHECK_FALSE(validate(layers));
    CHECK_THROWS(layers.grow([](graph_builder) -> grown_pixels { throw 1; }));
    CHECK(layers.size() == 0);
    CHECK(layers.column<color_column>().empty());
}

TEST_CASE("edit_links() refuses links that would make the topology invalid, and leaves a sound image") {
    photo_layers layers(make_grid(3, 2));
    const auto is_refused = [&](auto&& edit) {
        CHECK_THROWS_AS(layers.edit_links(edit), error);
        return is_sound(layers) && layers.topology() == make_grid(3, 2);
    };
    CHECK(is_refused([](link_editor& links) { links.link(0, side::right, 1); }));   // linked already
    CHECK(is_refused([](link_editor& links) { links.link(0, side::right, 4); }));   // two steps away
    CHECK(is_refused([](link_editor& links) { links.link(0, side::left, 2); }));    // on the other side of the lattice
    CHECK(is_refused([](link_editor& links) { links.link(5, side::right, 6); }));   // no such pixel
    CHECK(is_refused([](link_editor& links) { links.link(-1, side::right, 0); }));  // no such pixel
    CHECK(is_refused([](link_editor& links) { links.neighbor(-1, side::right); }));
    CHECK(is_refused([](link_editor& links) { links.neighbor(6, side::right); }));
    CHECK(is_refused([](link_editor& links) { links.neighbor(0, static_cast<side>(4)); }));
    CHECK(is_refused([](link_editor& links) { links.unlink(-1, side::right); }));
    CHECK(is_refused([](link_editor& links) { links.unlink(6, side::up); }));
    CHECK(is_refused([](link_editor& links) { links.unlink(0, static_cast<side>(7)); }));  // no such side
    CHECK(is_refused([](link_editor& links) { links.link(0, static_cast<side>(4), 1); }));
    CHECK_NOTHROW(layers.edit_links([](link_editor& links) { links.unlink(0, side::right), links.link(0, side::right, 1); }));
}

TEST_CASE("grow() refuses pieces that skip, repeat or exceed pixels, and origins out of range") {
    const auto grow = [](const buffer<grown_piece>& pieces, const buffer<std::int32_t>& origins) {
        photo_layers layers(make_grid(3, 2));
        layers.grow([&](graph_builder b) {
            for (std::size_t i = 0; i < origins.size(); ++i) b.add_pixel(0, 0);
            return grown_pixels{std::move(b).build(), pieces, origins};
        });
    };
    CHECK_NOTHROW(grow({{0, 6, false}, {0, 1, true}}, {5}));
    CHECK_THROWS_AS(grow({{0, 6, false}, {0, 1, true}}, {6}), error);
    CHECK_THROWS_AS(grow({{0, 6, false}, {0, 1, true}}, {-1}), error);
    CHECK_THROWS_AS(grow({{0, 6, false}}, {5}), error);
    CHECK_THROWS_AS(grow({{0, 3, false}, {0, 3, false}}, {}), error);
    CHECK_THROWS_AS(grow({{0, 7, false}}, {}), error);
    CHECK_THROWS_AS(grow({{0, 6, false}, {1, 1, true}}, {5}), error);
}

TEST_CASE("columns whose length does not match the graph are refused") {
    photo_layers layers(make_grid(3, 2));
    CHECK_THROWS_AS(layers.set_column<disparity_column>(buffer<float>(5)), error);
    CHECK_THROWS_AS(layers.set_column<color_column>(buffer<std::uint8_t>(6)), error);
    CHECK_THROWS_AS(layered_image<disparity_column>(make_grid(3, 2), buffer<float>(7)), error);
    const graph g = make_grid(3, 2);
    const buffer<float> five(5);
    CHECK_THROWS_AS(layered_view<disparity_column>(g, five), error);
    photo_layer layer(photo_layers(make_grid(3, 2)));
    layer.column<disparity_column>()[5] = 0.5F;
    CHECK_THROWS_AS(std::move(layer).with<normal_column>(buffer<double>(17)), error);
    CHECK(layer.size() == 6);  // NOLINT(bugprone-use-after-move): nothing moved
    CHECK(layer.column<disparity_column>()[5] == 0.5F);
}

TEST_CASE("photo_layer refuses layers that do not have exactly one pixel per position, row by row") {
    CHECK_NOTHROW(photo_layer(photo_layers(make_grid(3, 2))));
    photo_layers swapped(make_grid(3, 2));
    swapped.reorder(buffer<std::int32_t>{1, 0, 2, 3, 4, 5});
    CHECK_THROWS_AS(photo_layer(swapped), error);
    photo_layers fewer(make_grid(3, 2));
    fewer.keep(buffer<std::uint8_t>{1, 1, 1, 1, 1, 0});
    CHECK_THROWS_AS(photo_layer(fewer), error);
}

TEST_CASE("a moved-from layered image is empty") {
    photo_layers layers(make_grid(3, 2));
    const photo_layers moved = std::move(layers);
    CHECK(moved.size() == 6);
    CHECK(layers.size() == 0);  // NOLINT(bugprone-use-after-move)
    CHECK(layers.column<color_column>().empty());
    photo_layer layer(moved);
    const photo_layer other = std::move(layer);
    CHECK((other.size() == 6 && layer.size() == 0));  // NOLINT(bugprone-use-after-move)
    CHECK((layer.topology().width() == 0 && layer.column<color_column>().empty()));
}

TEST_CASE("a layered view refers to the caller's columns without a copy") {
    const graph g = make_grid(3, 2);
    buffer<float> mine{0, 1, 2, 3, 4, 5};
    const layered_view<disparity_column> view(g, mine);
    CHECK(view.column<disparity_column>().data() == mine.data());
    CHECK(view.at<disparity_column>(4)[0] == 4);
    const users_layers layers(make_grid(2, 2));
    const layered_view<name_column, disparity_column> part = layers;
    CHECK(part.column<name_column>().data() == layers.column<name_column>().data());
}

TEST_CASE("reorder() moves every pixel's values, including columns of the caller's types") {
    testing::for_random_graphs(60, 300, [](const testing::random_layers& random_layers, std::mt19937& random) {
        users_layers layers(random_layers.topology());
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i) {
            for (std::size_t c = 0; c < 3; ++c) layers.at<normal_column>(i)[c] = i + 0.25 * static_cast<double>(c);
            layers.at<name_column>(i)[0] = "pixel " + std::to_string(i);
        }
        layers.set_column<disparity_column>(random_layers.disparity);

        const users_layers before = layers;
        const buffer<std::int32_t> order = testing::random_permutation(random, layers.size());
        layers.reorder(order);
        REQUIRE(layers.topology() == ldi::reordered(before.topology(), order));
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i) {
            const std::int32_t old = order[static_cast<std::size_t>(i)];
            REQUIRE(layers.at<name_column>(i)[0] == "pixel " + std::to_string(old));
            REQUIRE(layers.at<disparity_column>(i)[0] == before.at<disparity_column>(old)[0]);
            for (std::size_t c = 0; c < 3; ++c) REQUIRE(layers.at<normal_column>(i)[c] == before.at<normal_column>(old)[c]);
        }
    });
}

TEST_CASE("keep() removes the other pixels and their links, and keeps the order, rows and links of the rest") {
    testing::for_random_graphs(60, 300, [](const testing::random_layers& random_layers, std::mt19937& random) {
        users_layers before(random_layers.topology());
        before.set_column<disparity_column>(random_layers.disparity);
        buffer<std::uint8_t> kept(before.size());
        buffer<std::int32_t> now(before.size(), no_pixel);
        std::int32_t count = 0;
        for (std::size_t i = 0; i < kept.size(); ++i)
            if ((kept[i] = testing::chance(random, 60) ? 7 : 0) != 0) now[i] = count++;
        users_layers layers = before;
        layers.keep(kept);
        REQUIRE(layers.size() == static_cast<std::size_t>(count));
        REQUIRE(layers.column<name_column>().size() == layers.size());
        for (std::size_t i = 0; i < kept.size(); ++i) {
            if (kept[i] == 0) continue;
            REQUIRE(layers.at<disparity_column>(now[i])[0] == before.at<disparity_column>(static_cast<std::int32_t>(i))[0]);
            for (const side s : all_sides) {
                const std::int32_t neighbor = before.topology().neighbors(s)[i];
                const std::int32_t expected = neighbor == no_pixel ? no_pixel : now[static_cast<std::size_t>(neighbor)];
                REQUIRE(layers.topology().neighbor(now[i], s) == expected);
            }
        }
    });
}

TEST_CASE("keep() refuses a list without exactly one entry per pixel, and changes nothing") {
    layered_image<known_column> layers(make_grid(3, 2));
    for (const std::size_t count : {std::size_t{0}, std::size_t{5}, std::size_t{7}}) {
        const buffer<std::uint8_t> kept(count);
        CHECK_THROWS_AS(layers.keep(kept), error);
        CHECK(layers.size() == 6);
    }
}
