// Quality of a picture in all measures together.
#pragma once

#include "lpips.hpp"
#include "metrics.hpp"

#include <cmath>

namespace ldi_quality {

struct quality {
    double psnr = 0;            ///< in dB; at most 60, the value of a perfect picture
    double ssim = 0;            ///< mean over the counted pixels
    double lpips = unmeasured;  ///< mean over the counted pixels

    /// Accumulates a weighted mean.
    void add(const quality& other, double weight) {
        psnr += weight * other.psnr, ssim += weight * other.ssim;
        lpips = (std::isnan(lpips) ? 0 : lpips) + weight * other.lpips;
    }
};

inline quality measure(const picture& result, const picture& truth, const mask& where, const lpips_network& perceived) {
    return {psnr(result, truth, where), ssim(result, truth, where), perceived(result, truth, where)};
}

}  // namespace ldi_quality
