// `buffer<T>` owns all values in ldi: images, graphs, columns, plans and feature maps consist of buffers.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/detail/memory_block.hpp>
#include <ldi/base/memory.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <new>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Alignment of buffers in bytes: a cache line, so that aligned vector loads of packed values never straddle two lines.
inline constexpr std::size_t buffer_alignment = 64;

/// Tag for uninitialized values. Without it, a buffer initializes values to zero.
struct unset_t {
    explicit unset_t() = default;  // {} must not mean `unset`
};
inline constexpr unset_t unset{};

namespace detail {

/// An iterator that supports differences. Replaces std::random_access_iterator, because nothing else here requires <iterator>.
template <class T>
concept element_iterator = requires(T i) {
    *i;
    ++i;
    i - i;
};

}  // namespace detail

/// A growable array, aligned to 64 bytes. It adopts the allocator that is current at its first successful allocation
/// (base/memory.hpp). Differences from std::vector: operator[] accepts any integer type without a cast, `unset` leaves values of
/// trivial types uninitialized, and a moved-from buffer is empty.
///
/// Like any container, a temporary buffer converts to std::span<const T>, so that it can be an argument. Therefore
/// `std::span<const float> s = make();` also compiles, but `s` then refers to destroyed values. array_view does not allow this
/// conversion.
///
/// If memory runs out, a buffer throws std::bad_alloc; without exceptions, it raises out_of_memory. It raises too_large for a
/// size beyond the address space. After these errors, the buffer keeps its values, except in assign(). It also keeps them if a
/// value's copy constructor throws while the buffer grows or is assigned to. If the move constructor of the value type may
/// throw, a growing buffer copies the values instead of moving them. The iterators of append() and insert() must not throw.
template <class T>
class buffer {
public:
    using value_type = T;
    using iterator = T*;
    using const_iterator = const T*;

    buffer() = default;
    // Delegates to the default constructor, so that the destructor releases the values if memory runs out during construction.
    explicit buffer(std::size_t count) : buffer() { resize(count); }
    buffer(std::size_t count, unset_t) : buffer() { resize(count, unset); }
    buffer(std::size_t count, const T& value) : buffer() { resize(count, value); }
    buffer(std::initializer_list<T> values) : buffer(values.begin(), values.end()) {}
    template <detail::element_iterator Iterator>
    buffer(Iterator first, Iterator last) : buffer() {
        append(first, last);
    }
    buffer(const buffer& other) : buffer(other.begin(), other.end()) {}
    buffer(buffer&& other) noexcept : block_(other.block_) { other.block_ = {}; }
    buffer& operator=(const buffer& other) {
        if (this == &other) return *this;
        if constexpr (moves_as_bytes) {
            reserve(other.size());  // first, so that the values remain if memory runs out
            assign(other.begin(), other.end());
        } else {
            buffer copy;
            copy.block_.from = block_.from;
            copy.append(other.begin(), other.end());
            swap(copy);
        }
        return *this;
    }
    buffer& operator=(buffer&& other) noexcept {
        buffer(std::move(other)).swap(*this);
        return *this;
    }
    ~buffer() {
        destroy_from(0);
        block_.release(sizeof(T));
    }

    std::size_t size() const { return block_.size; }
    /// Returns size() as std::int32_t, the type of ldi's indices.
    std::int32_t count() const {
        LDI_ASSERT(size() <= 0x7FFFFFFF);
        return static_cast<std::int32_t>(size());
    }
    std::size_t capacity() const { return block_.capacity; }
    bool empty() const { return size() == 0; }
    T* data() & { return static_cast<T*>(block_.values); }
    const T* data() const& { return static_cast<const T*>(block_.values); }
    T* begin() & { return data(); }
    const T* begin() const& { return data(); }
    T* end() & { return data() + size(); }
    const T* end() const& { return data() + size(); }

