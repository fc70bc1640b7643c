#include <fmt/format.h>

#include "apps/commands/commands.hpp"
#include "apps/scene/scene.hpp"
#include "apps/study/study.hpp"
#include "config/yaml.hpp"
#include "tracking/motion_script.hpp"

namespace livetet {

std::vector<std::string> petsc_arguments(const CLI::App& command) {
    const std::vector<std::string> extras = command.remaining();
    for (std::size_t i = 0; i < extras.size(); ++i) {
        const bool option = extras[i].size() > 1 && extras[i][0] == '-';
        if (extras[i].starts_with("--"))
            fail("unknown option {} (livetet {} --help lists them)", extras[i], command.get_name());
        if (i == 0 && !option)
            fail("unexpected argument {} (livetet {} --help explains)", extras[i],
                 command.get_name());
    }
    return extras;
}

void add_scene_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "scene", "Prints every key of a scene file: default, unit, meaning, limits");
    auto script = std::make_shared<bool>(false), study = std::make_shared<bool>(false);
    command->add_flag("--script", *script, "print those of a simulated tracker's script instead");
    command->add_flag("--study", *study, "print those of a study file instead");
    command->callback([script, study] {
        if (*study)
            fmt::print(
                "# Keys of a study file (YAML) with their defaults. Files are looked for relative "
                "to it.\n{}",
                reference_of<StudyOptions>());
        else if (*script)
            fmt::print(
                "# Keys of a simulated tracker's script (YAML) with their defaults. Lengths are in "
                "mm.\n{}",
                reference_of<MotionScript>());
        else
            fmt::print(
                "# Keys of a scene file (YAML) with their defaults. Lengths that end in _mm are in "
                "mm, RAS; all else "
                "SI.\n# Files are looked for relative to the scene file.\n{}",
                reference_of<Scene>());
    });
}

}  // namespace livetet
