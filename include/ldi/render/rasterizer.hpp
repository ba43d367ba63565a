// A software rasterizer: draws a 3D photo from another viewpoint (paper, section "Viewing 3D Photos"), and reports its holes.
// The rasterizer is exact rather than fast. Its result is the same on every machine and for any number of threads, so that
// tests can count pixels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/detail/screen_triangles.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of rasterize().
struct raster_options {
    std::int32_t samples = 1;                         ///< per pixel and axis, 1 to 8; more than 1 smooths edges
    float z_near = 0.01F;                             ///< at least 2^-126; surfaces nearer than this depth are clipped
    bool both_sides = true;                           ///< false: triangles that are clockwise on the screen are not drawn
    std::array<std::uint8_t, 3> background{0, 0, 0};  ///< color of holes
    image_view<const std::uint8_t> backdrop{};        ///< H x W x 3: replaces `background` in holes (gap_colors())
};

/// A drawn mesh; the result of rasterize().
struct rendering {
    image<std::uint8_t> color;     ///< H x W x 3: mean over the pixel's samples
    image<float> depth;            ///< H x W x 1: depth of the nearest sample along the view's axis; infinity in holes
    image<std::uint8_t> coverage;  ///< H x W x 1: 0 in holes, 255 if every sample of the pixel is covered
};

/// Draws a mesh with its textures, with bilinear, perspective-correct texture mapping. Where surfaces coincide, the first
/// triangle wins. Soft edges are blended over the surfaces behind them; they affect neither depth nor coverage.
///
/// textures  one for each part of the mesh, H x W x 3; the first row is at texture coordinate v = 0. Coordinates outside [0, 1]
///           are clamped to the edge
///
/// Raises mismatch or invalid_data if the mesh or a texture is malformed; mismatch for a backdrop whose size differs from the
/// view's or that does not have 3 channels; invalid_option for invalid options or an invalid view; and too_large if the view's
/// longer side times samples exceeds 2^19.
template <executor Executor = const serial_executor>
rendering rasterize(const textured_mesh& mesh, std::span<const image<std::uint8_t>> textures, const view& from,
                    const raster_options& options = {}, Executor&& threads = {});

/// Draws a mesh with one texture, H x W x 3.
template <executor Executor = const serial_executor>
rendering rasterize(const textured_mesh& mesh, const image<std::uint8_t>& texture, const view& from,
                    const raster_options& options = {}, Executor&& threads = {}) {
    return rasterize(mesh, std::span(&texture, 1), from, options, threads);
}

