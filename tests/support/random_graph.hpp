// Random layered graphs for property tests: sheets with silhouettes, surfaces that pass over themselves, several layers at a
// position, ribbons one pixel wide, bridges of a single pixel, helices around the end of a silhouette, and random links.
#pragma once

#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/layered_image.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace ldi::testing {

/// A graph and one disparity per pixel, all different, so that its canonical order does not depend on its previous order.
struct random_layers {
    graph made;
    buffer<float> disparity;

    const graph& topology() const { return made; }
};

/// A number in [0, bound). The standard distributions differ between standard libraries, so this function does not use them.
inline std::int32_t below(std::mt19937& random, std::int32_t bound) {
    return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(bound));
}

inline bool chance(std::mt19937& random, std::int32_t percent) { return below(random, 100) < percent; }

inline side random_side(std::mt19937& random) { return all_sides[below(random, 4)]; }

inline buffer<std::int32_t> random_permutation(std::mt19937& random, std::size_t count) {
    buffer<std::int32_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    for (std::size_t i = count; i > 1; --i)
        std::swap(order[i - 1], order[static_cast<std::size_t>(below(random, static_cast<std::int32_t>(i)))]);
    return order;
}

inline random_layers reordered(const random_layers& layers, std::span<const std::int32_t> order) {
    return {ldi::reordered(layers.topology(), order), ldi::reordered(layers.disparity, order)};
}

inline random_layers shuffled(const random_layers& layers, std::mt19937& random) {
    return reordered(layers, random_permutation(random, layers.topology().size()));
}

inline random_layers in_canonical_order(const random_layers& layers) {
    return reordered(layers, canonical_order(layers.topology(), layers.disparity));
}

/// Pieces of random graphs. A new piece may share positions with existing pieces, but no pixels.
class random_pieces {
public:
    random_pieces(std::mt19937& random, std::int32_t width, std::int32_t height) : random_(random), g_(width, height) {}

    graph result() const { return graph_builder(g_).build(); }

    /// A fully linked rectangle, clipped at the lattice's border. Returns its pixels, row-major.
    buffer<std::int32_t> add_sheet(std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height) {
        const std::int32_t right = std::min<std::int32_t>(x + width, g_.width()),
                           bottom = std::min<std::int32_t>(y + height, g_.height());
        x = std::max<std::int32_t>(x, 0), y = std::max<std::int32_t>(y, 0);
        buffer<std::int32_t> pixels;
        for (std::int32_t row = y; row < bottom; ++row)
            for (std::int32_t column = x; column < right; ++column) {
                pixels.push_back(g_.add_pixel(column, row));
                const std::size_t width_here = static_cast<std::size_t>(right - x);
                if (column > x) g_.link(pixels.back(), side::left, pixels[pixels.size() - 2]);
                if (row > y) g_.link(pixels.back(), side::up, pixels[pixels.size() - 1 - width_here]);
            }
        return pixels;
    }

    void add_random_sheet() {
        const std::int32_t x = below(random_, g_.width()), y = below(random_, g_.height());
        add_sheet(x, y, 1 + below(random_, g_.width()), 1 + below(random_, g_.height()));
    }

    /// Adds a sheet that continues a pixel's surface beyond a free side of the pixel, linked along a seam. Where the sheet
    /// overlaps the surface, the surface passes over itself.
    void add_fold() {
        if (g_.size() == 0) return;
        const std::int32_t from = random_pixel();
        const side s = random_side(random_);
        const std::int32_t x = x_of(from) + step_x(s), y = y_of(from) + step_y(s);
        if (g_.neighbor(from, s) != no_pixel || !inside(x, y)) return;
        const std::int32_t width = 1 + below(random_, 6), height = 1 + below(random_, 6);
        // A random position of the sheet's edge that faces the pixel `from` touches this pixel.
        const std::int32_t left = s == side::right ? x : s == side::left ? x - width + 1 : x - below(random_, width);
        const std::int32_t top = s == side::down ? y : s == side::up ? y - height + 1 : y - below(random_, height);
        const buffer<std::int32_t> sheet = add_sheet(left, top, width, height);
        // Links the seam: from the first pair of pixels in both directions, as far as both surfaces are adjacent.
        const auto there = std::find_if(sheet.begin(), sheet.end(), [&](std::int32_t p) { return x_of(p) == x && y_of(p) == y; });
        g_.link(from, s, *there);
        for (const side along : {step_x(s) != 0 ? side::up : side::left, step_x(s) != 0 ? side::down : side::right}) {
            std::int32_t a = g_.neighbor(from, along), b = g_.neighbor(*there, along);
            while (a != no_pixel && b != no_pixel && g_.neighbor(a, s) == no_pixel && g_.neighbor(b, opposite(s)) == no_pixel) {
                g_.link(a, s, b);
                a = g_.neighbor(a, along), b = g_.neighbor(b, along);
            }
        }
    }

    /// A path one pixel wide that may cross itself, from a free side of a pixel or from a new pixel.
    void add_ribbon() {
        std::int32_t at = g_.size() > 0 && chance(random_, 50)
                              ? random_pixel()
                              : g_.add_pixel(below(random_, g_.width()), below(random_, g_.height()));
        side s = random_side(random_);
        for (std::int32_t length = 1 + below(random_, 20); length > 0; --length) {
            if (chance(random_, 30)) s = random_side(random_);
            const std::int32_t x = x_of(at) + step_x(s), y = y_of(at) + step_y(s);
            if (!inside(x, y) || g_.neighbor(at, s) != no_pixel) continue;
            const std::int32_t next = g_.add_pixel(x, y);
            g_.link(at, s, next);
            at = next;
        }
    }

