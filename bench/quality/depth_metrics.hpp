// Agreement of a disparity map with measured depth, up to scale and shift of disparity. All measures except silhouettes are
// those of examples/training/tiefenrausch_small/metrics.py.
#pragma once

#include "metrics.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/core/image.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/photo3d.hpp>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <type_traits>
#include <utility>

namespace ldi_quality {

using pixel_set = mask;  // 1 for pixels in the set

/// Quality of a network on one pair, or the mean over many. A measure is `unmeasured` if the truth is too sparse for it, or has
/// no edges.
struct depth_quality {
    double delta = unmeasured;        ///< share of pixels within a factor of 1.25 of the truth
    double abs_rel = unmeasured;      ///< mean error of distance, as a share of the distance
    double rmse = unmeasured;         ///< root mean square error of distance, in units of the median distance
    double edges = unmeasured;        ///< F1 of edges, with a tolerance of 4 pixels
    double boundaries = unmeasured;   ///< F1 of steps between neighboring pixels, without tolerance
    double silhouettes = unmeasured;  ///< share of true silhouette pixels with an estimated one within 3 pixels
    double order = unmeasured;        ///< share of pairs of pixels in the wrong order of distance
};

/// Resizes an image without interpolation, by copying the nearest pixels.
template <class Scalar>
ldi::image<Scalar> sampled(const ldi::image<Scalar>& from, std::size_t rows, std::size_t columns) {
    ldi::image<Scalar> result(rows, columns);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) result(y, x, 0) = from(y * from.height() / rows, x * from.width() / columns, 0);
    return result;
}

/// Resizes an image to the network's long side by copying the nearest pixels.
template <class Scalar>
ldi::image<Scalar> at_network_size(const ldi::image<Scalar>& from) {
    const double scale =
        static_cast<double>(ldi::tiefenrausch::long_side) / static_cast<double>(std::max(from.height(), from.width()));
    const auto scaled = [&](std::size_t length) {
        return static_cast<std::size_t>(std::nearbyint(static_cast<double>(length) * scale));
    };
    return sampled(from, scaled(from.height()), scaled(from.width()));
}

/// Fits scale * estimate + shift by least squares over known pixels; only the shift if the estimate is constant.
inline map aligned(const map& estimate, const map& truth, const pixel_set& known) {
    const auto column = [](const auto& image) {
        using scalar = std::remove_cvref_t<decltype(*image.data())>;
        return Eigen::Map<const Eigen::Array<scalar, Eigen::Dynamic, 1>>(image.data(), static_cast<Eigen::Index>(image.size()));
    };
    // An unknown pixel has weight 0 in the equations of the two unknowns.
    const Eigen::ArrayXd weight = (column(known) != 0).cast<double>();
    const double n = weight.sum(), middle = (weight * column(estimate)).sum() / n;
    Eigen::MatrixX2d equations(column(estimate).size(), 2);
    equations << weight * (column(estimate) - middle), weight;
    const Eigen::Vector2d fit = (equations.transpose() * equations)
                                    .completeOrthogonalDecomposition()
                                    .solve(equations.transpose() * (weight * column(truth)).matrix());
    map result = estimate;
    for (double& value : result) value = fit[1] + fit[0] * (value - middle);
    return result;
}

/// Extends a set by `reach` pixels in both x and y.
inline pixel_set widened(const pixel_set& from, std::size_t reach) {
    const std::size_t rows = from.height(), columns = from.width();
    pixel_set result = ldi::image<std::uint8_t>(rows, columns, 1, std::uint8_t{0});
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            if (from(y, x, 0) == 0) continue;
            for (std::size_t v = y - std::min(y, reach); v <= std::min(y + reach, rows - 1); ++v)
                for (std::size_t u = x - std::min(x, reach); u <= std::min(x + reach, columns - 1); ++u) result(v, u, 0) = 1;
        }
    return result;
}

inline double count(const pixel_set& a) { return static_cast<double>(std::count(a.begin(), a.end(), std::uint8_t{1})); }

inline double count_both(const pixel_set& a, const pixel_set& b) {
    double result = 0;
    for (std::size_t i = 0; i < a.size(); ++i) result += a.data()[i] != 0 && b.data()[i] != 0 ? 1 : 0;
    return result;
}

