// Decides silhouettes with a network: beside sharp steps, it assigns each pixel to the front or the back surface. The pixel
// then gets the depth of nearby pixels that belong to this surface and have no blurred depth.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/depth/detail/band_input.hpp>
#include <ldi/depth/detail/check_map.hpp>
#include <ldi/depth/detail/side_surfaces.hpp>
#include <ldi/depth/step_band.hpp>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A silhouette_decider (photo3d/suppliers.hpp). `Network` has a function logits() like silhouette_network
/// (networks/silhouettes.hpp). The network must outlive the decider.
///
///     const ldi::silhouette_network network = ldi::load_silhouettes("silhouettes.safetensors");
///     ldi::photo3d_options options;
///     options.level = ldi::level_options();
///     make_photo3d(photo, depth, ldi::network_decider(&network), inpainter, options);
template <class Network>
class network_decider {
public:
    /// network    the network, or nullptr to use aligned_silhouettes instead
    /// alignment  options of aligned_silhouettes
    explicit network_decider(const Network* network, const alignment_options& alignment = {})
        : network_(network), by_hand_{alignment} {}

    /// Decides the silhouettes of a depth map. In the result, disparities beside sharp steps (in the band of
    /// depth/step_band.hpp) lie on one of the two surfaces, not between them. If depth samples are no larger than pixels,
    /// aligned_silhouettes decides instead, because such depth locates silhouettes better than the network does. Time and
    /// memory are linear in the number of pixels, regardless of their disparities. Raises mismatch if the images do not have
    /// the shapes that undecided_depth documents, invalid_data if the estimate is not finite, invalid_option for a sample_size
    /// outside [1, 16], and the errors of find_step_band().
    template <executor Executor>
    decided_depth decide(undecided_depth depth, Executor&& threads) const {
        if (network_ == nullptr || depth.sample_size <= 1.0F) return by_hand_.decide(std::move(depth), threads);
        detail::check_map_and_photo(depth.disparity, depth.photo, "network_decider");
        detail::check_sample_size(depth.sample_size);
        if (depth.estimated.empty() || depth.estimated.channels() != 1)
            raise(error_code::mismatch, "network_decider", "an estimate h x w x 1 with at least one pixel",
                  detail::shape_text(depth.estimated));
        detail::check_finite(depth.estimated, "network_decider");
        const step_band band = find_step_band(depth.disparity, {.min_step = min_step});
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
    /// Minimum difference between front and back. Smaller steps of estimated depth are often inside an object, such as a face.
    static constexpr float min_step = 0.1F;
    /// Minimum size of an island, in pixels, for depth samples that are one pixel wide. It grows in proportion to the width of a
    /// depth sample. An island is a group of connected pixels on one side of a step, inside the band. Smaller islands change to
    /// the other side.
    static constexpr double min_island_samples = 120;
    /// Weight of the prior, which is added to the logit. The prior is the position of the pixel's disparity between back (0) and
    /// front (1), minus one half.
    static constexpr float prior = 6.0F;

    /// Adds the prior to a logit, and converts the sum to a share in the units of decided_depth::shares. The exponential function
    /// differs between C libraries. A table of the logits between adjacent shares replaces it, so that results are the same
    /// everywhere.
    static std::uint8_t share_of(float logit, std::uint8_t prior_byte) {
        static const share_table table;
        const float lean = std::clamp((detail::nearest_float(prior_byte) - 128.0F) / 127.0F, -0.5F, 0.5F);
        return table(logit + prior * lean);
    }

    struct share_table {
        /// limits[n] is the logit of the share (n + 0.5) / 254, the boundary between shares n / 254 and (n + 1) / 254.
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
