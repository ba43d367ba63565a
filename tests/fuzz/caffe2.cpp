// libFuzzer driver for the reader of Caffe2 networks. The input is a list of edits to a small valid network, so the edited
// network passes the outer layers of the format without a corpus. The driver reads, builds and runs this network. The only valid
// failure is ldi::error.
//
//     clang++ -std=c++20 -g -O1 -fsanitize=fuzzer,address,undefined -Iinclude -I. tests/fuzz/caffe2.cpp -o fuzz_caffe2
//     ./fuzz_caffe2 -max_len=64 -max_total_time=60
#include <ldi/io/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <tests/support/caffe2_files.hpp>

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const ldi::testing::caffe2_files sound = ldi::testing::small_network();
    const ldi::testing::caffe2_files files = ldi::testing::damaged(sound, data, size);
    try {
        const ldi::tiefenrausch network(ldi::read_caffe2(files.network, files.weights));
        ldi::serial_executor threads;
        network.levels(ldi::image<std::uint8_t>(32, 32, 3, 100), threads);
    } catch (const ldi::error&) {
    }
    return 0;
}
