#include "io/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "base/file.hpp"
#include "image/label_map.hpp"
#include "io/dicom_name.hpp"
#include "io/itk_volume.hpp"
#include "io/nifti.hpp"
#include "io/text.hpp"
#ifdef LIVETET_IMAGES
#include "io/dicom_volume.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// Whether it names a NRRD or MetaImage.
bool is_header_name(const fs::path& path) {
    const std::string end = ending(path);
    return end == ".nrrd" || end == ".nhdr" || end == ".mha" || end == ".mhd";
}

bool is_nifti(const fs::path& path) { return ending(path) == ".nii" || ending(path) == ".nii.gz"; }

/// Calls use(value) with a value of the scalar's C++ type.
template <class Use>
void of_type(ScalarType type, const Use& use) {
    switch (type) {
        case ScalarType::uint8:
            return use(std::uint8_t{});
        case ScalarType::int8:
            return use(std::int8_t{});
        case ScalarType::uint16:
            return use(std::uint16_t{});
        case ScalarType::int16:
            return use(std::int16_t{});
        case ScalarType::uint32:
            return use(std::uint32_t{});
        case ScalarType::int32:
            return use(std::int32_t{});
        case ScalarType::uint64:
            return use(std::uint64_t{});
        case ScalarType::int64:
            return use(std::int64_t{});
        case ScalarType::float32:
            return use(float{});
        case ScalarType::float64:
            return use(double{});
    }
}

/// The volume's values as T. `fits` decides whether a value is allowed.
template <class T, class Stored, class Wrong, class Fits>
void convert_from(const Volume& volume, const fs::path& path, const char* expected,
                  const Fits& fits, std::vector<T>& values) {
    for (std::size_t n = 0; n < values.size(); ++n) {
        Stored stored;
        std::memcpy(&stored, volume.bytes.data() + n * sizeof(Stored), sizeof(Stored));
        const double value = volume.slope * static_cast<double>(stored) + volume.intercept;
        if (!fits(value)) {
            const std::size_t row = n / volume.size[0];
            throw Wrong(fmt::format("{}: voxel ({}, {}, {}) is {}, expected {}", path.string(),
                                    n % volume.size[0], row % volume.size[1], row / volume.size[1],
                                    value, expected));
        }
        values[n] = static_cast<T>(value);
    }
}

template <class T, class Wrong, class Fits>
Image<T> convert(const Volume& volume, const fs::path& path, const char* expected,
                 const Fits& fits) {
    Image<T> image{volume.size, volume.ras_from_voxel, {}};
    image.values.resize(volume.bytes.size() / bytes_of(volume.type));
    of_type(volume.type, [&]<class Stored>(Stored) {
        convert_from<T, Stored, Wrong>(volume, path, expected, fits, image.values);
    });
    return image;
}

template <class T>
void check_image(const Image<T>& image, const fs::path& path) {
    const std::size_t expected =
        static_cast<std::size_t>(image.size[0]) * image.size[1] * image.size[2];
    if (image.values.size() != expected)
        fail("{}: the image has {} values, expected {} x {} x {}", path.string(),
             image.values.size(), image.size[0], image.size[1], image.size[2]);
}

template <class Stored>
std::span<const char> bytes_of_values(const std::vector<Stored>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Stored)};
}

template <class Stored, class T>
void write_as(ScalarType type, const fs::path& path, const Image<T>& image) {
    const std::vector<Stored> stored(image.values.begin(), image.values.end());
    nifti::write(path, {image.size, image.ras_from_voxel}, type, bytes_of_values(stored));
}

}  // namespace

bool is_image_name(const fs::path& path) {
    return is_nifti(path) || is_header_name(path) || dicom_name(path).has_value();
}

std::optional<std::string> content_digest(const fs::path& path) {
#ifdef LIVETET_IMAGES
    if (const auto dicom = dicom_name(path)) {
        std::string of_files = dicom->choice;
        for (const fs::path& file : dicom_files(*dicom)) of_files += digest(read_text_file(file));
        return of_files;
    }
#endif
    std::string of_file = digest(read_text_file(path));
#ifdef LIVETET_IMAGES
    if (is_header_name(path)) {
        const std::optional<fs::path> voxels = itk_voxel_file(path);
        if (!voxels) return {};
        if (*voxels != path) of_file += digest(read_text_file(*voxels));
    }
#endif
    return of_file;
}

