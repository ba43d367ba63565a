// `array_view<T>`: a non-owning view of an array. Like std::span, but indexed by any integer type without a cast.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// `array_view<const T>` is read-only, `array_view<T>` is writable. Converts from buffers, spans and containers such as
/// std::vector, and to spans. Does not convert from a temporary buffer or container, which the view would outlive.
template <class T>
class array_view {
public:
    using value_type = std::remove_const_t<T>;

    constexpr array_view() = default;
    /// data  first of `size` values; null only if size is 0. As with std::span, a literal 0 or a pointer to a derived class does
    ///       not compile
    template <class U>
    requires std::is_convertible_v<U (*)[], T (*)[]>
    constexpr array_view(U* data, std::size_t size) : data_(data), size_(size) { LDI_ASSERT(data != nullptr || size == 0); }
    array_view(buffer<value_type>& values) : array_view(values.data(), values.size()) {}
    array_view(const buffer<value_type>& values) requires std::is_const_v<T> : array_view(values.data(), values.size()) {}
    array_view(const buffer<value_type>&&) = delete;
    template <class U>
    requires std::is_convertible_v<U (*)[], T (*)[]>
    constexpr array_view(std::span<U> values) : array_view(values.data(), values.size()) {}
    template <class Container>
    requires std::is_lvalue_reference_v<Container> && requires(Container values) {
        typename std::remove_reference_t<Container>::allocator_type;
        array_view(values.data(), values.size());
    }
    array_view(Container&& values) : array_view(values.data(), values.size()) {}
    template <class U>
    requires(std::is_same_v<const U, T> && !std::is_const_v<U>) constexpr array_view(array_view<U> values)
        : array_view(values.data(), values.size()) {}

    constexpr T* data() const { return data_; }
    constexpr std::size_t size() const { return size_; }
    /// Returns size() as std::int32_t, the type of ldi's indices.
    std::int32_t count() const {
        LDI_ASSERT(size_ <= 0x7FFFFFFF);
        return static_cast<std::int32_t>(size_);
    }
    constexpr bool empty() const { return size_ == 0; }
    constexpr T* begin() const { return data_; }
    constexpr T* end() const { return data_ + size_; }
    template <std::integral Index>
    constexpr T& operator[](Index i) const {
        LDI_ASSERT(static_cast<std::size_t>(i) < size_);
        return data_[static_cast<std::size_t>(i)];
    }
    T& back() const {
        LDI_ASSERT(size_ > 0);
        return data_[size_ - 1];
    }
    buffer<value_type> copy() const { return buffer<value_type>(begin(), end()); }

    /// Compares all values.
    friend bool operator==(array_view a, array_view b) {
        if (a.size_ != b.size_) return false;
        for (std::size_t i = 0; i < a.size_; ++i)
            if (!(a.data_[i] == b.data_[i])) return false;
        return true;
    }
    friend bool operator==(array_view a, const buffer<value_type>& b) {
        return array_view<const value_type>(a) == array_view<const value_type>(b);
    }

private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

template <class T>
array_view(T*, std::size_t) -> array_view<T>;

}}  // namespace ldi
