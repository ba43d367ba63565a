// Random feature maps and weights.
#pragma once

#include <ldi/nn/ldi/feature_map.hpp>

#include "tests/support/random_graph.hpp"

#include <cstddef>
#include <random>

namespace ldi::testing {

inline buffer<float> random_floats(std::mt19937& random, std::size_t count) {
    buffer<float> values(count);
    for (float& v : values) v = static_cast<float>(below(random, 2001) - 1000) / 1000.0F;
    return values;
}

inline feature_map random_features(std::mt19937& random, std::size_t pixels, std::size_t channels) {
    feature_map result(pixels, channels);
    result.values = random_floats(random, pixels * channels);
    return result;
}

}  // namespace ldi::testing
