// A reader of NumPy's .npy files for tests: row-major arrays of uint8 or float32. Files are trusted.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <type_traits>
#include <vector>

namespace ldi::testing {

/// Reads all bytes of a file; empty if there is none.
inline std::vector<std::uint8_t> read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

template <class Scalar>
struct npy_array {
    std::vector<std::size_t> shape;
    std::vector<Scalar> values;  ///< empty if the file is missing or has another type
};

template <class Scalar>
npy_array<Scalar> read_npy(const std::string& path) {
    static_assert(std::is_same_v<Scalar, std::uint8_t> || std::is_same_v<Scalar, float>);
    npy_array<Scalar> result;
    const std::vector<std::uint8_t> content = read_bytes(path);
    if (content.size() < 10) return result;
    const std::size_t header_size = content[8] + std::size_t{content[9]} * 256;
    const std::string header(content.begin() + 10, content.begin() + 10 + static_cast<std::ptrdiff_t>(header_size));
    if (header.find(std::is_same_v<Scalar, float> ? "<f4" : "|u1") == std::string::npos) return result;
    const std::size_t open = header.find('('), close = header.find(')');
    for (std::size_t at = open + 1; at < close;) {
        char* end = nullptr;
        const unsigned long side = std::strtoul(header.c_str() + at, &end, 10);
        if (end == header.c_str() + at) break;
        result.shape.push_back(side);
        at = header.find_first_not_of(", ", static_cast<std::size_t>(end - header.c_str()));
    }
    result.values.resize((content.size() - 10 - header_size) / sizeof(Scalar));
    std::copy_n(content.data() + 10 + header_size, result.values.size() * sizeof(Scalar),
                reinterpret_cast<std::uint8_t*>(result.values.data()));
    return result;
}

}  // namespace ldi::testing
