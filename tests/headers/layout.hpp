// What two translation units must agree on about a type, whatever flags they were compiled with.
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
