#include "apps/scene/outputs.hpp"

#include "apps/scene/scene_files.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "io/dicom_name.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

/// Whether `path` is a DICOM file in the folder of, or that is, the DICOM input `read`.
bool is_slice_beside(const std::filesystem::path& path, const std::filesystem::path& read) {
    const auto dicom = has_dicom_mark(path) ? dicom_name(read) : std::nullopt;
    if (!dicom) return false;
    std::error_code ignored;
    const bool is_folder = std::filesystem::is_directory(dicom->place, ignored);
    const std::filesystem::path folder = is_folder ? dicom->place : dicom->place.parent_path();
    const auto or_here = [](const std::filesystem::path& p) { return p.empty() ? "." : p; };
    return std::filesystem::equivalent(or_here(folder), or_here(path.parent_path()), ignored);
}

}  // namespace

void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path,
                         const std::set<std::filesystem::path>& files) {
    for (const std::filesystem::path& file : files) {
        const std::optional<std::filesystem::path> voxels =
            path.empty() ? std::nullopt : named_voxel_file(file);
        if (same_file(path, image_place(file)) || (voxels && same_file(path, *voxels)) ||
            is_slice_beside(path, file))
            fail("{} {}: is read, or written besides, expected another file to write", name,
                 path.string());
    }
}

void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path,
                         const Scene& scene, const std::filesystem::path& scene_file) {
    std::set<std::filesystem::path> files = read_files(scene);
    files.insert(scene_file);
    for (const auto& [key, file] : written_files(scene)) files.insert(file);
    refuse_to_overwrite(name, path, files);
}

void expect_ending(std::string_view name, const std::filesystem::path& path,
                   std::string_view expected) {
    if (!path.empty() && !path.string().ends_with(expected))
        fail("{} {}: expected a name that ends in {}", name, path.string(), expected);
}

bool is_named_as_file(const std::filesystem::path& path) {
    static const std::set<std::string> kinds{
        ".avi",  ".csv",  ".doc",  ".docx", ".gif",  ".gz",  ".h5",  ".htm",
        ".html", ".jpeg", ".jpg",  ".json", ".md",   ".mkv", ".mov", ".mp4",
        ".mpg",  ".nii",  ".ogv",  ".pdf",  ".png",  ".svg", ".tex", ".tif",
        ".tiff", ".txt",  ".webm", ".xml",  ".yaml", ".yml", ".zip"};
    return kinds.contains(lower(path.extension().string()));
}

}  // namespace livetet
