// Memory. `buffer<T>` is the one owner of values in ldi: images, graphs, columns, plans and feature maps stand on it. It takes
// its memory from the caller's allocator, which `memory_scope` sets, so that an engine's budget holds for every stage.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <new>
#include <type_traits>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

/// A source of memory. It must live as long as anything that was allocated from it. Its functions are called on any thread that
/// works for a stage.
struct memory {
    void* context = nullptr;
    /// At least `bytes` bytes, aligned to `alignment`, a power of two; null if there is not enough.
    void* (*allocate)(void* context, std::size_t bytes, std::size_t alignment) = nullptr;
    /// Takes back what `allocate` returned for the same number of bytes.
    void (*release)(void* context, void* block, std::size_t bytes) = nullptr;
};

/// The start of a cache line, so that no vector load of packed values straddles two.
inline constexpr std::size_t buffer_alignment = 64;

namespace detail {

inline void* allocate_from_system(void*, std::size_t bytes, std::size_t alignment) {
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}
inline void release_to_system(void*, void* block, std::size_t) { std::free(block); }

inline constexpr memory system_memory{nullptr, &allocate_from_system, &release_to_system};

/// The memory that this thread allocates from.
inline const memory*& memory_of_thread() {
    static thread_local const memory* current = &system_memory;
    return current;
}

/// An iterator with a difference: std::random_access_iterator without the header that defines it.
template <class T>
concept element_iterator = requires(T i) {
    *i;
    ++i;
    i - i;
};

/// Apart from `buffer`, so that it is compiled once for all element types.
[[noreturn]] inline void out_of_memory() {
#if LDI_HAS_EXCEPTIONS
    throw std::bad_alloc();
#else
    raise(error_code::out_of_memory, "memory", "enough of it", "too little");  // texts so short that they need none
#endif
}

}  // namespace detail

/// The memory that buffers on this thread are allocated from at present: the C library's, unless a `memory_scope` says otherwise.
inline const memory& current_memory() { return *detail::memory_of_thread(); }

/// Makes the calling thread allocate from `from` until the end of the block. Stages hand it on to the threads of their executor.
///
///     ldi::memory_scope scope(my_engine_memory);
///     ldi::photo3d result = ldi::make_photo3d(photo, estimator, inpainter);
class memory_scope {
public:
    explicit memory_scope(const memory& from) : before_(std::exchange(detail::memory_of_thread(), &from)) {}
    ~memory_scope() { detail::memory_of_thread() = before_; }
    memory_scope(const memory_scope&) = delete;
    memory_scope& operator=(const memory_scope&) = delete;

private:
    const memory* before_;
};

/// Asks for values that are left as they are. Without it a buffer sets them to zero.
struct unset_t {};
inline constexpr unset_t unset{};

/// A growing array, aligned to 64 bytes, on the memory that was current when it first allocated. It knows where that was, and
/// gives it back there. It is like std::vector, but any integer subscripts it without a cast, `unset` leaves values of trivial
/// types as they are, and a moved-from buffer is empty. If memory runs out it throws std::bad_alloc and keeps its values; without
/// exceptions it raises error_code::out_of_memory.
template <class T>
class buffer {
public:
    using value_type = T;
    using iterator = T*;
    using const_iterator = const T*;

    buffer() = default;
    // Through the default constructor: where memory runs out half way, the destructor gives back what there is.
    explicit buffer(std::size_t count) : buffer() { resize(count); }
    buffer(std::size_t count, unset_t) : buffer() { resize(count, unset); }
    buffer(std::size_t count, const T& value) : buffer() { resize(count, value); }
    buffer(std::initializer_list<T> values) : buffer(values.begin(), values.end()) {}
    template <detail::element_iterator Iterator>
    buffer(Iterator first, Iterator last) : buffer() {
        append(first, last);
    }
    buffer(const buffer& other) : buffer(other.begin(), other.end()) {}
    buffer(buffer&& other) noexcept
        : values_(std::exchange(other.values_, nullptr)),
          size_(std::exchange(other.size_, 0)),
          capacity_(std::exchange(other.capacity_, 0)),
          from_(std::exchange(other.from_, nullptr)) {}
    buffer& operator=(const buffer& other) {
        if (this != &other) assign(other.begin(), other.end());
        return *this;
    }
    buffer& operator=(buffer&& other) noexcept {
        buffer(std::move(other)).swap(*this);
        return *this;
    }
    ~buffer() { release(); }

    std::size_t size() const { return size_; }
    /// size() in the type that ldi's indices have; also the index of the value that is appended next.
    std::int32_t count() const {
        LDI_ASSERT(size_ <= 0x7FFFFFFF);
        return static_cast<std::int32_t>(size_);
    }
    std::size_t capacity() const { return capacity_; }
    bool empty() const { return size_ == 0; }
    T* data() { return values_; }
    const T* data() const { return values_; }
    T* begin() { return values_; }
    const T* begin() const { return values_; }
    T* end() { return values_ + size_; }
    const T* end() const { return values_ + size_; }

    template <std::integral Index>
    T& operator[](Index i) {
        return values_[static_cast<std::size_t>(i)];
    }
    template <std::integral Index>
    const T& operator[](Index i) const {
        return values_[static_cast<std::size_t>(i)];
    }
    T& front() { return (*this)[0]; }
    const T& front() const { return (*this)[0]; }
    T& back() { return (*this)[size_ - 1]; }
    const T& back() const { return (*this)[size_ - 1]; }

