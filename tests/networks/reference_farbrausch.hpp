// The inpainting network as described in examples/training/farbrausch/README.md, step by step, one window at a time, for every
// pixel, in double precision. Slow: the reference for the fast implementation.
#pragma once

#include <ldi/core/coarsening.hpp>
#include <ldi/core/window.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi::testing {

/// The network's result: K x 3 each, 0 to 1.
struct reference_result {
    buffer<double> fill, tone, output;
};

class reference_farbrausch {
public:
    reference_farbrausch(const named_tensors& weights, inpainting_architecture architecture)
        : weights_(weights), architecture_(std::move(architecture)), levels_(architecture_.channels.size()) {}

    /// color  K x 3
    /// known  K values, 0 or 1
    reference_result run(const graph_view& finest, const buffer<double>& color, ldi::array_view<const std::uint8_t> known) {
        graphs_.assign(1, graph_builder(finest).build());
        kept_.clear(), above_.clear();
        for (std::size_t i = 0; i < levels_; ++i) {
            const coarsened next = coarsen(graphs_.back(), orphan_rule::adopt_nearest);
            kept_.push_back(next.map.kept().copy());
            above_.push_back(corners(graphs_.back(), next.map.kept().copy()));
            graphs_.push_back(next.topology);
        }
        colors_.assign(levels_ + 1, {});
        for (std::size_t p = 0; p < finest.size(); ++p)
            colors_[0].push_back(known[p] != 0 ? pixel{color[3 * p], color[3 * p + 1], color[3 * p + 2], 1.0} : pixel{});
        for (std::size_t i = 0; i < levels_; ++i)
            for (const std::int32_t p : kept_[i]) colors_[i + 1].push_back(average(graphs_[i], colors_[i], p));
        std::vector<pixel> fill = colors_[levels_];
        spread(fill, levels_, architecture_.growth);
        std::vector<pixel> tone = fill;
        for (std::size_t i = levels_; i-- > 0;) {
            std::vector<pixel> finer_fill = colors_[i], finer_tone = colors_[i];
            for (std::size_t p = 0; p < graphs_[i].size(); ++p) {
                const std::int32_t from = above_[i][p];
                if (from == no_pixel) continue;
                if (finer_fill[p][3] == 0.0) finer_fill[p] = fill[static_cast<std::size_t>(from)];
                if (tone[static_cast<std::size_t>(from)][3] != 0.0) finer_tone[p] = tone[static_cast<std::size_t>(from)];
            }
            std::vector<pixel> linked = finer_fill;
            if (i == 0) color_along_links(graphs_[0], linked);
            spread(finer_fill, i, 2 << i);
            for (std::size_t p = 0; i == 0 && p < linked.size(); ++p)
                if (finer_fill[p][3] == 0.0) finer_fill[p] = linked[p];
            fill = std::move(finer_fill);
            tone.resize(graphs_[i].size());
            for (std::size_t p = 0; p < tone.size(); ++p) tone[p] = average(graphs_[i], finer_tone, static_cast<std::int32_t>(p));
        }
        pixel mean{};
        for (const pixel& c : colors_[0])
            for (std::size_t k = 0; k < 4; ++k) mean[k] += c[k];
        for (std::size_t k = 0; k < 3; ++k) mean[k] /= std::max(mean[3], 1.0);

        const bool has_fills = architecture_.missing == missing_colors::filled;
        reference_result result;
        std::vector<features> skips(1);
        skips[0].channels = architecture_.inputs(0);
        for (std::size_t p = 0; p < finest.size(); ++p) {
            const pixel f = fill[p][3] != 0.0 ? fill[p] : mean, t = tone[p][3] != 0.0 ? tone[p] : f;
            for (std::size_t k = 0; k < 3; ++k) {
                result.fill.push_back(f[k]), result.tone.push_back(t[k]);
                skips[0].values.push_back(has_fills ? f[k] - t[k] : color[3 * p + k]);
            }
            if (has_fills) skips[0].values.push_back(known[p]);
            skips[0].mask.push_back(has_fills ? 1 : known[p]);
        }
        for (std::size_t i = 0; i < levels_; ++i) {
            features encoded{{}, architecture_.channels[i], {}};
            for (const std::int32_t p : kept_[i])
                convolve("encoder." + std::to_string(i), i, p, architecture_.kernels[i], {}, skips[i], 0.0, encoded);
            skips.push_back(std::move(encoded));
        }
        features y = skips.back();
        for (std::size_t j = 0; j < levels_; ++j) {
            const std::size_t i = levels_ - 1 - j;
            features decoded{{}, i == 0 ? 3 : architecture_.inputs(i), {}};
            for (std::size_t p = 0; p < graphs_[i].size(); ++p)
                convolve("decoder." + std::to_string(j), i, static_cast<std::int32_t>(p), 3, y, skips[i],
                         i == 0 ? 1.0 : double{architecture_.leak}, decoded);
            y = std::move(decoded);
        }
        for (std::size_t v = 0; v < y.values.size(); ++v)
            result.output.push_back((has_fills ? result.fill[v] : 0.0) + y.values[v]);
        return result;
    }

private:
    using pixel = std::array<double, 4>;  // red, green, blue, and 1 for a known color
    struct features {
        buffer<double> values;
        std::size_t channels = 0;
        buffer<std::uint8_t> mask;
    };

