// Estimates how much of each color beside a silhouette comes from the nearer surface, where this share is unknown. Each pixel
// searches for the pair of samples, one from each surface, whose mixture is closest to its color: C = alpha F + (1 - alpha) B
// (Wang and Cohen, Optimized Color Sampling for Robust Matting, CVPR 2007; Gastal and Oliveira, Shared Sampling for Real-Time
// Alpha Matting, Eurographics 2010). Diffusion then smooths the shares. The smaller the error of a pixel's pair, the closer the
// pixel stays to its own estimate.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/inpaint/detail/silhouette_band.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A color as a mixture of two colors.
struct mixture {
    float alpha = 0;  ///< share of the foreground
    float_color foreground{}, background{};
    int confidence = 0;  ///< 0 to 8: weight of the estimate in the diffusion; each neighbor has weight 1
};

/// Returns the mixture of a foreground and a background sample that is closest to a color. Prefers nearly pure mixtures, because
/// in textured regions almost any color is a mixture of some pair. The preference was tuned on bench/quality.
///
/// known_alpha  share of the foreground if it is known, else nullptr
inline mixture unmix(const float_color& color, const float_color* foregrounds, const float_color* backgrounds, std::size_t count,
                     const float* known_alpha) {
    mixture best;
    float min_cost = std::numeric_limits<float>::infinity(), contrast = 1;
    for (std::size_t f = 0; f < count; ++f)
        for (std::size_t b = 0; b < count; ++b) {
            float_color across, from_background, error;
            for (std::size_t c = 0; c < 3; ++c)
                across[c] = foregrounds[f][c] - backgrounds[b][c], from_background[c] = color[c] - backgrounds[b][c];
            const float squared = across[0] * across[0] + across[1] * across[1] + across[2] * across[2];
            const float along = from_background[0] * across[0] + from_background[1] * across[1] + from_background[2] * across[2];
            const float alpha = known_alpha != nullptr ? *known_alpha : std::clamp(along / (squared + 1.0F), 0.0F, 1.0F);
            for (std::size_t c = 0; c < 3; ++c) error[c] = from_background[c] - alpha * across[c];
            const float squared_error = error[0] * error[0] + error[1] * error[1] + error[2] * error[2];
            const float cost = squared_error + 0.5F * squared * alpha * (1.0F - alpha);
            if (cost >= min_cost) continue;
            min_cost = cost, contrast = squared;
            best = {alpha, foregrounds[f], backgrounds[b], 0};
        }
    // Grain alone causes errors of a tenth of the contrast, so errors up to a tenth keep the full confidence. If the error is
    // half the contrast, no mixture explains the color, and the confidence is 0.
    const float error = std::sqrt(min_cost / (contrast + 1.0F));
    best.confidence = static_cast<int>(std::clamp(10.0F - 20.0F * error, 0.0F, 8.0F));
    return best;
}

/// Mixtures of all pixels of a band, in the order of places(). If the two surfaces at a pixel's nearest silhouette side are not
/// distinguishable, its confidence is 0. Its alpha is then the known share. If the share is unknown, alpha is 1 in front and 0
/// behind.
class local_matte {
public:
    /// shares  H x W, known shares of the foreground, in the units of decided_depth::shares; may be empty
    template <executor Executor = const serial_executor>
    local_matte(const graph_view& g, const silhouette_band& band, array_view<const std::uint8_t> colors,
                std::span<const std::uint8_t> shares = {}, Executor&& threads = {})
        : graph_(g), band_(band), shares_(shares), mixtures_(band.places().size()) {
        parallel_for(threads, mixtures_.size(), 512, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) mixtures_[i] = estimate(band.places()[i], colors);
        });
    }

    const buffer<mixture>& mixtures() const { return mixtures_; }

    /// Smooths the estimated shares by multigrid diffusion, with `rounds` Gauss-Seidel sweeps on each level.
    void smooth(int rounds) {
        diffusion<1> solver;
        solver.start();
        buffer<std::int32_t> cells(mixtures_.size(), 0), order;
        for (const silhouette_band::place& p : band_.places()) order.push_back(p.pixel);
        std::sort(order.begin(), order.end());
        for (const std::int32_t pixel : order) {
            const std::int32_t i = band_.find(pixel);
            if (!is_estimated(i)) continue;
            const std::int32_t cell = cells[i] = solver.add_cell(graph_.x()[pixel], graph_.y()[pixel]);
            for (int n = 0; n < mixtures_[i].confidence; ++n) solver.add_known_neighbor(cell, &mixtures_[i].alpha);
            add_neighbors(solver, cells, i);
        }
        solver.solve(rounds);
        for (std::int32_t i = 0; i < mixtures_.count(); ++i)
            if (cells[i] > 0) mixtures_[i].alpha = std::clamp(solver.value(cells[i])[0], 0.0F, 1.0F);
    }