/// Finds edges: pairs of known pixels, 4 pixels apart to the right or down, whose disparities differ by a factor above 1.15.
/// Marks the pixel in the middle of each pair.
inline pixel_set edges_of(const map& disparity, const pixel_set& known) {
    constexpr std::size_t reach = 4;
    const std::size_t rows = known.height(), columns = known.width();
    pixel_set found = ldi::image<std::uint8_t>(rows, columns, 1, std::uint8_t{0});
    for (const auto& [down, right] : {std::pair<std::size_t, std::size_t>{0, reach}, {reach, 0}})
        for (std::size_t y = 0; y + down < rows; ++y)
            for (std::size_t x = 0; x + right < columns; ++x) {
                if (known(y, x, 0) == 0 || known(y + down, x + right, 0) == 0) continue;
                const double step = std::log(disparity(y + down, x + right, 0)) - std::log(disparity(y, x, 0));
                if (std::abs(step) > std::log(1.15)) found(y + down / 2, x + right / 2, 0) = 1;
            }
    return found;
}

inline double edge_agreement(const map& ours, const map& truth, const pixel_set& known) {
    const pixel_set a = edges_of(ours, known), b = edges_of(truth, known);
    if (count(b) < 100) return unmeasured;
    const double precision = count(a) > 0 ? count_both(a, widened(b, 4)) / count(a) : 0;
    const double recall = count_both(b, widened(a, 4)) / count(b);
    return 2 * precision * recall / std::max(precision + recall, 1e-9);
}

/// F1 of steps. A step is a side of a pixel beyond which the neighbor is farther by more than a ratio. Returns the mean over
/// ratios from 1.05 to 1.25, each weighted by itself (Bochkovskii et al., "Depth Pro", 2024, scale-invariant boundary F1).
inline double boundary_agreement(const map& ours, const map& truth, const pixel_set& known) {
    constexpr int ratios = 10;
    const std::size_t rows = known.height(), columns = known.width();
    struct counts {
        double ours = 0, true_ones = 0, both = 0;
    };
    double sum = 0, weights = 0;
    for (int i = 0; i < ratios; ++i) {
        const double ratio = 1.05 + 0.2 * i / (ratios - 1);
        double precision = 0, recall = 0;
        for (const std::size_t down : {0U, 1U})
            for (const bool forwards : {true, false}) {
                const std::size_t right = 1 - down;
                counts c;
                for (std::size_t y = 0; y + down < rows; ++y)
                    for (std::size_t x = 0; x + right < columns; ++x) {
                        if (known(y, x, 0) == 0 || known(y + down, x + right, 0) == 0) continue;
                        const auto is_step = [&](const map& m) {
                            const double here = m(y, x, 0), there = m(y + down, x + right, 0);
                            return forwards ? here > ratio * there : there > ratio * here;
                        };
                        const bool a = is_step(ours), b = is_step(truth);
                        c.ours += a ? 1 : 0, c.true_ones += b ? 1 : 0, c.both += a && b ? 1 : 0;
                    }
                precision += c.both / std::max(c.ours, 1.0) / 4, recall += c.both / std::max(c.true_ones, 1.0) / 4;
            }
        if (precision + recall > 0) sum += ratio * 2 * precision * recall / (precision + recall);
        weights += ratio;
    }
    return sum / weights;
}

/// Returns the share of pixel pairs that the estimate has in the wrong order, among 20,000 random pairs whose true distances
/// differ by at least a fifth. DA-2K (Yang et al., "Depth Anything V2", 2024) is a similar measure for pixel pairs that people
/// annotated, without measured depth.
inline double wrong_order(const map& ours, const map& truth, const pixel_set& known) {
    ldi::buffer<std::size_t> pixels;
    for (std::size_t i = 0; i < known.size(); ++i)
        if (known.data()[i] != 0) pixels.push_back(i);
    std::minstd_rand random(1);
    double pairs = 0, wrong = 0;
    for (int i = 0; i < 20000; ++i) {
        const std::size_t a = pixels[random() % pixels.size()], b = pixels[random() % pixels.size()];
        const double ratio = truth.data()[a] / truth.data()[b];
        if (ratio < 1.2 && ratio > 1 / 1.2) continue;
        pairs += 1;
        wrong += (ratio > 1) == (ours.data()[a] > ours.data()[b]) ? 0 : 1;
    }
    return pairs < 100 ? unmeasured : wrong / pairs;
}

