// Runs Tiefenrausch, the depth network of the paper (section "Depth Estimation"), or any other network that maps a photo to
// 8-bit disparity of the same size. io/caffe2.hpp reads the published weights; nn/dense/quantized_weights.hpp reads the weights
// in examples/models.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/image.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/networks/detail/depth_layout.hpp>
#include <ldi/networks/detail/exponential.hpp>
#include <ldi/nn/dense/quantized_network.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Meaning of a depth network's output.
enum class network_output {
    log_disparity,  ///< logarithm of disparity, as in the published network; disparity is known up to a factor
    disparity,      ///< disparity, roughly 0 at infinity; its scale is unknown
};

/// Long sides of the resized photo that a depth network reads, in pixels; multiples of 32. The default is a single pass
/// at the paper's size.
struct depth_network_sizes {
    std::size_t details = 384;  ///< size of the main pass and of the result
    /// If not 0, a second pass at this size reads the mirrored photo, and structures coarser than 16 samples of the result
    /// become the mean of both passes.
    std::size_t layout = 0;
};

/// Estimates disparity from one photo. All members are const and stateless: any number of threads may share an object.
class tiefenrausch {
public:
    static constexpr std::size_t long_side = 384;  ///< long side of the paper's input, in pixels
    /// The sides of the network's input are multiples of this number, because the network halves its input five times.
    static constexpr std::size_t alignment = 32;

    /// Packs the network.
    ///
    /// target  the instruction set for which to pack the weights; results do not depend on it
    /// output  meaning of the network's output
    /// sizes   input sizes of disparity()
    ///
    /// Raises the errors of quantized_network. Raises mismatch unless the network maps a color image to one channel of the same
    /// height and width. Also raises mismatch unless sizes.details and sizes.layout are multiples of 32 and at most 4096, and
    /// sizes.details is positive. Raises unsupported if the scale of the network's output exceeds 0.25.
    explicit tiefenrausch(const network_description& description, isa target = best_isa(),
                          network_output output = network_output::log_disparity, depth_network_sizes sizes = {})
        : network_(description, target), output_(output), sizes_(sizes) {
        const std::string where = detail::place_in(description.where, "depth network");
        if (network_.input_channels() != 3 || network_.output_channels() != 1)
            raise(error_code::mismatch, where, "3 input channels and 1 output channel",
                  std::to_string(network_.input_channels()) + " and " + std::to_string(network_.output_channels()));
        const tensor_size smallest{alignment, alignment}, result = network_.output_size(smallest);
        if (result != smallest)
            raise(error_code::mismatch, where, "a result as large as the input, 32 x 32",
                  std::to_string(result.width) + " x " + std::to_string(result.height));
        for (const std::size_t side : {sizes.details, sizes.layout})
            if (side % alignment != 0 || side > max_long_side)
                raise(error_code::mismatch, where,
                      "long sides that are multiples of 32, at most " + std::to_string(max_long_side), std::to_string(side));
        if (sizes.details == 0) raise(error_code::mismatch, where, "a size of the main pass above 0", "0");
        if (level_quantization().scale > max_scale)
            raise(error_code::unsupported, where, "disparity or its logarithm in steps of at most " + detail::to_text(max_scale),
                  "steps of " + detail::to_text(level_quantization().scale));
    }

    depth_network_sizes sizes() const { return sizes_; }

    /// Returns the size to which resize_for_network() resizes a photo. The long side becomes `to`. The short side follows the
    /// aspect ratio, rounded down to a multiple of 32, but at least 32.
    ///
    /// to  the long side in pixels, a multiple of 32
    static tensor_size network_size(tensor_size photo, std::size_t to = long_side) {
        const std::size_t longer = (std::max)(photo.height, photo.width);
        const auto side = [&](std::size_t length) {
            const std::size_t scaled = length == longer ? to : static_cast<std::size_t>(std::uint64_t{length} * to / longer);
            return (std::max)(scaled / alignment * alignment, alignment);
        };
        return {side(photo.height), side(photo.width)};
    }

    /// Resizes a photo to network_size() by averaging over areas.
    ///
    /// photo  H x W x 3, red, green, blue, 0 to 255; raises invalid_data for any other shape and for an empty photo
    /// to     the long side of the result in pixels, a multiple of 32
    template <executor Executor>
    static image<std::uint8_t> resize_for_network(image_view<const std::uint8_t> photo, Executor& threads,
                                                  std::size_t to = long_side) {
        if (photo.empty() || photo.channels() != 3)
            raise(error_code::invalid_data, "photo", "H x W x 3 values, at least one pixel", detail::shape_text(photo));
        const tensor_size size = network_size({photo.height(), photo.width()}, to);
        return area_resize(photo, size.height, size.width, threads);
    }

    /// Runs the network once. Returns its 8-bit output, H' x W' x 1, in the quantization level_quantization(). Raises mismatch
    /// for any other shape of `rgb`, or if the network maps an input of this size to another size.
    ///
    /// rgb               H' x W' x 3, 0 to 255, both sides multiples of 32
    /// progress, memory  as in quantized_network::run
    template <executor Executor, class Progress = quantized_network::ignore_progress>
    image<std::uint8_t> levels(const image<std::uint8_t>& rgb, Executor& threads, Progress&& progress = {},
                               std::span<std::byte> memory = {}) const {
        check_input(rgb);
        return network_.run(quantized_color(rgb), threads, progress, memory);
    }

