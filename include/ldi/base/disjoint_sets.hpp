// Disjoint sets of the integers 0 to size() - 1, merged in amortized logarithmic time: union-find with path halving (Tarjan and
// van Leeuwen, "Worst-case analysis of set union algorithms", 1984). The smallest member represents its set, so that results do
// not depend on the order of merging.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A partition of the integers from 0. Sets can be added and merged, but not divided.
class disjoint_sets {
public:
    disjoint_sets() = default;
    /// Starts with one set per integer.
    explicit disjoint_sets(std::size_t count) {
        parent_.reserve(count);
        while (parent_.size() < count) add();
    }

    std::size_t size() const { return parent_.size(); }

    /// Appends an integer as a new set, and returns it.
    std::int32_t add() {
        const std::int32_t member = parent_.count();
        parent_.push_back(member);
        return member;
    }

    /// Returns the smallest member of the set that contains `member`.
    std::int32_t find(std::int32_t member) {
        LDI_ASSERT(member >= 0 && member < parent_.count());
        while (parent(member) != member) {
            parent(member) = parent(parent(member));
            member = parent(member);
        }
        return member;
    }

    /// Merges the sets that contain a and b, and returns the smallest member of the result.
    std::int32_t merge(std::int32_t a, std::int32_t b) {
        a = find(a), b = find(b);
        if (b < a) {
            parent(a) = b;
            return b;
        }
        parent(b) = a;
        return a;
    }

    /// Numbers the sets from 0 in the order of their smallest members, and returns the number of sets. labels[member] becomes
    /// the number of its set.
    std::int32_t number(buffer<std::int32_t>& labels) const {
        labels.resize(size());
        std::int32_t count = 0;
        for (std::int32_t i = 0; i < parent_.count(); ++i) {
            const std::int32_t up = parent_[i];  // at most i, so labels[up] is already set
            labels[i] = up == i ? count++ : labels[up];
        }
        return count;
    }

private:
    std::int32_t& parent(std::int32_t member) { return parent_[member]; }

    buffer<std::int32_t> parent_;
};

}}  // namespace ldi
