// The published depth network on a real photo at 384 x 288, for node: tiefenrausch.js RUNS. Prints the median and the minimum in
// milliseconds, and the number of pixels that differ from the published result.
#include <ldi/io/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <tests/support/npy.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

int main(int count, char** arguments) {
    using std::chrono::steady_clock;
    const std::size_t runs = count > 1 ? std::strtoul(arguments[1], nullptr, 10) : 9;
    const std::string folder = std::string(LDI_SHARED_DIR) + "/tiefenrausch/";
    const ldi::tiefenrausch network(ldi::read_caffe2(ldi::testing::read_bytes(folder + "model/tiefenrausch.pb"),
                                                     ldi::testing::read_bytes(folder + "model/tiefenrausch_init.pb")));
    const auto photo = ldi::testing::read_npy<std::uint8_t>(folder + "golden/columns_384x288_rgb.npy"),
               expected = ldi::testing::read_npy<std::uint8_t>(folder + "golden/columns_384x288_log_disparity_u8.npy");
    ldi::image<std::uint8_t> rgb(384, 288, 3);
    std::copy(photo.values.begin(), photo.values.end(), rgb.data());

    ldi::serial_executor serial;
    ldi::buffer<double> times;
    std::size_t different = 0;
    for (std::size_t i = 0; i < runs + 2; ++i) {  // two to warm up
        const auto start = steady_clock::now();
        const ldi::image<std::uint8_t> found = network.levels(rgb, serial);
        const std::chrono::duration<double, std::milli> time = steady_clock::now() - start;
        if (i >= 2) times.push_back(time.count());
        different = 0;
        for (std::size_t p = 0; p < found.size(); ++p) different += found.data()[p] != expected.values[p];
    }
    std::sort(times.begin(), times.end());
    std::printf("median %.2f minimum %.2f, %zu pixels differ, %s\n", times[times.size() / 2], times[0], different,
                std::string(to_string(network.target())).c_str());
    return different == 0 ? 0 : 1;
}
