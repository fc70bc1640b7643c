#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "image/image_sampler.hpp"

namespace livetet {

/// The options of `livetet warp`. Names of outputs may hold words in braces (see output_name).
struct WarpArguments {
    std::vector<std::filesystem::path> results;
    std::filesystem::path output, image, grid, inverse_field, forward_field, registration, json;
    std::optional<std::int64_t> frame;  ///< counted from 1
    std::string frames;                 ///< see chosen_frames
    std::optional<double> time_s, empty, rind_mm;
    std::optional<Interpolation> interpolation;
    int threads = 0;
};

/// Largest thickness of the layer about the body that moves with it.
inline constexpr double max_rind_mm = 1000;

/// By the name that users give.
inline const std::map<std::string, Interpolation> interpolations{
    {"nearest", Interpolation::nearest},
    {"linear", Interpolation::linear},
    {"cubic", Interpolation::cubic}};

/// The files that a frame is written to; those that are empty are not written.
struct WarpFiles {
    std::filesystem::path image;  ///< .nii, .nii.gz, or the folder of a DICOM series
    std::filesystem::path inverse_field, forward_field, registration;
};

/// A frame to write.
struct WarpJob {
    std::size_t result = 0;  ///< of the arguments
    std::size_t frame = 0;   ///< counted from 0
    WarpFiles files;
};

/// Whether an output is the folder of a DICOM series: it ends in '/', is a folder, or has no
/// extension.
bool is_series_folder(const std::filesystem::path& output);

/// What is written, result by result. Throws Error, before anything is written, if a number is out
/// of its range, a result cannot be read or has no such frame, or if two outputs have one name, an
/// output is read, has no known ending or cannot be written.
std::vector<WarpJob> plan_warp(const WarpArguments& arguments);

}  // namespace livetet