    /// Returns the same result as levels(), but runs the network layer by layer and calls `observe` with the result of each
    /// layer.
    ///
    /// observe  as in quantized_network::run_observed
    template <executor Executor, class Observe>
    image<std::uint8_t> levels_observed(const image<std::uint8_t>& rgb, Executor& threads, Observe&& observe) const {
        check_input(rgb);
        return network_.run_observed(quantized_color(rgb), threads, observe);
    }

    /// Same as quantized_network::describe_steps().
    buffer<quantized_network::step_description> describe_steps(tensor_size rgb) const { return network_.describe_steps(rgb); }

    isa target() const { return network_.target(); }

    /// Working memory of levels() in bytes, without its input and its result.
    std::size_t working_bytes(tensor_size rgb, std::size_t threads) const { return network_.working_bytes(rgb, threads); }

    /// Estimates disparity: positive, larger is nearer, known up to a factor. Returns H' x W' x 1, with H' x W' =
    /// network_size() for sizes().details. Raises the errors of resize_for_network() and levels().
    ///
    /// photo     H x W x 3, red, green, blue, 0 to 255, of any size
    /// progress  receives the stage "depth estimation"
    template <executor Executor = const serial_executor>
    image<float> disparity(image_view<const std::uint8_t> photo, const progress_listener& progress = {},
                           Executor&& threads = {}) const {
        const float share = sizes_.layout == 0 ? 1.0F : details_share();
        const auto see = [&](std::size_t side, bool is_mirrored, float begin, float end) {
            image<std::uint8_t> rgb = resize_for_network(photo, threads, side);
            if (is_mirrored) rgb = detail::mirrored(rgb);
            return disparity_of(levels(
                rgb, threads, [&](float fraction) { progress.report("depth estimation", begin + fraction * (end - begin)); }));
        };
        image<float> details = see(sizes_.details, false, 0, share);
        if (sizes_.layout == 0) return details;
        details = detail::with_layout(std::move(details), detail::mirrored(see(sizes_.layout, true, share, 1)));
        const float min = disparity_table()[0];
        for (float& disparity : details) disparity = (std::max)(disparity, min);
        return details;
    }

    /// Converts results of levels() to disparity. Returns the same shape.
    image<float> disparity_of(const image<std::uint8_t>& levels) const {
        const std::array<float, 256> table = disparity_table();
        image<float> result(levels.height(), levels.width(), levels.channels(), unset);
        std::transform(levels.data(), levels.data() + levels.size(), result.data(), [&](std::uint8_t q) { return table[q]; });
        return result;
    }

    /// Scales color from 0..255 to [0, 1] and quantizes it for the network's input. The result has the shape of `rgb`.
    image<std::uint8_t> quantized_color(const image<std::uint8_t>& rgb) const {
        const quantization q = network_.input_quantization();
        std::array<std::uint8_t, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i) {
            const float steps = detail::nearest_float(i) / 255.0F / q.scale;
            table[i] = static_cast<std::uint8_t>(std::clamp(std::nearbyint(steps) + q.zero_point, 0.0F, 255.0F));
        }
        image<std::uint8_t> result(rgb.height(), rgb.width(), rgb.channels(), unset);
        std::transform(rgb.data(), rgb.data() + rgb.size(), result.data(), [&](std::uint8_t v) { return table[v]; });
        return result;
    }

    quantization level_quantization() const { return network_.output_quantization(); }

    /// Ratio of the disparities of two consecutive output levels. Rounding alone can cause this ratio between neighboring
    /// pixels, so this ratio is no evidence of an edge. If the network outputs disparity, the ratio varies; returns the ratio
    /// of the two largest levels.
    float quantization_step() const {
        const std::array<float, 256> table = disparity_table();
        return output_ == network_output::log_disparity ? detail::exponential(level_quantization().scale)
                                                        : table[255] / table[254];
    }

private:
    static constexpr std::size_t max_long_side = 4096;
    static constexpr float max_scale = 0.25F;  ///< exp(255 * max_scale) is within the range of float

    /// Estimated share of the total time of both passes that the main pass takes, computed from the areas of the inputs.
    float details_share() const {
        const auto area = [](std::size_t side) { return detail::nearest_float(side * side); };
        return area(sizes_.details) / (area(sizes_.details) + area(sizes_.layout));
    }

    void check_input(const image<std::uint8_t>& rgb) const {
        if (rgb.size() == 0 || rgb.channels() != 3 || rgb.height() % alignment != 0 || rgb.width() % alignment != 0)
            raise(error_code::mismatch, "depth network's input", "sides that are multiples of 32, 3 channels",
                  std::to_string(rgb.height()) + " x " + std::to_string(rgb.width()) + " x " + std::to_string(rgb.channels()));
        const tensor_size size{rgb.height(), rgb.width()}, result = network_.output_size(size);
        if (result != size)
            raise(error_code::mismatch, "depth network",
                  "a result as large as the input, " + std::to_string(size.height) + " x " + std::to_string(size.width),
                  std::to_string(result.height) + " x " + std::to_string(result.width));
    }

    /// Disparity of each 8-bit output. If the network outputs disparity, values of at most 0 become half a quantization step,
    /// so that all results are positive.
    std::array<float, 256> disparity_table() const {
        const quantization q = level_quantization();
        std::array<float, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i) {
            const float value = (detail::nearest_float(i) - q.zero_point) * q.scale;
            table[i] = output_ == network_output::log_disparity ? detail::exponential(value) : (std::max)(value, q.scale / 2);
        }
        return table;
    }

    quantized_network network_;
    network_output output_;
    depth_network_sizes sizes_;
};

}}  // namespace ldi
