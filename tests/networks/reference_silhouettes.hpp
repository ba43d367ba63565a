// The silhouette network on whole images, pixel by pixel and in integers, as described in
// examples/training/silhouettes/README.md.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/kernels/conv_u8/scalar.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace ldi::testing {

class reference_silhouettes {
public:
    /// reads  names of the inputs, of which those coarser than the result are upsampled
    /// level  level of the result; level 0 has full resolution
    struct layer {
        std::string name;
        std::vector<std::string> reads;
        std::size_t outputs, level, stride;
    };
    static std::vector<layer> layers() {
        return {{"fine", {"input"}, 16, 0, 1},
                {"half.down", {"fine"}, 32, 1, 2},
                {"half", {"half.down"}, 32, 1, 1},
                {"quarter.down", {"half"}, 32, 2, 2},
                {"quarter", {"quarter.down"}, 32, 2, 1},
                {"eighth.down", {"quarter"}, 32, 3, 2},
                {"eighth", {"eighth.down"}, 32, 3, 1},
                {"quarter.up", {"eighth", "quarter"}, 32, 2, 1},
                {"half.up", {"quarter.up", "half"}, 16, 1, 1},
                {"fine.up", {"half.up", "fine"}, 16, 0, 1},
                {"out", {"fine.up"}, 2, 0, 1}};
    }

    explicit reference_silhouettes(const named_tensors& weights) : weights_(weights) {}

    /// Returns the logits, H x W x 2.
    ///
    /// input   H x W x 8
    /// region  H x W, nonzero inside the region
    image<float> operator()(const image<std::uint8_t>& input, const image<std::uint8_t>& region) {
        regions_[0] = region;
        for (std::size_t i = 1; i < regions_.size(); ++i) {
            regions_[i] = image<std::uint8_t>((regions_[i - 1].height() + 1) / 2, (regions_[i - 1].width() + 1) / 2);
            for (std::size_t y = 0; y < regions_[i].height(); ++y)
                for (std::size_t x = 0; x < regions_[i].width(); ++x) regions_[i](y, x) = regions_[i - 1](2 * y, 2 * x);
        }
        values_["input"] = {input, 0};
        image<float> out;
        for (const layer& l : layers()) {
            if (l.name == "out")
                out = convolved<float>(l);
            else
                values_[l.name] = {convolved<std::uint8_t>(l), l.level};
        }
        return out;
    }

private:
    struct map {
        image<std::uint8_t> values;
        std::size_t level = 0;
    };

    const buffer<float>& numbers(const std::string& name) const {
        return std::get<buffer<float>>(weights_.tensors.at(name).values);
    }
    float scale(const std::string& of) const {
        const buffer<float>& range = numbers(of + ".range");
        return (range[1] - range[0]) / 255.0F;
    }
    std::int32_t zero(const std::string& of) const {
        return static_cast<std::int32_t>(std::lround(-numbers(of + ".range")[0] / scale(of)));
    }

    /// Returns a value minus its zero point, at a pixel of a level; 0 outside the region.
    std::int32_t value_at(const std::string& of, std::size_t level, std::int64_t y, std::int64_t x, std::size_t c) const {
        const map& m = values_.at(of);
        const auto is_in = [&](std::size_t l, std::int64_t v, std::int64_t u) {
            const image<std::uint8_t>& r = regions_[l];
            return v >= 0 && u >= 0 && v < static_cast<std::int64_t>(r.height()) && u < static_cast<std::int64_t>(r.width()) &&
                   r(v, u) != 0;
        };
        if (!is_in(level, y, x)) return 0;
        if (m.level > level) y /= 2, x /= 2;
        return is_in(m.level, y, x) ? m.values(y, x, c) - zero(of) : 0;
    }

    template <class Result>
    image<Result> convolved(const layer& l) const {
        const image<std::uint8_t>& region = regions_[l.level];
        const buffer<float>&weights = numbers(l.name + ".weight"), &bias = numbers(l.name + ".bias");
        const std::size_t inputs = weights.size() / (l.outputs * 9), each = inputs / l.reads.size();
        const std::size_t input_level = l.stride == 2 ? l.level - 1 : l.level;
        constexpr bool is_last = std::is_same_v<Result, float>;
        const float result_scale = is_last ? 1.0F : scale(l.name);
        image<Result> result(region.height(), region.width(), l.outputs, Result{});
        for (std::size_t o = 0; o < l.outputs; ++o) {
            std::vector<float> scaled(inputs * 9);
            float largest = 0;
            for (std::size_t i = 0; i < scaled.size(); ++i) {
                scaled[i] = weights[o * scaled.size() + i] * scale(l.reads[i / 9 / each]);
                largest = std::max(largest, std::abs(scaled[i]));
            }
            const float step = largest > 0 ? largest / 63.0F : 1.0F;
            std::vector<std::int32_t> rounded;
            for (const float w : scaled) rounded.push_back(static_cast<std::int32_t>(std::lround(w / step)));
            for (std::size_t y = 0; y < region.height(); ++y)
                for (std::size_t x = 0; x < region.width(); ++x) {
                    if (region(y, x) == 0) continue;
                    std::int32_t sum = 0;
                    for (std::size_t i = 0; i < scaled.size(); ++i)
                        sum += rounded[i] * value_at(l.reads[i / 9 / each], input_level,
                                                     static_cast<std::int64_t>(l.stride * y + i % 9 / 3) - 1,
                                                     static_cast<std::int64_t>(l.stride * x + i % 3) - 1, i / 9 % each);
                    result(y, x, o) = scalar::finish_conv_u8<Result>(sum, step / result_scale, bias[o] / result_scale,
                                                                     is_last ? 1.0F : 0.0F, 0.0F);
                }
        }
        return result;
    }

    const named_tensors& weights_;
    std::array<image<std::uint8_t>, 4> regions_;
    std::map<std::string, map> values_;
};

}  // namespace ldi::testing
