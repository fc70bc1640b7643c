#include "apps/scene_files.hpp"

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
    return files;
}

}  // namespace livetet
