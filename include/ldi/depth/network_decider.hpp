// Silhouettes by a network: beside sharp steps each pixel goes to the front or to the back surface, as the network decides, and
// takes its depth from pixels of that surface that the step did not blur.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/depth/detail/band_input.hpp>
#include <ldi/depth/detail/side_surfaces.hpp>
#include <ldi/depth/step_band.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A silhouette_decider (photo3d.hpp). `Network` has logits() as silhouette_network (networks/silhouettes.hpp) has it, and must
/// outlive the decider.
///
///     const ldi::silhouette_network network = ldi::load_silhouettes("silhouettes.safetensors");
///     make_photo3d(photo, depth, ldi::network_decider(&network), inpainter);
template <class Network>
class network_decider {
public:
    /// network    nullptr for silhouettes aligned by hand, for programs in which a user chooses
    /// alignment  how, then
    explicit network_decider(const Network* network, const alignment_options& alignment = {})
        : network_(network), by_hand_{alignment} {}

    /// No value in the band lies between its two surfaces, apart from what they slope themselves. Time and memory are linear in
    /// the pixels, whatever the disparity.
    template <executor Executor>
    decided_depth decide(undecided_depth depth, Executor&& threads) const {
        if (network_ == nullptr) return by_hand_.decide(std::move(depth), threads);
        const step_band band = find_step_band(depth.disparity);
        decided_depth result;
        result.shares = image<std::uint8_t>(depth.disparity.height(), depth.disparity.width(), 1, std::uint8_t{0});
        if (band.region.count() > 0) {
            buffer<std::uint8_t> decided(band.region.size(), unset);
            for (std::int32_t i = 0; i < band.region.count(); ++i) decided[i] = band.is_decided(i) ? 1 : 0;
            buffer<std::uint8_t> input = detail::band_input(band, depth);
            const buffer<std::uint8_t> priors = detail::channel_of(input, 4);
            const buffer<float> logits = network_->logits(band.region, std::move(input), decided, threads);
            buffer<std::uint8_t> shares(band.region.size(), std::uint8_t{0});
            for (std::int32_t i = 0; i < band.region.count(); ++i)
                if (decided[i] != 0) shares[i] = share_of(logits[2 * std::int64_t{i}], priors[i]);
            const auto min_island =
                static_cast<std::int32_t>(detail::nearest_whole(min_island_samples * double{depth.sample_size}));
            detail::side_surfaces(band, shares, min_island).apply(depth.disparity, result.shares);
        }
        result.disparity = std::move(depth.disparity);
        return result;
    }

private:
    /// Pixels of an island, per pixel that a sample of the estimate is wide.
    static constexpr double min_island_samples = 24;
    /// The logit leans towards the side that the disparity is on already.
    static constexpr float prior = 6.0F;

    /// In the units of decided_depth::shares. Exponentials differ between C libraries: a table of the logits between two shares
    /// makes the bytes the same everywhere.
    static std::uint8_t share_of(float logit, std::uint8_t prior_byte) {
        static const share_table table;
        const float lean = std::clamp((detail::nearest_float(prior_byte) - 128.0F) / 127.0F, -0.5F, 0.5F);
        return table(logit + prior * lean);
    }

    struct share_table {
        /// limits[n]: the logit of the share (n + 0.5) / 254, so that n shares lie below it.
        float limits[254];

        share_table() {
            for (std::int32_t n = 0; n < 254; ++n) {
                const float share = (detail::nearest_float(n) + 0.5F) / 254.0F;
                limits[n] = detail::natural_logarithm(share) - detail::natural_logarithm(1.0F - share);
            }
        }
        std::uint8_t operator()(float logit) const {
            return static_cast<std::uint8_t>(1 + (std::upper_bound(limits, limits + 254, logit) - limits));
        }
    };

    const Network* network_;
    aligned_silhouettes by_hand_;
};

}}  // namespace ldi