namespace detail {

inline void check_drawable(const textured_mesh& mesh, std::span<const image<std::uint8_t>> textures) {
    check_mesh(mesh, textures.size());
    for (const image<std::uint8_t>& texture : textures) {
        if (texture.channels() == 3 && texture.size() > 0) continue;
        raise(error_code::mismatch, "texture", "3 channels and at least one pixel", shape_text(texture));
    }
}

inline void check_raster_options(const view& from, const raster_options& options) {
    if (options.samples < 1 || options.samples > 8)
        raise(error_code::invalid_option, "samples", "1 to 8", std::to_string(options.samples));
    constexpr float smallest = (std::numeric_limits<float>::min)();  // smaller depths have no finite inverse
    if (!(options.z_near >= smallest) || !std::isfinite(options.z_near))
        raise(error_code::invalid_option, "z_near", "a finite depth of at least " + to_text(smallest), to_text(options.z_near));
    const pinhole_camera& camera = from.camera;
    if (camera.width < 1 || camera.height < 1 || !(camera.focal_length > 0) || !std::isfinite(camera.focal_length))
        raise(error_code::invalid_option, "view", "a width, a height and a finite focal length above 0",
              std::to_string(camera.width) + " x " + std::to_string(camera.height) + ", " + to_text(camera.focal_length));
    const std::int32_t limit = 524288 / options.samples;
    if (camera.width > limit || camera.height > limit)
        raise(error_code::too_large, "view", "sides of at most " + std::to_string(limit) + " pixels",
              std::to_string(camera.width) + " x " + std::to_string(camera.height));
    const auto all_finite = [](const auto& numbers) {
        return std::all_of(numbers.begin(), numbers.end(), [](float value) { return std::isfinite(value); });
    };
    if (!all_finite(from.position) || !all_finite(from.rotation))
        raise(error_code::invalid_option, "view", "a finite position and rotation", "infinity or NaN");
    for (const float shift : from.lens_shift)
        if (!(std::abs(shift) * static_cast<float>(options.samples) <= guard_band))
            raise(error_code::invalid_option, "view", "a lens shift of at most 2^20 samples", to_text(shift));
    const image_view<const std::uint8_t>& backdrop = options.backdrop;
    if (!backdrop.empty() && (backdrop.width() != static_cast<std::size_t>(camera.width) ||
                              backdrop.height() != static_cast<std::size_t>(camera.height) || backdrop.channels() != 3))
        raise(error_code::mismatch, "backdrop", std::to_string(camera.height) + " x " + std::to_string(camera.width) + " x 3",
              shape_text(backdrop));
}

/// Samples a texture.
///
/// u, v  texture coordinates
inline std::array<std::uint8_t, 3> bilinear(const image<std::uint8_t>& texture, double u, double v) {
    const double last_x = nearest_double(texture.width() - 1), last_y = nearest_double(texture.height() - 1);
    const double x = std::clamp(u * (last_x + 1) - 0.5, 0.0, last_x), y = std::clamp(v * (last_y + 1) - 0.5, 0.0, last_y);
    const std::size_t x0 = static_cast<std::size_t>(x), y0 = static_cast<std::size_t>(y);
    const std::size_t x1 = (std::min)(x0 + 1, texture.width() - 1), y1 = (std::min)(y0 + 1, texture.height() - 1);
    const float tx = static_cast<float>(x - nearest_double(x0)), ty = static_cast<float>(y - nearest_double(y0));
    const std::uint8_t *const upper = texture.row(y0), *const lower = texture.row(y1);
    std::array<std::uint8_t, 3> result{};
    for (std::size_t c = 0; c < 3; ++c) {
        const float above = upper[3 * x0 + c] * (1 - tx) + upper[3 * x1 + c] * tx;
        const float below = lower[3 * x0 + c] * (1 - tx) + lower[3 * x1 + c] * tx;
        result[c] = rounded_mean(above * (1 - ty) + below * ty);
    }
    return result;
}

/// Samples of a band, which is a range of pixel rows.
struct sample_band {
    std::int64_t first_row = 0, last_row = 0, width = 0;  ///< in samples
    buffer<float> inverse_depth;                          ///< 0 in holes
    buffer<std::array<std::uint8_t, 3>> color;

    sample_band(std::pair<std::int64_t, std::int64_t> rows, std::int64_t samples_across, const raster_options& options)
        : first_row(rows.first), last_row(rows.second), width(samples_across) {
        inverse_depth.assign(static_cast<std::size_t>((last_row - first_row) * width), 0.0F);
        color.assign(inverse_depth.size(), options.background);
        if (options.backdrop.empty()) return;
        std::int64_t i = 0;
        for (std::int64_t y = first_row; y < last_row; ++y)
            for (std::int64_t x = 0; x < width; ++x, ++i)
                std::copy_n(&options.backdrop(y / options.samples, x / options.samples), 3, color[i].begin());
    }

    /// Draws a triangle. shade(u, v) returns the color at the texture coordinates (u, v).
    template <class Shade>
    void draw(const screen_triangle& t, Shade&& shade) {
        const screen_values values(t);
        for_each_span(t, width, first_row, last_row, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
            std::int64_t i = (y - first_row) * width + first;
            for (std::int64_t x = first; x < last; ++x, ++i) {
                const float here = static_cast<float>(values.inverse_depth(x, y));
                if (here <= inverse_depth[i]) continue;
                inverse_depth[i] = here;
                color[i] = shade(values.u(x, y), values.v(x, y));
            }
        });
    }

