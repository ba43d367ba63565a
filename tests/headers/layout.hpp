// Properties of a type on which two translation units must agree, with any flags.
#pragma once

#include <cstddef>
#include <vector>

struct type_layout {
    const char* name;
    std::size_t size, alignment;
    bool standard;

    bool operator==(const type_layout& other) const {
        return size == other.size && alignment == other.alignment && standard == other.standard;
    }
};
