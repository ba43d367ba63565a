// One of two translation units that include the same headers; see CMakeLists.txt.
#include LDI_HEADER

#include "layout.hpp"

#include <type_traits>
#include <utility>

namespace {

template <class T>
type_layout layout_of(const char* name) {
    return {name, sizeof(T), alignof(T), std::is_standard_layout_v<T>};
}

}  // namespace

std::vector<type_layout> LDI_UNIT() {
    ldi::graph_builder builder(ldi::make_grid(5, 4));
    builder.unlink(0, ldi::side::right);
    const ldi::graph grid = std::move(builder).build();
    if (ldi::validate(grid).has_value()) return {};
    return {
        layout_of<ldi::graph>("graph"),
        layout_of<ldi::image<float>>("image<float>"),
        layout_of<ldi::photo_layers>("photo_layers"),
        layout_of<ldi::pinhole_camera>("pinhole_camera"),
        layout_of<ldi::depth_range>("depth_range"),
        layout_of<ldi::error_details>("error_details"),
        layout_of<ldi::thread_pool>("thread_pool"),
        layout_of<ldi::chart_set>("chart_set"),
        layout_of<ldi::textured_mesh>("textured_mesh"),
    };
}