    template <std::integral Index>
    T& operator[](Index i) & {
        LDI_ASSERT(static_cast<std::size_t>(i) < size());
        return data()[static_cast<std::size_t>(i)];
    }
    template <std::integral Index>
    const T& operator[](Index i) const& {
        LDI_ASSERT(static_cast<std::size_t>(i) < size());
        return data()[static_cast<std::size_t>(i)];
    }
    T& front() & { return (*this)[0]; }
    const T& front() const& { return (*this)[0]; }
    T& back() & { return (*this)[size() - 1]; }
    const T& back() const& { return (*this)[size() - 1]; }

    // A temporary buffer returns copies of single values, but no references or pointers, which would dangle.
    template <std::integral Index>
    T operator[](Index i) const&& {
        return (*this)[i];
    }
    T front() const&& { return front(); }
    T back() const&& { return back(); }
    const T* data() const&& = delete;
    const T* begin() const&& = delete;
    const T* end() const&& = delete;

    /// Initializes new values to zero.
    void resize(std::size_t count) {
        make_size(count);
        for (; size() < count; ++block_.size) ::new (place_at_end()) T();
    }
    /// Leaves new values of trivial types uninitialized.
    void resize(std::size_t count, unset_t) {
        if constexpr (__is_trivially_constructible(T)) {
            make_size(count);
            block_.size = count;
        } else {
            resize(count);
        }
    }
    void resize(std::size_t count, const T& value) {
        const T copy = value;  // `value` may be an element of this buffer, whose values move
        make_size(count);
        for (; size() < count; ++block_.size) ::new (place_at_end()) T(copy);
    }
    void reserve(std::size_t count) {
        if (count > capacity()) reallocate(count);
    }
    void clear() { destroy_from(0); }
    /// `value` may be an element of this buffer. The range [first, last) of the other overload must not lie in this buffer.
    void assign(std::size_t count, const T& value) {
        const T copy = value;
        clear();
        resize(count, copy);
    }
    template <detail::element_iterator Iterator>
    void assign(Iterator first, Iterator last) {
        clear();
        append(first, last);
    }
    void push_back(const T& value) { emplace_back(value); }
    void push_back(T&& value) { emplace_back(std::move(value)); }
    template <class... Arguments>
    T& emplace_back(Arguments&&... arguments) {
        if (size() == capacity()) {
            T made(std::forward<Arguments>(arguments)...);  // the arguments may refer to elements that move
            reallocate(block_.grown(size() + 1));
            ::new (place_at_end()) T(std::move(made));
        } else {
            ::new (place_at_end()) T(std::forward<Arguments>(arguments)...);
        }
        return data()[block_.size++];  // counts the value last, so that it is not destroyed if its constructor throws
    }
    void pop_back() {
        LDI_ASSERT(!empty());
        destroy_from(size() - 1);
    }
    /// The range must not lie in this buffer.
    template <detail::element_iterator Iterator>
    void append(Iterator first, Iterator last) {
        LDI_ASSERT(accepts(first, last));
        make_room(size() + static_cast<std::size_t>(last - first));
        if constexpr (moves_as_bytes && (std::same_as<Iterator, T*> || std::same_as<Iterator, const T*>)) {
            // memcpy() instead of a loop: a pointer to bytes may alias the size, so a loop would have to write the size to memory
            // after each value.
            if (first != last) std::memcpy(place_at_end(), first, static_cast<std::size_t>(last - first) * sizeof(T));
            block_.size += static_cast<std::size_t>(last - first);
            return;
        }
        for (; first != last; ++first, ++block_.size) ::new (place_at_end()) T(static_cast<T>(*first));
    }
    /// Inserts values of trivial types. The range must not lie in this buffer.
    T* insert(T* place, const T& value) { return insert(place, {value}); }
    template <detail::element_iterator Iterator>
    T* insert(T* place, Iterator first, Iterator last) {
        static_assert(moves_as_bytes);
        LDI_ASSERT(begin() <= place && place <= end() && accepts(first, last));
        const std::size_t at = static_cast<std::size_t>(place - begin()), moved = size() - at;
        const std::size_t count = static_cast<std::size_t>(last - first);
        if (size() + count > capacity()) reallocate(block_.grown(size() + count));
        place = begin() + at;
        if (moved > 0) std::memmove(static_cast<void*>(place + count), place, moved * sizeof(T));
        for (T* to = place; first != last; ++first, ++to) ::new (static_cast<void*>(to)) T(static_cast<T>(*first));
        block_.size += count;
        return place;
    }
    T* insert(T* place, std::initializer_list<T> values) { return insert(place, values.begin(), values.end()); }
    T* erase(T* first, T* last) {
        static_assert(moves_as_bytes);
        LDI_ASSERT(begin() <= first && first <= last && last <= end());
        if (last != end()) std::memmove(static_cast<void*>(first), last, static_cast<std::size_t>(end() - last) * sizeof(T));
        block_.size -= static_cast<std::size_t>(last - first);
        return first;
    }
    T* erase(T* place) { return erase(place, place + 1); }