    /// New values are zero.
    void resize(std::size_t count) {
        change_size(count, [](T* place) { construct(place); });
    }
    /// New values of trivial types are not set.
    void resize(std::size_t count, unset_t) {
        if constexpr (std::is_trivially_default_constructible_v<T>)
            change_size(count, [](T*) {});
        else
            resize(count);
    }
    void resize(std::size_t count, const T& value) {
        change_size(count, [copy = value](T* place) { construct(place, copy); });
    }
    void reserve(std::size_t count) {
        if (count > capacity_) reallocate(count);
    }
    void clear() { destroy_from(0); }
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
        if (size_ == capacity_) {
            T made(std::forward<Arguments>(arguments)...);  // the arguments may lie in what moves
            reallocate(grown(size_ + 1));
            construct(values_ + size_, std::move(made));
        } else {
            construct(values_ + size_, std::forward<Arguments>(arguments)...);
        }
        return values_[size_++];  // only now: what could not be made is not destroyed
    }
    void pop_back() {
        --size_;
        values_[size_].~T();
    }
    /// The range must not lie in this buffer.
    template <detail::element_iterator Iterator>
    void append(Iterator first, Iterator last) {
        const std::size_t count = distance(first, last);
        if (size_ + count > capacity_) reallocate(size_ == 0 ? count : grown(size_ + count));
        for (; first != last; ++first, ++size_) construct(values_ + size_, static_cast<T>(*first));
    }
    /// Trivial types only, as erase. `value` must not lie in this buffer.
    T* insert(T* place, const T& value) { return insert(place, &value, &value + 1); }
    template <detail::element_iterator Iterator>
    T* insert(T* place, Iterator first, Iterator last) {
        static_assert(std::is_trivially_copyable_v<T>);
        const std::size_t at = distance(begin(), place), moved = size_ - at, count = distance(first, last);
        if (size_ + count > capacity_) reallocate(grown(size_ + count));
        if (moved > 0) std::memmove(static_cast<void*>(values_ + at + count), values_ + at, moved * sizeof(T));
        for (T* to = values_ + at; first != last; ++first, ++to) construct(to, static_cast<T>(*first));
        size_ += count;
        return values_ + at;
    }
    T* insert(T* place, std::initializer_list<T> values) { return insert(place, values.begin(), values.end()); }
    T* erase(T* first, T* last) {
        static_assert(std::is_trivially_copyable_v<T>);
        if (last != end()) std::memmove(static_cast<void*>(first), last, distance(last, end()) * sizeof(T));
        size_ -= distance(first, last);
        return first;
    }
    T* erase(T* place) { return erase(place, place + 1); }

    void swap(buffer& other) noexcept {
        std::swap(values_, other.values_);
        std::swap(size_, other.size_);
        std::swap(capacity_, other.capacity_);
        std::swap(from_, other.from_);
    }
    friend void swap(buffer& a, buffer& b) noexcept { a.swap(b); }
    friend bool operator==(const buffer& a, const buffer& b) {
        if (a.size_ != b.size_) return false;
        for (std::size_t i = 0; i < a.size_; ++i)
            if (!(a.values_[i] == b.values_[i])) return false;
        return true;
    }

private:
    template <class... Arguments>
    static T& construct(T* place, Arguments&&... arguments) {
        return *::new (static_cast<void*>(place)) T(std::forward<Arguments>(arguments)...);
    }
    template <class Iterator>
    static std::size_t distance(Iterator first, Iterator last) {
        return static_cast<std::size_t>(last - first);
    }

    std::size_t grown(std::size_t needed) const {
        const std::size_t more = capacity_ + capacity_ / 2 + 4;
        return more > needed ? more : needed;
    }

    template <class Make>
    void change_size(std::size_t count, Make make) {
        if (count < size_) destroy_from(count);
        if (count > capacity_) reallocate(size_ == 0 ? count : grown(count));
        for (; size_ < count; ++size_) make(values_ + size_);
    }

    void destroy_from(std::size_t count) {
        if constexpr (!std::is_trivially_destructible_v<T>)
            for (std::size_t i = count; i < size_; ++i) values_[i].~T();
        size_ = count;
    }

    [[gnu::noinline]] void reallocate(std::size_t capacity) {  // seldom called, from very many places
        if (from_ == nullptr) from_ = &current_memory();
        if (capacity > SIZE_MAX / 2 / sizeof(T)) detail::out_of_memory();
        constexpr std::size_t alignment = alignof(T) > buffer_alignment ? alignof(T) : buffer_alignment;
        T* values = static_cast<T*>(from_->allocate(from_->context, capacity * sizeof(T), alignment));
        if (values == nullptr) detail::out_of_memory();
        if constexpr (std::is_trivially_copyable_v<T>) {
            if (size_ > 0) std::memcpy(static_cast<void*>(values), values_, size_ * sizeof(T));
        } else {
            for (std::size_t i = 0; i < size_; ++i) {
                construct(values + i, std::move(values_[i]));
                values_[i].~T();
            }
        }
        if (values_ != nullptr) from_->release(from_->context, values_, capacity_ * sizeof(T));
        values_ = values, capacity_ = capacity;
    }

    void release() {
        if (values_ == nullptr) return;
        destroy_from(0);
        from_->release(from_->context, values_, capacity_ * sizeof(T));
    }

    T* values_ = nullptr;
    std::size_t size_ = 0, capacity_ = 0;
    const memory* from_ = nullptr;
};

}  // namespace ldi
