#pragma once
#include <ldi/base/memory.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace ldi::inline LDI_CONFIGURATION {

struct texture_options {
    float strength = 0.75F;
    int reach = 32;
    int fine = 1;      // passes for residual
    int coarse = 3;    // passes for descriptors
    int spacing = 4;   // of the taps
    int rounds = 3;
    float limit = 20;  // soft limit
    int coherence = 24;
    int bad = 1000;
    int mode = 0;
    float sharp = 0;
};

namespace detail {

inline std::uint32_t hash_of(std::uint32_t a, std::uint32_t b) {
    std::uint32_t h = a * 0x9E3779B1U ^ b * 0x85EBCA77U ^ 0x27D4EB2FU;
    h = (h ^ h >> 16) * 0x85EBCA6BU;
    h = (h ^ h >> 13) * 0xC2B2AE35U;
    return h ^ h >> 16;
}

struct texture_cells {
    buffer<std::int32_t> pixel;
    std::array<buffer<std::int32_t>, 4> next;  // cell or -1
    buffer<std::uint8_t> is_source, hidden;
    std::int32_t neighbor(std::int32_t c, side s) const { return next[static_cast<std::size_t>(s)][c]; }
    std::int32_t walk(std::int32_t c, side s, int steps) const {
        const auto& n = next[static_cast<std::size_t>(s)];
        for (; steps > 0; --steps) {
            const std::int32_t to = n[c];
            if (to < 0) break;
            c = to;
        }
        return c;
    }
};

inline texture_cells make_cells(const graph& g, const buffer<std::uint8_t>& known, int reach) {
    buffer<std::uint8_t> ring(g.size(), 255);
    buffer<std::int32_t> wave, further;
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (known[i] == 0) {
            ring[i] = 0;
            for (side s : all_sides) {
                const std::int32_t n = g.neighbor(i, s);
                if (n != no_pixel && known[n] != 0 && ring[n] == 255) ring[n] = 1, wave.push_back(n);
            }
        }
    for (int r = 2; r <= reach && !wave.empty(); ++r) {
        further.clear();
        for (std::int32_t i : wave)
            for (side s : all_sides) {
                const std::int32_t n = g.neighbor(i, s);
                if (n != no_pixel && ring[n] == 255) ring[n] = static_cast<std::uint8_t>(r), further.push_back(n);
            }
        wave.swap(further);
    }
    texture_cells cells;
    buffer<std::int32_t> cell_of(g.size(), -1);
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (ring[i] != 255) cell_of[i] = cells.pixel.count(), cells.pixel.push_back(i);
    for (side s : all_sides) {
        auto& next = cells.next[static_cast<std::size_t>(s)];
        next.resize(cells.pixel.size());
        for (std::int32_t c = 0; c < cells.pixel.count(); ++c) {
            const std::int32_t n = g.neighbor(cells.pixel[c], s);
            next[c] = n == no_pixel ? -1 : cell_of[n];
        }
    }
    cells.is_source.resize(cells.pixel.size());
    cells.hidden.resize(cells.pixel.size());
    for (std::int32_t c = 0; c < cells.pixel.count(); ++c) {
        const int r = ring[cells.pixel[c]];
        cells.hidden[c] = r == 0;
        cells.is_source[c] = r >= 1 && r <= reach - 3;
    }
    return cells;
}

using rgb = std::array<float, 3>;

inline void blur(const texture_cells& cells, buffer<rgb>& values, int passes) {
    buffer<rgb> other(values.size(), unset);
    for (int p = 0; p < passes; ++p)
        for (const auto& [a, b] : {std::array{side::left, side::right}, std::array{side::up, side::down}}) {
            for (std::int32_t c = 0; c < cells.pixel.count(); ++c) {
                const std::int32_t l = cells.neighbor(c, a), r = cells.neighbor(c, b);
                const rgb &m = values[c], &u = l < 0 ? m : values[l], &v = r < 0 ? m : values[r];
                for (std::size_t k = 0; k < 3; ++k) other[c][k] = 0.5F * m[k] + 0.25F * (u[k] + v[k]);
            }
            values.swap(other);
        }
}

using descriptor = std::array<std::uint8_t, 16>;

inline int distance(const descriptor& a, const descriptor& b) {
    int sum = 0;
    for (std::size_t i = 0; i < 16; ++i) sum += std::abs(int{a[i]} - int{b[i]});
    return sum;
}

struct source_search {
    const texture_cells& cells;
    const buffer<descriptor>& look;
    const graph& g;
    const texture_options& options;
    buffer<std::int32_t> hidden, source, root;
    buffer<int> cost;

