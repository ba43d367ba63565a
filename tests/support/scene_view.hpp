// Camera of the pictures that tests make.
#pragma once

#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/render/camera.hpp>

namespace ldi::testing {

inline const depth_range scene_range{1, 5};

inline view own_view(const graph_view& g) {
    view v;
    v.camera = {g.width(), g.height(), focal_length_from_field_of_view(60, g.width(), g.height())};
    return v;
}

}  // namespace ldi::testing