std::optional<fs::path> named_voxel_file([[maybe_unused]] const fs::path& path) {
#ifdef LIVETET_IMAGES
    try {
        std::optional<fs::path> voxels = is_header_name(path) ? itk_voxel_file(path) : std::nullopt;
        if (voxels && *voxels != path) return voxels;
    } catch (const Error&) {  // the reader reports the error
    }
#endif
    return {};
}

Volume read_volume(const fs::path& path) {
#ifdef LIVETET_IMAGES
    if (const auto dicom = dicom_name(path)) return read_dicom_volume(*dicom);
    if (!is_nifti(path)) return read_itk_volume(path);
#else
    if (is_image_name(path) && !is_nifti(path))
        fail("{}: this build of livetet has no image formats but NIfTI: .nii or .nii.gz",
             path.string());
#endif
    return nifti::read(path);
}

GreyImage grey_image(const Volume& volume, const fs::path& path) {
    constexpr double max_value = std::numeric_limits<float>::max();
    return convert<float, Error>(volume, path, "a finite number", [](double v) {
        return std::abs(v) <= max_value;
    });  // false for NaN
}

GreyImage grey_image_with_gaps(const Volume& volume, const fs::path& path) {
    constexpr double max_value = std::numeric_limits<float>::max();
    return convert<float, Error>(volume, path, "a number of 32 bits", [](double v) {
        return std::abs(v) <= max_value || !std::isfinite(v);
    });
}

LabelImage label_image(const Volume& volume, const fs::path& path) {
    constexpr double min_value = std::numeric_limits<std::int32_t>::min(),
                     max_value = std::numeric_limits<std::int32_t>::max();
    return convert<std::int32_t, NotALabel>(
        volume, path, "a label, a whole number of 32 bits",
        [](double v) { return v >= min_value && v <= max_value && v == std::floor(v); });
}

GreyImage read_grey_image(const fs::path& path) { return grey_image(read_volume(path), path); }

LabelImage read_label_image(const fs::path& path) { return label_image(read_volume(path), path); }

LabelImage read_mask(const fs::path& path) {
    LabelImage mask = read_label_image(path);
    if (const std::string why = why_no_label_map(mask); !why.empty())
        fail("{}: looks like a grey image ({}), expected a mask: 0 where nothing is meant",
             path.string(), why);
    if (std::all_of(mask.values.begin(), mask.values.end(), [](std::int32_t v) { return v == 0; }))
        fail("{}: every voxel is 0, expected a mask of something", path.string());
    return mask;
}

void write_image(const fs::path& path, const GreyImage& image) {
    check_image(image, path);
    write_as<float>(ScalarType::float32, path, image);
}

void write_image(const fs::path& path, const GreyImage& image, ScalarType type) {
    check_image(image, path);
    of_type(type, [&]<class Stored>(Stored) {
        if constexpr (std::is_integral_v<Stored> && sizeof(Stored) <= 4) {
            constexpr double min_value = std::numeric_limits<Stored>::min(),
                             max_value = std::numeric_limits<Stored>::max();
            std::vector<Stored> stored;
            stored.reserve(image.values.size());
            for (const double v : image.values)
                stored.push_back(
                    static_cast<Stored>(std::clamp(std::round(v), min_value, max_value)));
            nifti::write(path, {image.size, image.ras_from_voxel}, type, bytes_of_values(stored));
        } else {
            write_as<float>(ScalarType::float32, path, image);
        }
    });
}

void write_displacement_field(const fs::path& path, const Image<Eigen::Vector3f>& field) {
    check_image(field, path);
    constexpr float mm = 1e3, lps_from_ras[] = {-1, -1, 1};
    std::vector<float> planes;
    planes.reserve(3 * field.values.size());
    for (int d = 0; d < 3; ++d)
        for (const Eigen::Vector3f& v : field.values)
            planes.push_back(mm * lps_from_ras[d] * v[d] + 0.0F);  // no negative zero
    nifti::write(path, {field.size, field.ras_from_voxel}, ScalarType::float32,
                 bytes_of_values(planes), nifti::Values::vectors);
}

void write_image(const fs::path& path, const LabelImage& image) {
    check_image(image, path);
    if (image.values.empty()) fail("{}: the image has no voxels", path.string());
    const auto [min_value, max_value] =
        std::minmax_element(image.values.begin(), image.values.end());
    if (*min_value >= 0 && *max_value <= 255)
        write_as<std::uint8_t>(ScalarType::uint8, path, image);
    else if (*min_value >= -32768 && *max_value <= 32767)
        write_as<std::int16_t>(ScalarType::int16, path, image);
    else
        write_as<std::int32_t>(ScalarType::int32, path, image);
}

}  // namespace livetet