    /// Adds turns around the lattice point (x, y), each a square of `radius` pixels to each side. Above the point, each turn
    /// is linked to the next, so that a path around the point leads to another layer.
    void add_helix(std::int32_t x, std::int32_t y, std::int32_t radius, std::int32_t turns) {
        buffer<buffer<std::int32_t>> turn;
        for (std::int32_t t = 0; t < turns; ++t) turn.push_back(add_sheet(x - radius, y - radius, 2 * radius, 2 * radius));
        std::vector<std::pair<std::int32_t, std::int32_t>> seams;  // per turn: the pixels left and right of the seam
        for (const buffer<std::int32_t>& pixels : turn)
            for (const std::int32_t p : pixels)
                if (x_of(p) == x - 1 && y_of(p) < y && g_.neighbor(p, side::right) != no_pixel)
                    seams.emplace_back(p, g_.neighbor(p, side::right));
        for (const auto& [left, right] : seams) g_.unlink(left, side::right);
        const std::size_t height = turns > 0 ? seams.size() / turn.size() : 0;
        for (std::size_t i = 0; i + height < seams.size(); ++i) g_.link(seams[i].first, side::right, seams[i + height].second);
    }

    void add_random_helix() {
        add_helix(1 + below(random_, g_.width()), 1 + below(random_, g_.height()), 1 + below(random_, 3), 1 + below(random_, 3));
    }

    /// Pixels anywhere, linked at random.
    void add_disorder() {
        for (std::int32_t count = 1 + below(random_, 30); count > 0; --count)
            g_.add_pixel(below(random_, g_.width()), below(random_, g_.height()));
        add_bridges(100);
    }

    /// Tries to link adjacent pixels this many times.
    void add_bridges(std::int32_t tries) {
        for (; g_.size() > 0 && tries > 0; --tries) {
            const std::int32_t a = random_pixel(), b = random_pixel();
            const side s = random_side(random_);
            const bool beside = x_of(b) == x_of(a) + step_x(s) && y_of(b) == y_of(a) + step_y(s);
            if (beside && g_.neighbor(a, s) == no_pixel && g_.neighbor(b, opposite(s)) == no_pixel) g_.link(a, s, b);
        }
    }

    /// A straight silhouette, through all layers or only through some pixels.
    void cut() {
        const bool vertical = chance(random_, 50);
        const std::int32_t line = below(random_, vertical ? g_.width() : g_.height());
        const std::int32_t first = below(random_, vertical ? g_.height() : g_.width()), last = first + below(random_, 10);
        const std::int32_t percent = chance(random_, 50) ? 100 : 60;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g_.size()); ++i) {
            const std::int32_t across = vertical ? x_of(i) : y_of(i), along = vertical ? y_of(i) : x_of(i);
            if (across == line && along >= first && along <= last && chance(random_, percent))
                g_.unlink(i, vertical ? side::left : side::up);
        }
    }

    void drop_links(std::int32_t percent) {
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g_.size()); ++i)
            for (const side s : all_sides)
                if (chance(random_, percent)) g_.unlink(i, s);
    }

    void drop_pixels(std::int32_t percent) {
        buffer<std::uint8_t> kept;
        for (std::size_t i = 0; i < g_.size(); ++i) kept.push_back(chance(random_, percent) ? 0 : 1);
        layered_image<> pixels(result());
        pixels.keep(kept);
        g_ = graph_builder(pixels.topology());
    }

private:
    std::int32_t x_of(std::int32_t pixel) const { return g_.x()[static_cast<std::size_t>(pixel)]; }
    std::int32_t y_of(std::int32_t pixel) const { return g_.y()[static_cast<std::size_t>(pixel)]; }
    bool inside(std::int32_t x, std::int32_t y) const { return x >= 0 && x < g_.width() && y >= 0 && y < g_.height(); }
    std::int32_t random_pixel() { return below(random_, static_cast<std::int32_t>(g_.size())); }

    std::mt19937& random_;
    graph_builder g_;
};

/// A graph of some of these pieces, in canonical order, on a lattice of at most largest_side x largest_side. May be empty.
inline random_layers random_graph(std::mt19937& random, std::int32_t largest_side = 14) {
    const std::int32_t width = 1 + below(random, largest_side), height = 1 + below(random, largest_side);
    random_pieces builder(random, width, height);
    if (chance(random, 50)) builder.add_sheet(0, 0, width, height);
    for (std::int32_t pieces = below(random, 7); pieces > 0; --pieces) {
        switch (below(random, 6)) {
            case 0: builder.add_random_sheet(); break;
            case 1: builder.add_fold(); break;
            case 2: builder.add_ribbon(); break;
            case 3: builder.add_random_helix(); break;
            case 4: builder.add_disorder(); break;
            default: builder.add_bridges(50); break;
        }
        if (chance(random, 50)) builder.add_fold();
    }
    for (std::int32_t cuts = below(random, 5); cuts > 0; --cuts) builder.cut();
    if (chance(random, 30)) builder.drop_links(chance(random, 50) ? 3 : 30);
    if (chance(random, 20)) builder.drop_pixels(20);

    random_layers layers{builder.result(), {}};
    for (const std::int32_t rank : random_permutation(random, layers.topology().size()))
        layers.disparity.push_back((static_cast<float>(rank) + 0.5F) / static_cast<float>(layers.topology().size()));
    return in_canonical_order(layers);
}

/// Calls `check(layers, random)` for `count` random graphs, half of them shuffled.
template <class Check>
void for_random_graphs(std::uint32_t seed, std::int32_t count, Check&& check) {
    std::mt19937 random(seed);
    for (std::int32_t i = 0; i < count; ++i) {
        const random_layers layers = random_graph(random);
        check(i % 2 == 0 ? layers : shuffled(layers, random), random);
    }
}

}  // namespace ldi::testing
