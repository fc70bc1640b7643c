#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "apps/commands/commands.hpp"
#include "apps/scene/scene.hpp"
#include "apps/study/study.hpp"
#include "base/file.hpp"
#include "config/markdown.hpp"
#include "tracking/motion_script.hpp"

namespace livetet {

namespace {

constexpr std::string_view generated =
    "<!-- Written by `livetet reference -o docs/reference`. Do not edit. -->\n";

/// The values that an option takes, from CLI11's "INT:INT in [1 - 100]", "TEXT:{a,b}" or
/// "ENUM:value in {b->1,a->0} OR {1,0}".
std::string value_text(const CLI::Option& option) {
    if (option.get_type_size() == 0) return "";  // a flag
    const std::string type = option.get_type_name();
    const std::size_t colon = type.find(':');
    const std::string base = type.substr(0, colon);
    const bool whole = base.find("INT") != base.npos;
    if (!whole && base != "FLOAT" && base != "TEXT" && base != "ENUM") return type;
    std::string text = base == "TEXT" ? "text" : whole ? "whole number" : "number";
    const auto between = [&](char open, char close) {
        const std::size_t begin = type.find(open) + 1;
        return type.substr(begin, type.find(close, begin) - begin);
    };
    if (type.find('{') != type.npos) {
        text.clear();
        for (std::string name : CLI::detail::split(between('{', '}'), ',')) {
            name = name.substr(0, name.find("->"));
            text += (text.empty() ? "`" : ", `") + name + "`";
        }
    } else if (type.find('[') != type.npos) {
        const std::string range = between('[', ']');
        const std::size_t dash = range.find(" - ");
        text += fmt::format(", {} to {}", range.substr(0, dash), range.substr(dash + 3));
    } else if (type.find("NONNEGATIVE") != type.npos) {
        text += ", at least 0";
    } else if (type.find("POSITIVE") != type.npos) {
        text += ", greater than 0";
    } else if (colon != type.npos) {
        text += ", " + type.substr(colon + 1);
    }
    const int items = option.get_items_expected_max();
    if (option.get_type_size_min() > 1 && option.get_type_size_max() == option.get_type_size_min())
        return fmt::format("{} x {}", option.get_type_size_max(), text);
    return items > 1 ? text + "; several" : text;
}

/// "; not with `--a`, `--b`", sorted, since CLI11 keeps a set of pointers.
std::string others_text(std::string_view relation, const std::set<CLI::Option*>& others) {
    std::vector<std::string> names;
    for (const CLI::Option* other : others) names.push_back(fmt::format("`{}`", other->get_name()));
    std::sort(names.begin(), names.end());
    return names.empty() ? "" : fmt::format("; {} {}", relation, fmt::join(names, ", "));
}

std::string option_row(const CLI::Option& option) {
    const bool positional = !option.nonpositional();
    std::string name = positional ? fmt::format("`{}`", option.get_name(true))
                                  : fmt::format("`{}`", option.get_name(false, true));
    if (const std::size_t comma = name.find(','); comma != name.npos)
        name.replace(comma, 1, "`, `");
    const std::string preset = option.get_default_str();
    return markdown_row({name, markdown_cell(value_text(option)),
                         option.get_required() ? "required"
                         : preset.empty()      ? ""
                                               : fmt::format("`{}`", preset),
                         markdown_cell(option.get_description()) +
                             others_text("not with", option.get_excludes()) +
                             others_text("only with", option.get_needs())});
}

void append_command(std::string& text, const CLI::App& command, const std::string& path) {
    text += fmt::format("\n## {}\n\n{}.\n", path, markdown_cell(command.get_description()));
    std::string rows;
    for (const bool positional : {true, false})
        for (const CLI::Option* option : command.get_options())
            if (option != command.get_help_ptr() && option->nonpositional() != positional)
                rows += option_row(*option);
    if (!rows.empty())
        text += "\n| option | value | default | meaning |\n|---|---|---|---|\n" + rows;
    // CLI11 hands a command's footer down to its sub-commands.
    if (command.get_footer() != command.get_parent()->get_footer())
        text += fmt::format("\n```text\n{}\n```\n", command.get_footer());
    for (const CLI::App* inner : command.get_subcommands([](const CLI::App*) { return true; }))
        append_command(text, *inner, path + " " + inner->get_name());
}

std::string commands_text(const CLI::App& app) {
    std::string text = fmt::format(
        "{}\n# Commands\n\n{}.\n\n{}\n\n`--help` after any command prints its part of this page.\n",
        generated, "Every command and option of `livetet`", markdown_cell(app.get_footer()));
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        append_command(text, *command, "livetet " + command->get_name());
    return text;
}

template <class Table>
void write_keys(const std::filesystem::path& path, std::string_view title, std::string_view text) {
    write_text_file(
        path, fmt::format("{}\n# {}\n\n{}\n\n{}", generated, title, text, markdown_of<Table>()));
}

}  // namespace

void add_reference_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "reference", "Writes the reference pages: commands, keys of scenes, studies and scripts");
    auto folder = std::make_shared<std::filesystem::path>();
    command
        ->add_option("-o,--output", *folder,
                     "folder to write commands.md, scene.md, study.md "
                     "and script.md to")
        ->required();
    command->callback([&app, folder] {
        std::filesystem::create_directories(*folder);
        write_text_file(*folder / "commands.md", commands_text(app));
        write_keys<Scene>(*folder / "scene.md", "Keys of a scene file",
                          "A scene file is YAML. Lengths in keys that end in `_mm` are in mm; "
                          "places are in RAS. All other quantities are in SI units.\nFile names "
                          "are relative to the scene file. `livetet scene` prints the same keys.");
        write_keys<StudyOptions>(*folder / "study.md", "Keys of a study file",
                                 "A study file is YAML. File names are relative to it. `livetet "
                                 "scene --study` prints the same keys.");
        write_keys<MotionScript>(*folder / "script.md", "Keys of a simulated tracker's script",
                                 "A script is YAML. Lengths are in mm. `livetet scene --script` "
                                 "prints the same keys.");
    });
}

}  // namespace livetet
