// The eight orientations of a camera, with their EXIF numbers.
#pragma once

#include <ldi/core/image.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Index arithmetic to read a stored picture in upright order: upright pixel (y, x) is stored at index origin + y * down + x *
/// right.
struct upright_order {
    std::size_t height, width;
    std::ptrdiff_t origin, down, right;
};

inline upright_order make_upright(unsigned orientation, std::size_t stored_height, std::size_t stored_width) {
    const std::ptrdiff_t h = static_cast<std::ptrdiff_t>(stored_height), w = static_cast<std::ptrdiff_t>(stored_width);
    switch (orientation) {
        case 2: return {stored_height, stored_width, w - 1, w, -1};        // mirrored
        case 3: return {stored_height, stored_width, h * w - 1, -w, -1};   // upside down
        case 4: return {stored_height, stored_width, (h - 1) * w, -w, 1};  // upside down and mirrored
        case 5: return {stored_width, stored_height, 0, 1, w};             // transposed
        case 6: return {stored_width, stored_height, (h - 1) * w, 1, -w};  // rotated: turn right
        case 7: return {stored_width, stored_height, h * w - 1, -1, -w};   // rotated and mirrored
        case 8: return {stored_width, stored_height, w - 1, -1, w};        // rotated: turn left
        default: return {stored_height, stored_width, 0, w, 1};
    }
}

/// Rotates and mirrors a stored picture so that it is upright.
///
/// stored  H x W x 1
template <class Scalar>
image<Scalar> turn_upright(image<Scalar> stored, unsigned orientation) {
    if (orientation < 2 || orientation > 8) return stored;
    const upright_order order = make_upright(orientation, stored.height(), stored.width());
    image<Scalar> result(order.height, order.width, 1, unset);
    for (std::size_t y = 0; y < order.height; ++y)
        for (std::size_t x = 0; x < order.width; ++x)
            result.row(y)[x] = stored.data()[order.origin + static_cast<std::ptrdiff_t>(y) * order.down +
                                             static_cast<std::ptrdiff_t>(x) * order.right];
    return result;
}

}}}  // namespace ldi::detail
