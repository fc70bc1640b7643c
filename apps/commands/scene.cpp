#include <fmt/format.h>

#include <nlohmann/json.hpp>

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

namespace {

nlohmann::json json_of(const YAML::Node& node) {
    nlohmann::json json;
    if (node.IsMap()) {
        for (const auto& entry : node) json[entry.first.as<std::string>()] = json_of(entry.second);
    } else if (node.IsSequence()) {
        json = nlohmann::json::array();
        for (const auto& entry : node) json.push_back(json_of(entry));
    } else if (node.IsScalar()) {
        const bool quoted = node.Tag() == "!";
        long long whole = 0;
        double number = 0;
        bool flag = false;
        if (!quoted && YAML::convert<long long>::decode(node, whole))
            json = whole;
        else if (!quoted && YAML::convert<double>::decode(node, number))
            json = number;
        else if (!quoted && YAML::convert<bool>::decode(node, flag))
            json = flag;
        else
            json = node.Scalar();
    }
    return json;
}

/// A scene for other programs: all keys with their defaults, and whole paths.
void print_scene(const std::filesystem::path& file) {
    const nlohmann::json json = json_of(YAML::Load(to_yaml(load_scene(file))));
    fmt::print("{}\n", json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace

void add_scene_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "scene",
        "Prints every key of a scene file: default, unit, meaning, limits; or one scene as JSON");
    auto script = std::make_shared<bool>(false), study = std::make_shared<bool>(false);
    auto file = std::make_shared<std::filesystem::path>();
    CLI::Option* scene = command->add_option(
        "scene", *file,
        "a scene file (YAML): print it as JSON, with all defaults and whole paths, for other "
        "programs");
    command->add_flag("--script", *script, "print those of a simulated tracker's script instead")
        ->excludes(scene);
    command->add_flag("--study", *study, "print those of a study file instead")->excludes(scene);
    command->callback([script, study, file] {
        if (!file->empty())
            print_scene(*file);
        else if (*study)
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