/// Makes a 3D photo from this map at the network's long side, and marks the near pixels of its discontinuities.
///
/// photo      H x W x 3
/// disparity  h x w x 1 of any size
/// step       depth_estimator's quantization_step()
template <ldi::executor Executor>
pixel_set silhouettes_of(const picture& photo, const ldi::image<float>& disparity, float step, Executor& threads) {
    ldi::photo3d_options options;
    options.long_side = ldi::tiefenrausch::long_side;
    options.normalize.is_inverse_depth = false;
    options.normalize.relative_step = step - 1;
    const ldi::photo3d made =
        ldi::make_photo3d(photo, ldi::given_disparity{disparity}, ldi::diffusion_inpainter{}, options, threads);
    pixel_set result = ldi::image<std::uint8_t>(made.disparity.height(), made.disparity.width(), 1, std::uint8_t{0});
    for (const ldi::discontinuity_curve& curve : made.curves)
        for (const ldi::discontinuity& d : curve.sides) result.data()[d.front] = 1;
    return result;
}

/// Share of the known true silhouette pixels that have an estimated silhouette pixel within 3 pixels; unmeasured if fewer than
/// 100 are known.
///
/// known_pixels  of any size
inline double silhouettes_met(const pixel_set& ours, const pixel_set& truth, const pixel_set& known_pixels) {
    pixel_set counted = sampled(known_pixels, truth.height(), truth.width());
    for (std::size_t i = 0; i < counted.size(); ++i) counted.data()[i] = counted.data()[i] != 0 && truth.data()[i] != 0 ? 1 : 0;
    return count(counted) < 100 ? unmeasured : count_both(counted, widened(ours, 3)) / count(counted);
}

/// Measures an estimate.
///
/// photo      H x W x 3
/// disparity  h x w x 1 of any size, above 0: the estimate
/// step       ratio of adjacent levels of disparity, depth_estimator's quantization_step()
/// truth      H x W x 1, disparity up to scale, NaN where unknown
template <ldi::executor Executor>
depth_quality measure_depth(const picture& photo, const ldi::image<float>& disparity, float step, const ldi::image<float>& truth,
                            Executor& threads) {
    const std::size_t rows = truth.height(), columns = truth.width();
    pixel_set known = ldi::image<std::uint8_t>(rows, columns);
    ldi::buffer<double> values;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        known.data()[i] = truth.data()[i] > 0 ? 1 : 0;
        if (known.data()[i] != 0) values.push_back(static_cast<double>(truth.data()[i]));
    }
    constexpr double farthest = 20;  // in units of the median distance; larger distances are clamped in both maps
    const double least = median(values) / farthest;
    map right = ldi::image<double>(rows, columns);
    for (std::size_t i = 0; i < truth.size(); ++i)
        right.data()[i] = known.data()[i] != 0 ? std::max(static_cast<double>(truth.data()[i]), least) : least;
    map ours = aligned(resized(disparity, rows, columns), right, known);
    for (double& value : ours) value = std::max(value, least);
    values.clear();
    for (std::size_t i = 0; i < truth.size(); ++i)
        if (known.data()[i] != 0) values.push_back(right.data()[i]);
    const double middle = median(values);

    depth_quality result;
    double within = 0, relative = 0, squared = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (known.data()[i] == 0) continue;
        const double x = ours.data()[i], y = right.data()[i];
        within += std::max(x / y, y / x) < 1.25 ? 1 : 0;
        relative += std::abs(y / x - 1);
        squared += (middle / x - middle / y) * (middle / x - middle / y);
    }
    const double n = static_cast<double>(values.size());
    result.delta = within / n, result.abs_rel = relative / n, result.rmse = std::sqrt(squared / n);

    const pixel_set known_here = at_network_size(known);
    const map ours_here = at_network_size(ours), right_here = at_network_size(right);
    result.edges = edge_agreement(ours_here, right_here, known_here);

    result.boundaries = boundary_agreement(ours_here, right_here, known_here);
    result.order = wrong_order(ours_here, right_here, known_here);

    if (n < 0.5 * static_cast<double>(truth.size())) return result;  // too sparse for silhouettes
    result.silhouettes = silhouettes_met(silhouettes_of(photo, disparity, step, threads),
                                         silhouettes_of(photo, ldi::fill_invalid(truth), 1, threads), known);
    return result;
}

}  // namespace ldi_quality
