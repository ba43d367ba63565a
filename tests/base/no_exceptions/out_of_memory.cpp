// A separate program, compiled with -fno-exceptions -fno-rtti. An allocation that fails in the caller's memory calls the error
// handler. The handler leaves by longjmp(), so that one run can refuse every allocation in turn. Exit code 0 means that each
// refused allocation called the handler.

#include <ldi/base/buffer.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/image.hpp>

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <string_view>

static_assert(LDI_HAS_EXCEPTIONS == 0, "compile this file with -fno-exceptions");

namespace {

std::jmp_buf place;
bool is_message_right = true;

void jump_out(const ldi::error_details& details) {
    is_message_right = is_message_right && details.code == ldi::error_code::out_of_memory &&
                       ldi::to_string(details) == "memory: expected enough memory, found too little (out of memory)";
    std::longjmp(place, 1);
}

/// Allocates from one block. A jump skips destructors, so the memory that they would release is reclaimed at once.
struct arena {
    static constexpr std::size_t capacity = std::size_t{1} << 20;
    alignas(64) std::byte bytes[capacity];
    std::size_t used = 0, calls = 0, most = 0;

    static void* allocate(void* context, std::size_t count, std::size_t alignment) {
        arena& self = *static_cast<arena*>(context);
        const std::size_t first = (self.used + alignment - 1) / alignment * alignment;
        if (self.calls++ >= self.most || alignment > 64 || count > capacity - first) return nullptr;
        self.used = first + count;
        return self.bytes + first;
    }
    static void release(void*, void*, std::size_t) {}
};

/// Whether the test's work succeeds if at most `calls` allocations are granted.
bool is_enough(std::size_t calls) {
    static arena own;
    static const ldi::memory source{&own, &arena::allocate, &arena::release};
    own.used = own.calls = 0, own.most = calls;
    const ldi::memory& before = ldi::current_memory();
    if (setjmp(place) != 0) {
        ldi::detail::memory_of_thread() = &before;  // the jump skips the scope's destructor
        return false;
    }
    const ldi::memory_scope scope(source);
    const ldi::image<float> picture(40, 50);
    const ldi::graph grid = ldi::make_grid(9, 9);
    const ldi::coarsened coarse = ldi::coarsen(grid, ldi::orphan_rule::adopt_nearest);
    return picture.size() == 2000 && coarse.topology.size() == 25;
}

}  // namespace

int main() {
    ldi::set_error_handler(jump_out);
    std::size_t refused = 0;
    while (refused < 1000 && !is_enough(refused)) ++refused;
    if (refused < 8 || refused == 1000 || !is_message_right) {
        std::fprintf(stderr, "%zu refused allocations called the handler; the message was %s\n", refused,
                     is_message_right ? "right" : "wrong");
        return 1;
    }
}