    /// For each pixel, the coarse pixel at the even/even corner of its 2 x 2 group, if links inside the group lead there.
    static buffer<std::int32_t> corners(const graph_view& g, const buffer<std::int32_t>& kept) {
        buffer<std::int32_t> coarse(g.size(), no_pixel), result(g.size(), no_pixel);
        for (std::size_t i = 0; i < kept.size(); ++i) coarse[static_cast<std::size_t>(kept[i])] = static_cast<std::int32_t>(i);
        for (std::size_t p = 0; p < g.size(); ++p) {
            buffer<std::int32_t> seen{static_cast<std::int32_t>(p)};
            for (std::size_t next = 0; next < seen.size() && result[p] == no_pixel; ++next) {
                const std::size_t at = static_cast<std::size_t>(seen[next]);
                if (g.x()[at] % 2 == 0 && g.y()[at] % 2 == 0) result[p] = coarse[at];
                for (const side s : all_sides) {
                    const std::int32_t to = g.neighbors(s)[at];
                    if (to == no_pixel) continue;
                    const std::size_t t = static_cast<std::size_t>(to);
                    if (g.x()[t] / 2 == g.x()[p] / 2 && g.y()[t] / 2 == g.y()[p] / 2 &&
                        std::find(seen.begin(), seen.end(), to) == seen.end())
                        seen.push_back(to);
                }
            }
        }
        return result;
    }

    static pixel average(const graph_view& g, const std::vector<pixel>& values, std::int32_t at) {
        std::array<std::int32_t, 9> window;
        gather_window(g, at, 3, window);
        pixel sum{};
        for (const std::int32_t p : window)
            for (std::size_t k = 0; p != no_pixel && k < 4; ++k) sum[k] += values[static_cast<std::size_t>(p)][k];
        if (sum[3] == 0.0) return {};
        return {sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], 1.0};
    }

    /// Repeatedly gives each pixel without a color the average of its linked pixels with one, until nothing changes.
    static void color_along_links(const graph_view& g, std::vector<pixel>& values) {
        for (bool changes = true; changes;) {
            changes = false;
            const std::vector<pixel> before = values;
            for (std::size_t p = 0; p < values.size(); ++p) {
                if (before[p][3] != 0.0) continue;
                pixel sum{};
                for (const side s : all_sides)
                    if (const std::int32_t n = g.neighbors(s)[p]; n != no_pixel)
                        for (std::size_t k = 0; k < 4; ++k) sum[k] += before[static_cast<std::size_t>(n)][k];
                if (sum[3] == 0.0) continue;
                values[p] = {sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], 1.0};
                changes = true;
            }
        }
    }

    void spread(std::vector<pixel>& values, std::size_t level, int passes) const {
        for (int pass = 0; pass < passes; ++pass) {
            const std::vector<pixel> before = values;
            for (std::size_t p = 0; p < values.size(); ++p)
                values[p] = colors_[level][p][3] != 0.0 ? colors_[level][p]
                                                        : average(graphs_[level], before, static_cast<std::int32_t>(p));
        }
    }

    /// Computes one pixel of a layer, and appends it as a row to `result`.
    ///
    /// up    features of the next coarser level
    /// skip  features of this level
    void convolve(const std::string& name, std::size_t level, std::int32_t at, std::int32_t kernel, const features& up,
                  const features& skip, double leak, features& result) const {
        const std::size_t elements = static_cast<std::size_t>(kernel * kernel), c_in = up.channels + skip.channels,
                          c_out = result.channels;
        const buffer<float>& w = tensor_values<float>(
            weights_, name + ".weight", {c_out, c_in, static_cast<std::size_t>(kernel), static_cast<std::size_t>(kernel)});
        const buffer<float>& b = tensor_values<float>(weights_, name + ".bias", {c_out});
        buffer<std::int32_t> window(elements);
        gather_window(graphs_[level], at, kernel, window);
        buffer<double> sums(c_out, 0.0);
        std::size_t count = 0;
        const auto add = [&](const features& from, std::int32_t row, std::size_t first_channel, std::size_t element) {
            if (row == no_pixel || from.mask[row] == 0) return;
            count += from.channels;
            for (std::size_t o = 0; o < c_out; ++o)
                for (std::size_t c = 0; c < from.channels; ++c)
                    sums[o] += double{w[(o * c_in + first_channel + c) * elements + element]} *
                               from.values[static_cast<std::size_t>(row) * from.channels + c];
        };
        for (std::size_t e = 0; e < elements; ++e) {
            if (window[e] == no_pixel) continue;
            if (up.channels != 0) add(up, above_[level][window[e]], 0, e);
            add(skip, window[e], up.channels, e);
        }
        for (std::size_t o = 0; o < c_out; ++o) {
            const double sum = count == 0 ? 0.0 : sums[o] * nearest(c_in * elements) / nearest(count) + double{b[o]};
            result.values.push_back(sum > 0.0 ? sum : leak * sum);
        }
        result.mask.push_back(count == 0 ? 0 : 1);
    }

    static double nearest(std::size_t n) { return static_cast<double>(n); }

    const named_tensors& weights_;
    inpainting_architecture architecture_;
    std::size_t levels_;
    std::vector<graph> graphs_;
    buffer<buffer<std::int32_t>> kept_, above_;
    std::vector<std::vector<pixel>> colors_;
};

}  // namespace ldi::testing
