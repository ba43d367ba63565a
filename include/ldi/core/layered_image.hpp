// A layered depth image: a graph and payload columns of the same length. The payload is the user's choice: each column is named
// by a tag type that says what a pixel holds. One value of this type carries everything from lifting to texturing.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/surface.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

/// A column tag: the scalar, and how many of them a pixel holds. It may also say what a pixel that a stage adds gets:
///
///     static constexpr ldi::new_pixels at_new_pixels = ldi::new_pixels::zero;
///
/// Otherwise a new pixel gets a copy from the pixel of the photo whose surface it continues.
template <class T>
concept payload_column = requires {
    typename T::scalar;
    { T::channels } -> std::convertible_to<std::size_t>;
};

/// The value that pixels added by expand() get in a column.
enum class new_pixels {
    copy,  ///< that of the pixel of the photo that they grew from
    zero,
};

/// The rule that a column gives for new pixels, or the default.
template <payload_column Column>
constexpr new_pixels at_new_pixels() {
    if constexpr (requires { Column::at_new_pixels; })
        return Column::at_new_pixels;
    else
        return new_pixels::copy;
}

/// red, green, blue as the photo has them (sRGB), 0 to 255. Undefined where known_column is 0.
struct color_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 3;
    static constexpr new_pixels at_new_pixels = new_pixels::zero;  // until it is inpainted
};

/// Disparity in [0, 1], larger is nearer; 0 is the farthest and 1 the nearest surface of the photo.
struct disparity_column {
    using scalar = float;
    static constexpr std::size_t channels = 1;
};

/// 1 where the photo gives the color, 0 where it must be inpainted.
struct known_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
    static constexpr new_pixels at_new_pixels = new_pixels::zero;
};

/// A graph with K pixels and, for each column, K rows of `channels` scalars, row-major.
///
///     struct normal { using scalar = float; static constexpr std::size_t channels = 3; };
///     layered_image<disparity_column, normal> surfaces;
///     surfaces.column<normal>()[3 * i + 2]
template <payload_column... Columns>
class layered_image {
public:
    graph topology;
    surface_rule surface;   ///< which of its pixels are one surface
    pinhole_camera camera;  ///< that took the photo
    depth_range range;      ///< the distances that its disparities stand for
    /// How far the camera may go (render/motion.hpp) before it sees past where hidden surfaces end; 0 where there are none.
    float motion = 0.0F;

    /// Whether there is such a column.
    template <class Column>
    static constexpr bool has = (std::is_same_v<Column, Columns> || ...);

    layered_image() = default;
    /// Columns are set to zero.
    explicit layered_image(graph g) : topology(std::move(g)) { resize_columns(topology.size()); }

    std::size_t size() const { return topology.size(); }

    template <payload_column Column>
    buffer<typename Column::scalar>& column() {
        return std::get<storage<Column>>(columns_).values;
    }
    template <payload_column Column>
    const buffer<typename Column::scalar>& column() const {
        return std::get<storage<Column>>(columns_).values;
    }

    /// The scalars of one pixel.
    template <payload_column Column>
    std::span<typename Column::scalar, Column::channels> at(std::int32_t pixel) {
        return std::span<typename Column::scalar, Column::channels>(column<Column>().data() + first_scalar<Column>(pixel),
                                                                    Column::channels);
    }
    template <payload_column Column>
    std::span<const typename Column::scalar, Column::channels> at(std::int32_t pixel) const {
        return std::span<const typename Column::scalar, Column::channels>(column<Column>().data() + first_scalar<Column>(pixel),
                                                                          Column::channels);
    }

    /// Makes every column as long as the graph; new rows are zero.
    void resize_columns(std::size_t count) { (column<Columns>().resize(count * Columns::channels), ...); }

    /// Moves pixel `order[i]` to index i, in the graph and in every column.
    void reorder(std::span<const std::int32_t> order) {
        topology = reordered(topology, order);
        ((column<Columns>() = reordered(column<Columns>(), order, Columns::channels)), ...);
    }

    /// Cuts off the pixels whose place in `kept` is 0, with their links and rows; the others stay in their order.
    ///
    /// kept  K, one per pixel
    void keep(std::span<const std::uint8_t> kept) {
        LDI_ASSERT(kept.size() == size());
        buffer<std::int32_t> order;
        std::size_t count = 0;
        for (const bool stays : {true, false}) {
            for (std::int32_t i = 0; i < topology.count(); ++i)
                if ((kept.data()[i] != 0) == stays) order.push_back(i);
            if (stays) count = order.size();
        }
        for (std::size_t n = count; n < order.size(); ++n)
            for (const side s : all_sides) topology.unlink(order[n], s);
        reorder(order);
        topology.resize(count);
        resize_columns(count);
    }

    /// Takes all that another image has, whose columns are some of this one's. The others stay empty.
    template <payload_column... Others>
    void take(layered_image<Others...>&& other) {
        topology = std::move(other.topology);
        surface = other.surface, camera = other.camera, range = other.range, motion = other.motion;
        ((column<Others>() = std::move(other.template column<Others>())), ...);
    }

private:
    template <class Column>
    static std::size_t first_scalar(std::int32_t pixel) {
        return static_cast<std::size_t>(pixel) * Column::channels;
    }

    template <class Column>
    struct storage {
        buffer<typename Column::scalar> values;
    };
    std::tuple<storage<Columns>...> columns_;
};

/// A layered image that has this column.
template <class Layers, class Column>
concept has_column = requires {
    requires std::remove_cvref_t<Layers>::template has<Column>;
};

/// A layered image that has these columns, and maybe more.
template <class Layers, class... Columns>
concept has_columns = (has_column<Layers, Columns> && ...);

/// One layer in the order of the photo, pixel (x, y) at index y * width + x: what lift() makes, and expand() puts hidden surfaces
/// behind.
template <payload_column... Columns>
class single_layer : public layered_image<Columns...> {
public:
    using layered_image<Columns...>::layered_image;
    explicit single_layer(layered_image<Columns...> layers) : layered_image<Columns...>(std::move(layers)) {
        const graph& g = this->topology;
        LDI_ASSERT(g.size() == g.position_count());
    }
};

/// The layered image that a photo becomes, and the layer that it starts from.
using photo_layers = layered_image<color_column, disparity_column, known_column>;
using photo_layer = single_layer<color_column, disparity_column, known_column>;

namespace detail {
template <class Layers, class Column>
struct with_column;
template <template <class...> class Layers, class... Columns, class Column>
struct with_column<Layers<Columns...>, Column> {
    using type = Layers<Columns..., Column>;
};
}  // namespace detail

/// The same layers with one more column.
///
/// values  K x channels, row-major, in the order of the pixels
///
///     struct normal { using scalar = float; static constexpr std::size_t channels = 3; };
///     auto layer = ldi::add_column<normal>(ldi::lift(photo, disparity), normals);   // stays with its pixels, up to the mesh
template <payload_column Column, class Layers>
auto add_column(Layers layers, std::span<const typename Column::scalar> values) {
    static_assert(!Layers::template has<Column>);
    LDI_ASSERT(values.size() == layers.size() * Column::channels);
    typename detail::with_column<Layers, Column>::type more;
    more.take(std::move(layers));
    more.template column<Column>().assign(values.begin(), values.end());
    return more;
}

}  // namespace ldi
