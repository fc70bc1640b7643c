#include "io/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "io/itk_volume.hpp"
#include "io/nifti.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

bool is_nifti(const fs::path& path) { return ending(path) == ".nii" || ending(path) == ".nii.gz"; }

Volume read_volume(const fs::path& path) {
#ifdef LIVETET_IMAGES
    if (!is_nifti(path)) return read_itk_volume(path);
#else
    if (is_image_name(path) && !is_nifti(path))
        fail("{}: this build of livetet has no image formats but NIfTI: .nii or .nii.gz", path.string());
#endif
    return nifti::read(path);
}

/// The volume's values as T, where `fits` allows each of them.
template <class T, class Stored, class Wrong, class Fits>
void convert_from(const Volume& volume, const fs::path& path, const char* expected, const Fits& fits,
                  std::vector<T>& values) {
    for (std::size_t n = 0; n < values.size(); ++n) {
        Stored stored;
        std::memcpy(&stored, volume.bytes.data() + n * sizeof(Stored), sizeof(Stored));
        const double value = volume.slope * static_cast<double>(stored) + volume.intercept;
        if (!fits(value)) {
            const std::size_t row = n / volume.size[0];
            throw Wrong(fmt::format("{}: voxel ({}, {}, {}) is {}, expected {}", path.string(), n % volume.size[0],
                                    row % volume.size[1], row / volume.size[1], value, expected));
        }
        values[n] = static_cast<T>(value);
    }
}

template <class T, class Wrong, class Fits>
Image<T> convert(const Volume& volume, const fs::path& path, const char* expected, const Fits& fits) {
    Image<T> image{volume.size, volume.ras_from_voxel, {}};
    image.values.resize(volume.bytes.size() / bytes_of(volume.type));
    const auto from = [&]<class Stored>(Stored) {
        convert_from<T, Stored, Wrong>(volume, path, expected, fits, image.values);
    };
    switch (volume.type) {
        case ScalarType::uint8:
            from(std::uint8_t{});
            break;
        case ScalarType::int8:
            from(std::int8_t{});
            break;
        case ScalarType::uint16:
            from(std::uint16_t{});
            break;
        case ScalarType::int16:
            from(std::int16_t{});
            break;
        case ScalarType::uint32:
            from(std::uint32_t{});
            break;
        case ScalarType::int32:
            from(std::int32_t{});
            break;
        case ScalarType::uint64:
            from(std::uint64_t{});
            break;
        case ScalarType::int64:
            from(std::int64_t{});
            break;
        case ScalarType::float32:
            from(float{});
            break;
        case ScalarType::float64:
            from(double{});
            break;
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

bool is_image_name(const fs::path& path) {
    const std::string end = ending(path);
    return is_nifti(path) || end == ".nrrd" || end == ".nhdr" || end == ".mha" || end == ".mhd";
}

GreyImage read_grey_image(const fs::path& path) {
    constexpr double most = std::numeric_limits<float>::max();
    return convert<float, Error>(read_volume(path), path, "a finite number",
                                 [](double v) { return std::abs(v) <= most; });  // false for NaN
}

LabelImage read_label_image(const fs::path& path) {
    constexpr double least = std::numeric_limits<std::int32_t>::min(), most = std::numeric_limits<std::int32_t>::max();
    return convert<std::int32_t, NotALabel>(read_volume(path), path, "a label, a whole number",
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