    void swap(buffer& other) noexcept {
        const detail::memory_block mine = block_;
        block_ = other.block_;
        other.block_ = mine;
    }
    friend void swap(buffer& a, buffer& b) noexcept { a.swap(b); }
    friend bool operator==(const buffer& a, const buffer& b) {
        if (a.size() != b.size()) return false;
        for (std::size_t i = 0; i < a.size(); ++i)
            if (!(a[i] == b[i])) return false;
        return true;
    }

private:
    // Uses a compiler built-in, because the standard library's traits instantiate several more templates for every type of value.
    static constexpr bool moves_as_bytes = __is_trivially_copyable(T);
    static constexpr std::size_t alignment = alignof(T) > buffer_alignment ? alignof(T) : buffer_alignment;

    // Whether append() accepts a range: it must not be reversed or overlap this buffer. Only pointers can be checked for overlap.
    template <class Iterator>
    bool accepts(Iterator first, Iterator last) const {
        if constexpr (std::is_pointer_v<Iterator>) {
            const auto from = reinterpret_cast<std::uintptr_t>(first), to = reinterpret_cast<std::uintptr_t>(last);
            const auto mine = reinterpret_cast<std::uintptr_t>(begin()),
                       my_end = reinterpret_cast<std::uintptr_t>(begin() + capacity());
            if (from != to && from < my_end && mine < to) return false;
        }
        return last - first >= 0;
    }

    void* place_at_end() { return static_cast<void*>(end()); }

    void make_room(std::size_t count) {
        if (count > capacity()) reallocate(empty() ? count : block_.grown(count));
    }
    // Destroys values beyond `count`, or makes room for `count` values.
    void make_size(std::size_t count) {
        if (count < size()) destroy_from(count);
        make_room(count);
    }

    void destroy_from(std::size_t count) {
        if constexpr (!moves_as_bytes)
            for (std::size_t i = count; i < size(); ++i) data()[i].~T();
        block_.size = count;
    }

    void reallocate(std::size_t new_capacity) {  // both branches call functions that are not inlined, because buffers rarely grow
        if constexpr (moves_as_bytes)
            block_.reallocate(new_capacity, sizeof(T), alignment);
        else
            move_to(static_cast<T*>(block_.allocate(new_capacity, sizeof(T), alignment)), new_capacity);
    }
    [[gnu::noinline]] void move_to(T* place, std::size_t new_capacity) {
        static_assert(std::is_nothrow_move_constructible_v<T> || std::is_copy_constructible_v<T>,
                      "the type needs a noexcept move constructor or a copy constructor");
        buffer moved;  // its destructor releases `place` if a constructor throws, and otherwise the old block
        moved.block_ = {place, 0, new_capacity, block_.from};
        for (; moved.size() < size(); ++moved.block_.size)
            ::new (moved.place_at_end()) T(std::move_if_noexcept(data()[moved.size()]));
        swap(moved);
    }

    detail::memory_block block_;
};

}}  // namespace ldi
