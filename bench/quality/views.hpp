// The 3D photo of a subject with its true depth, and the part of its other view that can be compared.
#pragma once

#include "metrics.hpp"
#include "subjects.hpp"

#include <ldi/adapt/eigen.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/camera.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace ldi_quality {

/// Options for a 3D photo with true depth: the photo at full size, no clipped depth, and `iterations` iterations of growth.
inline ldi::photo3d_options true_depth_options(const subject& s, int iterations) {
    ldi::photo3d_options options;
    options.focal_length_35mm = s.camera.focal_length / ldi::focal_length_from_35mm(1, s.camera.width, s.camera.height);
    options.normalize.is_metric = true;
    options.normalize.clipped_share = 0;
    options.normalize.max_depth_ratio = 1e6F;
    options.expand.motion = 1;
    options.expand.iterations = iterations;
    options.texture.strength = options.grain.strength = 0;  // off, so that only the fills are compared; `textured` adds texture
    return options;
}

/// An inpainter that adds the library's texture to the result of another one.
template <class Inpainter>
struct textured {
    const Inpainter& answers;

    template <class Layers, class Executor>
    void inpaint(Layers& layers, const ldi::progress_listener& progress, Executor& threads) const {
        answers.inpaint(layers, progress, threads);
        ldi::add_texture(layers);
    }
};

/// Marks the pixels of the other view whose rays meet the photo at every depth of its range. They form the frame, in which the
/// views are compared.
inline mask frame_of(const subject& s) {
    const ldi::depth_range range = s.range();
    const Eigen::Isometry3f to_photo = ldi::pose(s.other);
    mask result = ldi::image<std::uint8_t>(s.photo.height(), s.photo.width());
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t x = 0; x < result.width(); ++x) {
            bool inside = true;
            // The ends of the range suffice: at depths between them, the ray meets the photo between the two positions.
            for (const float depth : {range.z_near, range.z_far}) {
                const std::array<float, 3> seen =
                    s.other.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, depth);
                const Eigen::Vector3f point = to_photo * Eigen::Map<const Eigen::Vector3f>(seen.data());
                const auto [u, v] = s.camera.project({point.x(), point.y(), point.z()});
                inside = inside && u >= 1 && u <= static_cast<float>(s.camera.width) - 1 && v >= 0 &&
                         v <= static_cast<float>(s.camera.height);
            }
            result(y, x, 0) = inside ? 1 : 0;
        }
    return result;
}

}  // namespace ldi_quality
