// Peak memory during each stage of make_photo3d(), measured with counted_memory.
#pragma once

#include "tests/support/counted_memory.hpp"

#include <ldi/base/progress.hpp>

#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::testing {

class stage_peaks {
public:
    struct stage {
        std::string name;
        std::size_t peak, allocated;  ///< bytes: the peak, and the sum of all requested blocks
    };
    std::vector<stage> stages;

    explicit stage_peaks(counted_memory& counted) : counted_(counted) {}

    progress_listener listener() { return {this, &on_progress, nullptr}; }

private:
    static void on_progress(void* user, std::string_view name, float) {
        stage_peaks& self = *static_cast<stage_peaks*>(user);
        const std::lock_guard lock(self.counted_.mutex);
        if (self.stages.empty() || self.stages.back().name != name) {
            self.stages.push_back({std::string(name), 0, 0});
            self.counted_.peak = self.counted_.bytes;
            self.allocated_before_ = self.counted_.allocated;
        }
        self.stages.back().peak = self.counted_.peak;
        self.stages.back().allocated = self.counted_.allocated - self.allocated_before_;
    }

    counted_memory& counted_;
    std::size_t allocated_before_ = 0;
};

}  // namespace ldi::testing