    int energy(std::int32_t c, std::int32_t s) const {
        int sum = distance(look[c], look[s]);
        for (side d : all_sides) {
            const std::int32_t n = cells.neighbor(c, d);
            if (n < 0 || cells.hidden[n] == 0) continue;
            const std::int32_t sn = source[n];
            if (sn < 0 || cells.neighbor(s, d) != sn) sum += options.coherence;
        }
        return sum;
    }
    void consider(std::int32_t c, std::int32_t s, int& best) {
        if (s < 0 || cells.is_source[s] == 0) return;
        const int e = energy(c, s);
        if (e < best) best = e, source[c] = s;
    }
    std::int32_t wander(std::int32_t from, std::uint32_t random, int radius) const {
        const int span = 2 * radius + 1;
        const int dx = static_cast<int>((random & 0xFFFF) * static_cast<std::uint32_t>(span) >> 16) - radius;
        const int dy = static_cast<int>((random >> 16) * static_cast<std::uint32_t>(span) >> 16) - radius;
        const std::int32_t across = cells.walk(from, dx < 0 ? side::left : side::right, std::abs(dx));
        return cells.walk(across, dy < 0 ? side::up : side::down, std::abs(dy));
    }
    void run() {
        const std::int32_t n = cells.pixel.count();
        source.assign(cells.pixel.size(), -1);
        root.assign(cells.pixel.size(), -1);
        // roots: nearest known
        buffer<std::int32_t> wave, further;
        for (std::int32_t c = 0; c < n; ++c) {
            if (cells.hidden[c] == 0) continue;
            hidden.push_back(c);
            for (side d : all_sides) {
                const std::int32_t m = cells.neighbor(c, d);
                if (m >= 0 && cells.hidden[m] == 0 && root[c] < 0) root[c] = m;
            }
            if (root[c] >= 0) wave.push_back(c);
        }
        while (!wave.empty()) {
            further.clear();
            for (std::int32_t c : wave)
                for (side d : all_sides) {
                    const std::int32_t m = cells.neighbor(c, d);
                    if (m >= 0 && cells.hidden[m] != 0 && root[m] < 0) root[m] = root[c], further.push_back(m);
                }
            wave.swap(further);
        }
        for (int round = 0; round < options.rounds; ++round) {
            const bool forward = round % 2 == 0;
            for (std::int32_t k = 0; k < hidden.count(); ++k) {
                const std::int32_t c = hidden[forward ? k : hidden.count() - 1 - k];
                if (root[c] < 0) continue;
                int best = source[c] < 0 ? 1 << 30 : energy(c, source[c]);
                for (side d : {forward ? side::left : side::right, forward ? side::up : side::down}) {
                    const std::int32_t m = cells.neighbor(c, d);
                    if (m >= 0 && source[m] >= 0) consider(c, cells.neighbor(source[m], opposite(d)), best);
                }
                const std::uint32_t h = hash_of(static_cast<std::uint32_t>(g.x[cells.pixel[c]]),
                                                static_cast<std::uint32_t>(g.y[cells.pixel[c]]) * 64U + static_cast<std::uint32_t>(round));
                if (source[c] >= 0 && (h & 7U) != 0) continue;
                for (std::uint32_t t = 0; t < 4; ++t) consider(c, wander(root[c], hash_of(h, t), options.reach), best);
                for (int radius = options.reach / 2; radius > 0 && source[c] >= 0; radius /= 2)
                    consider(c, wander(source[c], hash_of(h, static_cast<std::uint32_t>(100 + radius)), radius), best);
            }
        }
    }
};

}  // namespace detail

template <has_columns<color_column, known_column> Layers>
void add_texture(Layers& layers, const texture_options& options = {}) {
    const graph& g = layers.topology;
    const detail::texture_cells cells = detail::make_cells(g, layers.template column<known_column>(), options.reach);
    const std::int32_t n = cells.pixel.count();
    buffer<detail::rgb> color(cells.pixel.size(), unset);
    for (std::int32_t c = 0; c < n; ++c)
        for (std::size_t k = 0; k < 3; ++k) color[c][k] = layers.template at<color_column>(cells.pixel[c])[k];
    buffer<detail::rgb> low = color;
    detail::blur(cells, low, options.fine);
    buffer<detail::rgb> fine(cells.pixel.size(), unset);
    for (std::int32_t c = 0; c < n; ++c)
        for (std::size_t k = 0; k < 3; ++k) fine[c][k] = color[c][k] - low[c][k];
    if (options.sharp != 0) {
        buffer<detail::rgb> f2 = fine;
        detail::blur(cells, f2, 1);
        for (std::int32_t c = 0; c < n; ++c)
            for (std::size_t k = 0; k < 3; ++k) fine[c][k] += options.sharp * (fine[c][k] - f2[c][k]);
    }
    detail::blur(cells, low, options.coarse);
    buffer<detail::descriptor> look(cells.pixel.size());
    for (std::int32_t c = 0; c < n; ++c) {
        std::size_t at = 0;
        const auto put = [&](std::int32_t from) {
            for (std::size_t k = 0; k < 3; ++k) look[c][at++] = detail::rounded_mean(low[from][k]);
        };
        put(c);
        for (side s : all_sides) put(cells.walk(c, s, options.spacing));
    }
    detail::source_search search{cells, look, g, options, {}, {}, {}, {}};
    search.run();
    for (std::int32_t c : search.hidden) {
        const std::int32_t s = search.source[c];
        if (s < 0) continue;
        const int d = detail::distance(look[c], look[s]);
        const float trust = options.strength * std::clamp(2.0F - static_cast<float>(d) / static_cast<float>(options.bad), 0.0F, 1.0F);
        for (std::size_t k = 0; k < 3; ++k) {
            float r = fine[s][k];
            if (options.mode == 1) r -= fine[c][k];
            r = r / (1.0F + std::abs(r) / options.limit);
            std::uint8_t& v = layers.template at<color_column>(cells.pixel[c])[k];
            v = detail::rounded_to_byte(static_cast<float>(v) + trust * r);
        }
    }
}

}  // namespace ldi
