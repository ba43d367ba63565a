// Row-major images, H x W x C, channels last. Stages accept an `image_view`, so that callers can pass the memory of an engine,
// OpenCV or NumPy without a copy. Stages return an `image`, which owns its values.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>

#include <concepts>
#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

[[noreturn]] inline void refuse_size(std::size_t height, std::size_t width, std::size_t channels) {
    raise(error_code::too_large, "image", "a size that fits in memory",
          std::to_string(height) + " x " + std::to_string(width) + " x " + std::to_string(channels));
}

/// Returns the number of values from the start of one row to the start of the next: `row_stride`, or width * channels if it is 0.
/// Raises too_large if a row, or the whole image, exceeds the address space, and mismatch if rows would overlap.
inline std::size_t checked_row_stride(std::size_t height, std::size_t width, std::size_t channels, std::size_t row_stride,
                                      std::size_t value_size) {
    const std::size_t limit = static_cast<std::size_t>(PTRDIFF_MAX) / value_size;
    if (channels > 0 && width > limit / channels) refuse_size(height, width, channels);
    const std::size_t stride = row_stride == 0 ? width * channels : row_stride;
    if (stride < width * channels)
        raise(error_code::mismatch, "image_view", "a stride of at least " + std::to_string(width * channels) + " values",
              std::to_string(stride) + " values");
    if (stride > 0 && height > limit / stride) refuse_size(height, width, channels);
    return stride;
}

/// Converts a stride from bytes to values. Raises mismatch if the stride is not a whole number of values or if rows would
/// overlap, as they would with a stride of 0 bytes.
inline std::size_t stride_in_values(std::size_t bytes, std::size_t row_values, std::size_t value_size) {
    if (bytes % value_size != 0 || bytes / value_size < row_values)
        raise(error_code::mismatch, "image_view",
              "a stride of at least " + std::to_string(row_values) + " values of " + std::to_string(value_size) + " bytes",
              std::to_string(bytes) + " bytes");
    return bytes / value_size;
}

}  // namespace detail

/// Returns height * width * channels. Raises too_large if this many values of `value_size` bytes exceed the address space.
inline std::size_t checked_size(std::size_t height, std::size_t width, std::size_t channels, std::size_t value_size) {
    return height * detail::checked_row_stride(height, width, channels, 0, value_size);
}

/// Distance between the starts of two rows, in bytes.
struct byte_stride {
    std::size_t bytes;
};

/// Non-owning view of H x W x C values, with `row_stride` values from the start of a row to the start of the next.
/// Stages accept an `image_view<const T>`, through which they cannot change the values.
///
///     ldi::image_view<const std::uint8_t> photo(mat.data, mat.rows, mat.cols, 3, ldi::byte_stride{mat.step});  // CV_8UC3
template <class Scalar>
class image_view {
public:
    using value_type = std::remove_const_t<Scalar>;

    image_view() = default;
    /// data        first value of the first row; null only if the view is empty
    /// row_stride  values, not bytes, from the start of a row to the start of the next; 0 for rows without gaps. Raises
    ///             too_large for sizes beyond the address space, mismatch for a stride below W x C
    template <class T>
    requires std::is_convertible_v<T (*)[], Scalar (*)[]> image_view(T* data, std::size_t height, std::size_t width,
                                                                     std::size_t channels = 1, std::size_t row_stride = 0)
        : data_(data),
          height_(height),
          width_(width),
          channels_(channels),
          row_stride_(detail::checked_row_stride(height, width, channels, row_stride, sizeof(Scalar))) {
        LDI_ASSERT(data != nullptr || empty());
    }
    /// Views rows whose starts are `stride` bytes apart, the convention of OpenCV, NumPy and graphics APIs. Raises mismatch
    /// unless the stride is a whole number of values, at least W x C.
    template <class T>
    requires std::is_convertible_v<T (*)[], Scalar (*)[]> image_view(T* data, std::size_t height, std::size_t width,
                                                                     std::size_t channels, byte_stride stride)
        : image_view(data, height, width, channels, detail::stride_in_values(stride.bytes, width * channels, sizeof(Scalar))) {}
    /// Converts a writable view to a read-only view.
    template <class Other>
    requires(std::is_const_v<Scalar>&& std::is_same_v<Other, value_type>) image_view(const image_view<Other>& other)
        : image_view(other.data(), other.height(), other.width(), other.channels(), other.row_stride()) {}

    std::size_t height() const { return height_; }
    std::size_t width() const { return width_; }
    std::size_t channels() const { return channels_; }
    std::size_t row_stride() const { return row_stride_; }
    bool empty() const { return height_ == 0 || width_ == 0 || channels_ == 0; }

    /// Returns a pointer to the first value of the first row.
    Scalar* data() const { return data_; }
    /// Returns the W x C values of row y, contiguous.
    template <std::integral Index>
    Scalar* row(Index y) const {
        LDI_ASSERT(static_cast<std::size_t>(y) < height_);
        return data_ + static_cast<std::size_t>(y) * row_stride_;
    }
    template <std::integral Y, std::integral X, std::integral Channel = std::size_t>
    Scalar& operator()(Y y, X x, Channel c = 0) const {
        const std::size_t column = static_cast<std::size_t>(x), channel = static_cast<std::size_t>(c);
        LDI_ASSERT(static_cast<std::size_t>(y) < height_ && column < width_ && channel < channels_);
        return row(y)[column * channels_ + channel];
    }

private:
    Scalar* data_ = nullptr;
    std::size_t height_ = 0, width_ = 0, channels_ = 0, row_stride_ = 0;
};

template <class T, class... Sizes>
image_view(T*, Sizes...) -> image_view<T>;