    /// Blends a translucent triangle over the surfaces behind it.
    template <class Shade>
    void blend(const screen_triangle& t, Shade&& shade) {
        const translucent_values values(t);
        for_each_span(t, width, first_row, last_row, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
            std::int64_t i = (y - first_row) * width + first;
            for (std::int64_t x = first; x < last; ++x, ++i) {
                if (static_cast<float>(values.inverse_depth(x, y)) <= inverse_depth[i]) continue;
                const float opacity = values.opacity(x, y);
                const std::array<std::uint8_t, 3> over = shade(values.u(x, y), values.v(x, y));
                for (std::size_t c = 0; c < 3; ++c)
                    color[i][c] = rounded_mean(opacity * nearest_float(over[c]) + (1 - opacity) * nearest_float(color[i][c]));
            }
        });
    }

    /// Averages the samples of each pixel.
    ///
    /// n  samples per pixel and axis
    void resolve(std::int64_t n, rendering& result) const {
        const std::int64_t first = first_row / n, last = last_row / n, across = width / n;
        const std::uint32_t samples = static_cast<std::uint32_t>(n * n);
        const auto mean = [samples](std::uint32_t sum) {
            return static_cast<std::uint8_t>(samples == 1 ? sum : (sum + samples / 2) / samples);  // a division takes longer
        };
        for (std::int64_t y = first; y < last; ++y)
            for (std::int64_t x = 0; x < across; ++x) {
                std::array<std::uint32_t, 3> sum{};
                std::uint32_t covered = 0;
                float nearest = 0;
                for (std::int64_t j = 0; j < n; ++j)
                    for (std::int64_t i = 0; i < n; ++i) {
                        const std::int64_t sample = (y * n - first_row + j) * width + x * n + i;
                        for (std::size_t c = 0; c < 3; ++c) sum[c] += color[sample][c];
                        covered += inverse_depth[sample] > 0 ? 1U : 0U;
                        nearest = (std::max)(nearest, inverse_depth[sample]);
                    }
                for (std::size_t c = 0; c < 3; ++c) result.color(y, x, c) = mean(sum[c]);
                result.depth(y, x) = covered > 0 ? 1 / nearest : std::numeric_limits<float>::infinity();
                result.coverage(y, x) = static_cast<std::uint8_t>(covered == samples ? 255U : 255 * covered / samples);
            }
    }
};

/// Highest and lowest position of an object on the screen, in 1 / subsample_steps of a sample; empty if top > bottom.
struct vertical_extent {
    std::int64_t top = 0, bottom = -1;
};

/// Rows of pixels per band. Thinner bands keep more threads busy; with thicker bands, fewer triangles lie in more than one band.
/// Tuned by experiment.
inline constexpr std::int64_t rows_per_band = 16;

/// Lists the objects that may touch each band, in order: those of band b are list[start[b]] to list[start[b + 1] - 1].
struct band_lists {
    buffer<std::size_t> start;
    buffer<std::int32_t> list;

    /// extent(i)  vertical_extent of object i of `count`
    template <class Extent>
    band_lists(std::int32_t count, Extent&& extent, std::int64_t rows, std::int64_t band_rows)
        : rows_(rows), band_rows_(band_rows) {
        start.assign(static_cast<std::size_t>((rows + band_rows - 1) / band_rows) + 1, 0);
        const auto for_each_band = [&](std::int32_t i, auto&& visit) {
            const std::int64_t size = band_rows * subsample_steps, last_band = start.count() - 2;
            const vertical_extent e = extent(i);
            if (e.top > e.bottom) return;
            const std::int64_t first = std::max<std::int64_t>(floor_division(e.top, size), 0);
            const std::int64_t last = (std::min)(floor_division(e.bottom, size), last_band);
            for (std::int64_t b = first; b <= last; ++b) visit(b);
        };
        for (std::int32_t i = 0; i < count; ++i) for_each_band(i, [&](std::int64_t b) { ++start[b + 1]; });
        for (std::size_t b = 0; b < band_count(); ++b) start[b + 1] += start[b];
        list.resize(start.back());
        buffer<std::size_t> next = start;
        for (std::int32_t i = 0; i < count; ++i) for_each_band(i, [&](std::int64_t b) { list[next[b]++] = i; });
    }

