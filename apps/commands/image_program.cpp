#include "apps/commands/image_program.hpp"

#ifndef LIVETET_IMAGES
#include "apps/commands/companion_program.hpp"
#include "apps/scene/scene_files.hpp"
#include "base/error.hpp"
#endif

namespace livetet {

void run_image_program_for([[maybe_unused]] const std::filesystem::path& scene) {
#ifndef LIVETET_IMAGES
    const std::filesystem::path program = program_folder() / "livetet-full";
    std::error_code none;
    if (!std::filesystem::exists(program, none)) return;
    try {
        if (!needs_images(load_scene(scene))) return;
    } catch (const Error&) {
        return;
    }
    run_instead(program);
#endif
}

}  // namespace livetet
