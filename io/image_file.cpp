#include "io/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/error.hpp"
#include "io/nifti.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// The volume's values as T, where `fits` allows each of them.
template <class T, class Fits>
Image<T> convert(const nifti::Volume& volume, const fs::path& path, const char* expected, const Fits& fits) {
    Image<T> image{volume.size, volume.ras_from_voxel, {}};
    image.values.resize(volume.values.size());
    for (std::size_t n = 0; n < volume.values.size(); ++n) {
        const double value = volume.values[n];
        if (!fits(value)) {
            const std::size_t row = n / image.size[0];
            fail("{}: voxel ({}, {}, {}) is {}, expected {}", path.string(), n % image.size[0], row % image.size[1],
                 row / image.size[1], value, expected);
        }
        image.values[n] = static_cast<T>(value);
    }
    return image;
}

template <class T>
void check_image(const Image<T>& image, const fs::path& path) {
    const std::size_t expected = static_cast<std::size_t>(image.size[0]) * image.size[1] * image.size[2];
    if (image.values.size() != expected)
        fail("{}: the image has {} values, expected {} x {} x {}", path.string(), image.values.size(), image.size[0],
             image.size[1], image.size[2]);
}

template <class Stored, class T>
void write_as(nifti::VoxelType type, const fs::path& path, const Image<T>& image) {
    const std::vector<Stored> stored(image.values.begin(), image.values.end());
    nifti::write(path, image.size, image.ras_from_voxel, type,
                 {reinterpret_cast<const char*>(stored.data()), stored.size() * sizeof(Stored)});
}

}  // namespace

GreyImage read_grey_image(const fs::path& path) {
    constexpr double most = std::numeric_limits<float>::max();
    return convert<float>(nifti::read(path), path, "a finite number",
                          [](double v) { return std::abs(v) <= most; });  // false for NaN
}

LabelImage read_label_image(const fs::path& path) {
    constexpr double least = std::numeric_limits<std::int32_t>::min(), most = std::numeric_limits<std::int32_t>::max();
    return convert<std::int32_t>(nifti::read(path), path, "a label, a whole number",
                                 [](double v) { return v >= least && v <= most && v == std::floor(v); });
}

void write_image(const fs::path& path, const GreyImage& image) {
    check_image(image, path);
    write_as<float>(nifti::VoxelType::float32, path, image);
}

void write_image(const fs::path& path, const LabelImage& image) {
    check_image(image, path);
    if (image.values.empty()) fail("{}: the image has no voxels", path.string());
    const auto [least, most] = std::minmax_element(image.values.begin(), image.values.end());
    if (*least >= 0 && *most <= 255)
        write_as<std::uint8_t>(nifti::VoxelType::uint8, path, image);
    else if (*least >= -32768 && *most <= 32767)
        write_as<std::int16_t>(nifti::VoxelType::int16, path, image);
    else
        write_as<std::int32_t>(nifti::VoxelType::int32, path, image);
}

}  // namespace livetet