/// Whether a type is an image_view, which owns no values.
template <class>
inline constexpr bool is_image_view = false;
template <class Scalar>
inline constexpr bool is_image_view<image_view<Scalar>> = true;

/// An image that owns its H x W x C values, without gaps. Constructors raise too_large for sizes beyond the address space.
///
/// A temporary image converts to a read-only view, so that it can be an argument. Therefore `image_view<const T> v = make();`
/// also compiles, but `v` then refers to a destroyed image. view() and row() of a temporary do not compile.
template <class Scalar>
class image {
public:
    using value_type = Scalar;

    image() = default;
    /// Initializes values to zero.
    image(std::size_t height, std::size_t width, std::size_t channels = 1) : image(height, width, channels, Scalar{}) {}
    /// Deleted, because a fill value such as 0.5 or std::uint8_t{200} must not convert to a number of channels.
    template <class Value>
    requires(std::floating_point<Value> || (std::integral<Value> && sizeof(Value) == 1))
        image(std::size_t height, std::size_t width, Value channels)
    = delete;
    /// Leaves values uninitialized.
    image(std::size_t height, std::size_t width, std::size_t channels, unset_t)
        : values_(checked_size(height, width, channels, sizeof(Scalar)), unset),
          height_(height),
          width_(width),
          channels_(channels) {}
    /// Initializes every value to `value`.
    image(std::size_t height, std::size_t width, std::size_t channels, Scalar value)
        : values_(checked_size(height, width, channels, sizeof(Scalar)), value),
          height_(height),
          width_(width),
          channels_(channels) {}
    /// Copies the values of a view.
    explicit image(image_view<const Scalar> view) : image(view.height(), view.width(), view.channels(), unset) {
        if (empty()) return;
        const std::size_t values = width_ * channels_;
        for (std::size_t y = 0; y < height_; ++y)
            for (std::size_t i = 0; i < values; ++i) row(y)[i] = view.row(y)[i];
    }
    image(const image&) = default;
    image& operator=(const image&) = default;
    image(image&& other) noexcept
        : values_(std::move(other.values_)),
          height_(std::exchange(other.height_, 0)),
          width_(std::exchange(other.width_, 0)),
          channels_(std::exchange(other.channels_, 0)) {}
    image& operator=(image&& other) noexcept {
        values_ = std::move(other.values_);
        height_ = std::exchange(other.height_, 0), width_ = std::exchange(other.width_, 0),
        channels_ = std::exchange(other.channels_, 0);
        return *this;
    }

    std::size_t height() const { return height_; }
    std::size_t width() const { return width_; }
    std::size_t channels() const { return channels_; }
    std::size_t row_stride() const { return width_ * channels_; }
    /// Number of values, H x W x C.
    std::size_t size() const { return values_.size(); }
    bool empty() const { return values_.empty(); }

    image_view<Scalar> view() & { return {data(), height_, width_, channels_}; }
    image_view<const Scalar> view() const& { return {data(), height_, width_, channels_}; }
    image_view<const Scalar> view() const&& = delete;
    operator image_view<Scalar>() & { return view(); }
    operator image_view<const Scalar>() const { return view(); }

    Scalar* data() & { return values_.data(); }
    const Scalar* data() const& { return values_.data(); }
    const Scalar* data() const&& = delete;
    Scalar* begin() & { return values_.begin(); }
    const Scalar* begin() const& { return values_.begin(); }
    const Scalar* begin() const&& = delete;
    Scalar* end() & { return values_.end(); }
    const Scalar* end() const& { return values_.end(); }
    const Scalar* end() const&& = delete;

    /// Returns the W x C values of row y, contiguous.
    template <std::integral Index>
    Scalar* row(Index y) & {
        LDI_ASSERT(static_cast<std::size_t>(y) < height_);
        return data() + static_cast<std::size_t>(y) * row_stride();
    }
    template <std::integral Index>
    const Scalar* row(Index y) const& {
        LDI_ASSERT(static_cast<std::size_t>(y) < height_);
        return data() + static_cast<std::size_t>(y) * row_stride();
    }
    template <std::integral Index>
    const Scalar* row(Index y) const&& = delete;
    template <std::integral Y, std::integral X, std::integral Channel = std::size_t>
    Scalar& operator()(Y y, X x, Channel c = 0) & {
        return data()[index(static_cast<std::size_t>(y), static_cast<std::size_t>(x), static_cast<std::size_t>(c))];
    }
    template <std::integral Y, std::integral X, std::integral Channel = std::size_t>
    const Scalar& operator()(Y y, X x, Channel c = 0) const& {
        return data()[index(static_cast<std::size_t>(y), static_cast<std::size_t>(x), static_cast<std::size_t>(c))];
    }
    template <std::integral Y, std::integral X, std::integral Channel = std::size_t>
    Scalar operator()(Y y, X x, Channel c = 0) const&& {
        return (*this)(y, x, c);
    }

    friend bool operator==(const image& a, const image& b) {
        return a.height_ == b.height_ && a.width_ == b.width_ && a.channels_ == b.channels_ && a.values_ == b.values_;
    }

private:
    std::size_t index(std::size_t y, std::size_t x, std::size_t c) const {
        LDI_ASSERT(y < height_ && x < width_ && c < channels_);
        return (y * width_ + x) * channels_ + c;
    }

    buffer<Scalar> values_;
    std::size_t height_ = 0, width_ = 0, channels_ = 0;
};

/// Whether two images or views have the same height, width and channels.
bool same_shape(const auto& a, const auto& b) {
    return a.height() == b.height() && a.width() == b.width() && a.channels() == b.channels();
}

}}  // namespace ldi
