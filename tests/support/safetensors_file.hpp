// Safetensors files for tests, built from a header's text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

namespace ldi::testing {

/// The header's length, the header, the data.
inline std::vector<std::byte> safetensors_file(std::string_view header, const std::vector<std::byte>& data = {}) {
    std::vector<std::byte> file;
    for (int i = 0; i < 8; ++i) file.push_back(static_cast<std::byte>(std::uint64_t{header.size()} >> (8 * i) & 255));
    for (char c : header) file.push_back(static_cast<std::byte>(c));
    file.insert(file.end(), data.begin(), data.end());
    return file;
}

/// Bytes of values in the memory of a little-endian machine.
template <class Scalar>
std::vector<std::byte> bytes_of_values(const std::vector<Scalar>& values) {
    std::vector<std::byte> bytes(values.size() * sizeof(Scalar));
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

}  // namespace ldi::testing
