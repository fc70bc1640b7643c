#include "apps/scene/scene_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "io/dicom_name.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

namespace livetet {

std::set<std::filesystem::path> mesh_files(const Scene& scene) {
    std::set<std::filesystem::path> files{scene.mesh.file};
    const auto add_masks = [&](const auto& list) {
        for (const SelectionOptions& s : list)
            if (s.mask) files.insert(*s.mask);
    };
    add_masks(scene.fix);
    add_masks(scene.drive);
    add_masks(scene.loads);
    for (const CutOptions& cut : scene.cuts)
        if (!cut.file.empty()) files.insert(cut.file);
    return files;
}

std::set<std::filesystem::path> read_files(const Scene& scene) {
    std::set<std::filesystem::path> files = mesh_files(scene);
    files.insert(scene.image);
    const auto add_targets = [&](const std::vector<TargetOptions>& targets) {
        for (const TargetOptions& target : targets)
            files.insert(target.mask.value_or(target.points));
    };
    if (scene.deform) {
        for (const ForceZoneOptions& zone : scene.deform->forces)
            if (zone.mask) files.insert(*zone.mask);
        add_targets(scene.deform->targets);
        files.insert({scene.deform->surface_points, scene.deform->landmarks,
                      scene.deform->landmarks_at_rest});
        files.insert(scene.deform->later_points.begin(), scene.deform->later_points.end());
    }
    if (scene.track) {
        files.insert({scene.track->source, scene.track->registration, scene.track->start});
        for (const ToolOptions& tool : scene.track->tools) files.insert(tool.tip);
        add_targets(scene.track->targets);
    }
    if (scene.probes) files.insert(scene.probes->points);
    return files;
}

bool needs_images(const Scene& scene) {
    const std::string end = ending(scene.mesh.file);
    if (end != ".h5" && (end != ".msh" || scene.mesh.levels > 1)) return true;
    if (std::ranges::any_of(scene.cuts, [](const CutOptions& c) { return !c.file.empty(); }))
        return true;
    const std::set<std::filesystem::path> files = read_files(scene);
    return std::ranges::any_of(files, [](const std::filesystem::path& file) {
        const bool is_nifti = ending(file) == ".nii" || ending(file) == ".nii.gz";
        return !is_nifti && is_image_name(file);
    });
}

std::string stamps_of(const std::set<std::filesystem::path>& files) {
    std::string text;
    for (const std::filesystem::path& path : files) {
        std::error_code error;
        const std::filesystem::path place = image_place(path);
        const bool is_folder = std::filesystem::is_directory(place, error);
        const auto size = is_folder ? 0 : std::filesystem::file_size(place, error);
        if (error) {
            text += fmt::format("{}: missing\n", path.string());
            continue;
        }
        const std::optional<std::string> contents = content_digest(path);
        if (!contents)
            fail(
                "{}: its voxels are in several files, expected one file, whose changes can be "
                "detected",
                path.string());
        text += fmt::format("{}: {}, digest {}\n", path.string(),
                            is_folder ? "folder" : fmt::format("{} bytes", size), *contents);
    }
    return text;
}

std::vector<std::pair<const char*, std::filesystem::path>> written_files(const Scene& scene) {
    std::vector<std::pair<const char*, std::filesystem::path>> files;
    if (scene.output.has_file()) {
        files.emplace_back("output.file", scene.output.file);
        files.emplace_back("output.file's XDMF",
                           std::filesystem::path(scene.output.file).replace_extension(".xdmf"));
    }
    if (scene.probes) files.emplace_back("probes.displacements", scene.probes->displacements);
    return files;
}

}  // namespace livetet
