// How good a picture is, in all measures of pictures at once.
#pragma once

#include "lpips.hpp"
#include "metrics.hpp"

#include <cmath>

namespace ldi_quality {

struct quality {
    double psnr = 0;            ///< in dB; 60 at most, which is what a picture that is right has
    double ssim = 0;            ///< mean over the pixels that count
    double lpips = unmeasured;  ///< the same

    /// For means.
    void add(const quality& other, double weight) {
        psnr += weight * other.psnr, ssim += weight * other.ssim;
        lpips = (std::isnan(lpips) ? 0 : lpips) + weight * other.lpips;
    }
};

inline quality measure(const picture& result, const picture& truth, const mask& where, const lpips_network& perceived) {
    return {psnr(result, truth, where), ssim(result, truth, where), perceived(result, truth, where)};
}

}  // namespace ldi_quality
