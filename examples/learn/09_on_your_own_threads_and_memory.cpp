// Makes a complete 3D photo in memory, as an engine would: from pixels to the bytes of a GLB file, on the engine's threads, in
// the engine's memory, within its budget. Writes the bytes to a file only at the end, to show the result.
#include "whole_sample.hpp"

#include <ldi/formats/glb.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/file.hpp>
#include <ldi/photo3d.hpp>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <thread>

/// Your job system: ldi requires only these two members.
struct engine_jobs {
    std::size_t concurrency() const { return 2; }
    void run(std::size_t count, void (*function)(void*, std::size_t), void* data) const {
        std::atomic<std::size_t> next{0};
        const auto work = [&] {
            for (std::size_t i; (i = next++) < count;) function(data, i);
        };
        std::thread helper(work);
        work();
        helper.join();
    }
};

/// Your allocator, with a budget. If it refuses memory, ldi throws std::bad_alloc and releases the memory that it used.
struct engine_heap {
    std::atomic<std::size_t> used{0}, peak{0}, budget{256 << 20};

    static void* allocate(void* context, std::size_t bytes, std::size_t alignment) {
        engine_heap& heap = *static_cast<engine_heap*>(context);
        if ((heap.used += bytes) > heap.budget) return heap.used -= bytes, nullptr;
        for (std::size_t peak = heap.peak; peak < heap.used && !heap.peak.compare_exchange_weak(peak, heap.used);) continue;
        return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    }
    static void release(void* context, void* block, std::size_t bytes) {
        static_cast<engine_heap*>(context)->used -= bytes;
        std::free(block);
    }
};

int main() {
    const learn::sample photo = learn::load_sample(learn::everything, 4);
    engine_heap heap;
    const ldi::memory memory{&heap, engine_heap::allocate, engine_heap::release};
    const ldi::memory_scope scope(memory);
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;  // the sample's disparity contains 0, so it cannot be 1 / distance
    const ldi::photo3d made =
        ldi::make_photo3d(photo.color, ldi::given_disparity{photo.disparity}, ldi::diffusion_inpainter{}, options, engine_jobs{});
    const ldi::buffer<std::byte> file = ldi::encode_glb(
        made.mesh, made.atlas.color, {.camera = made.facts.camera, .motion = made.facts.motion, .range = made.facts.range});
    std::printf("%zu triangles in %zu bytes of GLB; at most %zu kB of the engine's memory at a time\n",
                made.mesh.triangle_count(), file.size(), heap.peak / 1000);
    ldi::write_file("09_on_your_own_threads_and_memory.glb", file);
}
