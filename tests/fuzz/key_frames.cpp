// libFuzzer: any bytes decode to key frames or raise an error. At any time, key frames produce a view that the rasterizer can
// draw. Compile with clang++ -fsanitize=fuzzer,address,undefined.
#include <examples/photo3d/video.hpp>

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const int file = memfd_create("key_frames", 0);
    static const std::string path = "/proc/self/fd/" + std::to_string(file);
    if (ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) return 0;
    try {
        std::vector<ldi::key_frame> keys = ldi::examples::load_key_frames(path);
        const ldi::pinhole_camera camera{24, 16, 20.0F};
        const ldi::depth_range range{1, 10};
        for (ldi::key_frame& key : keys) key.position = ldi::within_motion(key.position, camera, range, 0.1F);
        std::vector<ldi::view> views;
        for (int i = 0; i <= 4; ++i)
            views.push_back(ldi::view_between(
                keys, camera, keys.front().time + 0.25F * static_cast<float>(i) * (keys.back().time - keys.front().time)));
        const float frame = ldi::frame_within(views, camera, range);
        if (!(frame >= 0 && frame <= 1)) std::abort();
    } catch (const ldi::error&) {
    }
    return 0;
}
