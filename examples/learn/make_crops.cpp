// Writes the crops of the sample for the lessons that use only ldi's headers: globe and archway, each as .ppm and .pgm.
//
//     learn_make_crops FOLDER
#include "whole_sample.hpp"

#include <cmath>
#include <fstream>
#include <iostream>
#include <string>

namespace {

void save(const std::string& path, const learn::sample& crop) {
    const std::string size = std::to_string(crop.color.width()) + " " + std::to_string(crop.color.height()) + "\n";
    std::ofstream color(path + ".ppm", std::ios::binary), disparity(path + ".pgm", std::ios::binary);
    color << "P6\n" << size << "255\n";
    for (const std::uint8_t value : crop.color) color.put(static_cast<char>(value));
    disparity << "P5\n" << size << "65535\n";
    for (const float value : crop.disparity) {
        const long rounded = std::lround(value * 65535.0F);
        disparity.put(static_cast<char>(rounded >> 8)).put(static_cast<char>(rounded & 255));
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) {
        std::cerr << "usage: learn_make_crops FOLDER\n";
        return 1;
    }
    const std::string folder = arguments[1];
    save(folder + "/globe", learn::load_sample(learn::globe, 14));
    save(folder + "/archway", learn::load_sample(learn::archway, 2));
}
