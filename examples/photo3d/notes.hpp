// Notes to the user about a converted photo. A run over one photo prints them; a batch adds them to the photo's line of JSON.
#pragma once

#include "arguments.hpp"

#include <ldi/photo3d.hpp>

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace ldi::examples {

/// Lists unusual facts about a converted photo that matter to the user. Each note has one or two sentences. Most photos have
/// none.
///
/// hidden   number of pixels behind the photo
/// depth    source of the depth
/// refused  reason why a depth map inside or beside the photo could not be used; empty: none was refused
inline std::vector<std::string> notes_on(const photo3d& made, std::size_t hidden, const arguments& a, const std::string& depth,
                                         const std::string& refused) {
    std::vector<std::string> notes;
    if (!refused.empty()) notes.push_back("the depth map was not used: " + refused);
    if (hidden == 0 && made.dropped_sides == 0)
        notes.push_back("its depth (" + depth +
                        ") contains no occlusions, so the 3D photo is a single sheet. Try another --depth or --depth-model.");
    if (made.dropped_sides > 0) {
        std::size_t sides = made.dropped_sides;
        for (const discontinuity_curve& curve : made.curves) sides += curve.sides.size();
        notes.push_back("the shortest silhouettes, " + std::to_string((100 * made.dropped_sides + sides - 1) / sides) +
                        " % of the total length, were dropped, so surfaces stretch across them: its depth (" + depth +
                        ") has more silhouettes than the limit. A smoother depth map has fewer.");
    }
    if (made.facts.motion < a.motion) {
        char motions[80];
        std::snprintf(motions, sizeof motions,
                      "the parallax is at most %.3f of the long side, not %.3f: ", double{made.facts.motion}, double{a.motion});
        notes.push_back(motions + (a.is_paper ? std::string("--preset paper grows hidden surfaces by at most 50 pixels.")
                                              : "its depth (" + depth +
                                                    ") needs more hidden surfaces than the limit. A smoother depth map needs "
                                                    "fewer."));
    }
    return notes;
}

}  // namespace ldi::examples
