#pragma once

#include <filesystem>

namespace livetet {

/// In the program without images: if the scene needs images (see needs_images), runs `livetet-full`
/// in place of this program. To be called before MPI is initialised. Returns if the scene needs
/// none or cannot be read, which the command then reports, and in a build that has no such program.
void run_image_program_for(const std::filesystem::path& scene);

}  // namespace livetet
