// Weights and constants in the form in which kernels read them.
#pragma once

#include <ldi/base/config.hpp>

#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

template <class Data>
class prepared;

namespace detail {
template <class Data>
prepared<Data> prepared_from(Data data);
}

/// Data that a packing function prepared for its kernel. Callers can read the data, for example `weights->outputs`, but cannot
/// change it, because kernels do not check it.
template <class Data>
class prepared {
public:
    using value_type = typename Data::value_type;

    /// Makes an empty object, without outputs.
    prepared() = default;
    prepared(const prepared&) = default;
    prepared& operator=(const prepared& other) { return *this = prepared(other); }
    /// The moved-from object is empty.
    prepared(prepared&& other) noexcept : data_(std::exchange(other.data_, {})) {}
    prepared& operator=(prepared&& other) noexcept {
        data_ = std::exchange(other.data_, {});
        return *this;
    }

    const Data& operator*() const { return data_; }
    const Data* operator->() const { return &data_; }

private:
    friend prepared detail::prepared_from<Data>(Data data);

    explicit prepared(Data data) : data_(std::move(data)) {}

    Data data_;
};

template <class Data>
prepared<Data> detail::prepared_from(Data data) {
    return prepared<Data>(std::move(data));
}

}}  // namespace ldi