private:
    /// Distance in pixels to four other pixels, along the row and the column. A pixel uses the color samples at its own nearest
    /// silhouette side, and at the nearest sides of these four.
    static constexpr std::int32_t sample_distance = 4;
    static constexpr std::size_t max_samples = 5;

    bool can_tell(std::int32_t place) const { return band_.sides()[band_.places()[place].side].can_tell; }

    /// Whether a pixel's share is known and agrees with the surface that the pixel belongs to: stages that ran after the share
    /// was determined may have moved a silhouette.
    bool has_share(const silhouette_band::place& p) const {
        const std::uint8_t share = shares_.empty() ? std::uint8_t{0} : shares_[static_cast<std::size_t>(p.pixel)];
        return share != 0 && (share >= 128) == p.in_front;
    }
    bool is_estimated(std::int32_t place) const { return can_tell(place) && !has_share(band_.places()[place]); }

    mixture estimate(const silhouette_band::place& p, array_view<const std::uint8_t> colors) const {
        const bool is_known = has_share(p);
        const float pure = p.in_front ? 1.0F : 0.0F;
        const float share = is_known ? nearest_float(shares_[static_cast<std::size_t>(p.pixel)] - 1) / 254.0F : pure;
        if (!band_.sides()[p.side].can_tell) return {share, {}, {}, 0};
        float_color foregrounds[max_samples], backgrounds[max_samples], color;
        std::int32_t taken[max_samples];
        std::size_t count = 0;
        const auto take = [&](std::int32_t number) {
            const silhouette_side& s = band_.sides()[number];
            if (!s.can_tell || std::find(taken, taken + count, number) != taken + count) return;
            foregrounds[count] = s.foreground, backgrounds[count] = s.background, taken[count] = number;
            ++count;
        };
        take(p.side);
        const std::int32_t x = graph_.x()[p.pixel], y = graph_.y()[p.pixel];
        for (const side s : all_sides) {
            const std::int32_t u = x + sample_distance * step_x(s), v = y + sample_distance * step_y(s);
            if (u < 0 || v < 0 || u >= graph_.width() || v >= graph_.height()) continue;
            const std::int32_t other = band_.find(v * graph_.width() + u);
            if (other >= 0) take(band_.places()[other].side);
        }
        for (std::size_t c = 0; c < 3; ++c) color[c] = static_cast<float>(colors[3 * static_cast<std::size_t>(p.pixel) + c]);
        return unmix(color, foregrounds, backgrounds, count, is_known ? &share : nullptr);
    }

    /// Connects a pixel to its neighbors in the picture, even across the silhouette, because shares are smooth there. Outside
    /// the band, colors are pure.
    void add_neighbors(diffusion<1>& solver, const buffer<std::int32_t>& cells, std::int32_t place) const {
        const silhouette_band::place& p = band_.places()[place];
        const float pure = p.in_front ? 1.0F : 0.0F;
        const std::int32_t cell = cells[place], x = graph_.x()[p.pixel], y = graph_.y()[p.pixel];
        for (const side s : all_sides) {
            const std::int32_t u = x + step_x(s), v = y + step_y(s);
            if (u < 0 || v < 0 || u >= graph_.width() || v >= graph_.height()) continue;
            const std::int32_t other = band_.find(v * graph_.width() + u);
            if (other < 0)
                solver.add_known_neighbor(cell, &pure);
            else if (has_share(band_.places()[other]))
                solver.add_known_neighbor(cell, &mixtures_[other].alpha);
            else if (!can_tell(other))
                continue;
            else if (s == side::left)
                solver.link_left(cell, cells[other]);
            else if (s == side::up)
                solver.link_up(cell, cells[other]);
        }
    }

    graph_view graph_;
    const silhouette_band& band_;
    std::span<const std::uint8_t> shares_;
    buffer<mixture> mixtures_;
};

}}}  // namespace ldi::detail