    std::size_t band_count() const { return start.size() - 1; }
    /// Returns the rows [first, second) of a band.
    std::pair<std::int64_t, std::int64_t> rows_of(std::size_t band) const {
        const std::int64_t first = static_cast<std::int64_t>(band) * band_rows_;
        return {first, (std::min)(first + band_rows_, rows_)};
    }

private:
    std::int64_t rows_, band_rows_;
};

/// Renders `count` objects. The bands do not depend on the number of threads, and each band is drawn by a single thread, in the
/// order of the objects. The result is therefore the same for any number of threads.
///
/// extent(i)      vertical_extent of object i
/// draw(i, band)  draws object i into a band
template <executor Executor, class Extent, class Draw>
rendering draw_in_bands(const pinhole_camera& camera, const raster_options& options, std::int32_t count, Extent&& extent,
                        Draw&& draw, Executor& threads) {
    const std::size_t h = static_cast<std::size_t>(camera.height), w = static_cast<std::size_t>(camera.width);
    rendering result{image<std::uint8_t>(h, w, 3, unset), image<float>(h, w, 1, unset), image<std::uint8_t>(h, w, 1, unset)};
    const std::int64_t samples = options.samples;
    const band_lists lists(count, extent, camera.height * samples, rows_per_band * samples);
    parallel_for(threads, lists.band_count(), 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b) {
            sample_band band(lists.rows_of(b), camera.width * samples, options);
            for (std::size_t i = lists.start[b]; i < lists.start[b + 1]; ++i) draw(lists.list[i], band);
            band.resolve(options.samples, result);
        }
    });
    return result;
}

}  // namespace detail

template <executor Executor>
rendering rasterize(const textured_mesh& mesh, std::span<const image<std::uint8_t>> textures, const view& from,
                    const raster_options& options, Executor&& threads) {
    detail::check_drawable(mesh, textures);
    detail::check_raster_options(from, options);
    buffer<detail::screen_triangle> triangles;
    triangles.reserve(mesh.triangle_count());
    const detail::projection projection(from, options.samples, options.z_near);
    buffer<std::int32_t> last_of_part;  // end of each part in `triangles`; clipping can add triangles
    for (std::size_t t = 0; t < mesh.part_count(); ++t) {
        for (std::size_t i = mesh.part(t).first_triangle; i < mesh.part(t + 1).first_triangle; ++i)
            projection.append(mesh, i, options.both_sides, triangles);
        last_of_part.push_back(triangles.count());
    }
    const std::int32_t opaque = triangles.count();
    const soft_edge_strip& strip = mesh.soft_edges;
    for (std::size_t i = 0; i < strip.triangles.size() / 3; ++i) projection.append(strip, i, options.both_sides, triangles);

    return detail::draw_in_bands(
        from.camera, options, triangles.count(),
        [&](std::int32_t i) {
            const detail::screen_triangle& t = triangles[i];
            return detail::vertical_extent{(std::min)({t[0].y, t[1].y, t[2].y}), (std::max)({t[0].y, t[1].y, t[2].y})};
        },
        [&](std::int32_t i, detail::sample_band& band) {
            const std::size_t part =
                i < opaque ? static_cast<std::size_t>(std::upper_bound(last_of_part.begin(), last_of_part.end(), i) -
                                                      last_of_part.begin())
                           : 0;
            const auto shade = [&](double u, double v) { return detail::bilinear(textures[part], u, v); };
            if (i < opaque)
                band.draw(triangles[i], shade);
            else
                band.blend(triangles[i], shade);
        },
        threads);
}

}}  // namespace ldi
