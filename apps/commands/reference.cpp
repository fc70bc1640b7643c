#include <fmt/format.h>

#include <filesystem>

#include "apps/commands/commands.hpp"
#include "apps/commands/json_schema.hpp"
#include "apps/commands/man_pages.hpp"
#include "apps/commands/option_text.hpp"
#include "apps/commands/shell_completion.hpp"
#include "apps/scene/scene.hpp"
#include "apps/study/study.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/markdown.hpp"
#include "tracking/motion_script.hpp"

namespace livetet {

namespace {

constexpr std::string_view generated =
    "<!-- Written by `livetet reference -o docs/reference`. Do not edit. -->\n";

std::string option_row(const CLI::Option& option) {
    std::string names;
    for (const std::string& name : names_of(option))
        names += fmt::format("{}`{}`", names.empty() ? "" : ", ", name);
    const std::string preset = option.get_default_str();
    return markdown_row({names, markdown_cell(value_text(option, "`")),
                         option.get_required() ? "required"
                         : preset.empty()      ? ""
                                               : fmt::format("`{}`", preset),
                         markdown_cell(meaning_text(option))});
}

void append_command(std::string& text, const CLI::App& command, const std::string& path) {
    text += fmt::format("\n## {}\n\n{}.\n", path, markdown_cell(command.get_description()));
    std::string rows;
    for (const CLI::Option* option : options_of(command)) rows += option_row(*option);
    if (!rows.empty())
        text += "\n| option | value | default | meaning |\n|---|---|---|---|\n" + rows;
    if (const std::string footer = own_footer(command); !footer.empty())
        text += fmt::format("\n```text\n{}\n```\n", footer);
    for (const CLI::App* inner : subcommands_of(command))
        append_command(text, *inner, path + " " + inner->get_name());
}

std::string commands_text(const CLI::App& app) {
    std::string text = fmt::format(
        "{}\n# Commands\n\n{}.\n\n{}\n\n`--help` after any command prints its part of this page.\n",
        generated, "Every command and option of `livetet`", markdown_cell(app.get_footer()));
    for (const CLI::App* command : subcommands_of(app))
        append_command(text, *command, "livetet " + command->get_name());
    return text;
}

/// NAME.md and NAME.schema.json of the keys of `file`, such as "a scene file".
template <class Table>
void write_keys(const std::filesystem::path& folder, const std::string& name,
                const std::string& file, std::string_view text) {
    const std::string title = "Keys of " + file;
    write_text_file(folder / (name + ".md"), fmt::format("{}\n# {}\n\n{}\n\n{}", generated, title,
                                                         text, markdown_of<Table>()));
    write_text_file(folder / (name + ".schema.json"),
                    schema_text<Table>(title, "Written by `livetet reference`. Do not edit."));
}

void write_pages(const CLI::App& app, const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    write_text_file(folder / "commands.md", commands_text(app));
    write_keys<Scene>(folder, "scene", "a scene file",
                      "A scene file is YAML. Lengths in keys that end in `_mm` are in mm; "
                      "places are in RAS. All other quantities are in SI units.\nFile names "
                      "are relative to the scene file. `livetet scene` prints the same keys.");
    write_keys<StudyOptions>(folder, "study", "a study file",
                             "A study file is YAML. File names are relative to it. `livetet "
                             "scene --study` prints the same keys.");
    write_keys<MotionScript>(folder, "script", "a simulated tracker's script",
                             "A script is YAML. Lengths are in mm. `livetet scene --script` "
                             "prints the same keys.");
}

void write_man_pages(const CLI::App& app, const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    for (const auto& [name, text] : man_pages(app)) write_text_file(folder / name, text);
}

void write_completions(const CLI::App& app, const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    write_text_file(folder / "livetet", bash_completion(app));
    write_text_file(folder / "_livetet", zsh_completion(app));
}

}  // namespace

void add_reference_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "reference",
        "Writes what describes the program: reference pages, JSON schemas of its files, manual "
        "pages, completions for shells");
    struct Folders {
        std::filesystem::path pages, man, completions;
    };
    auto folders = std::make_shared<Folders>();
#ifdef LIVETET_IMAGES  // the pages describe every command
    command->add_option("-o,--output", folders->pages,
                        "folder to write commands.md, and the keys of scenes, studies and scripts "
                        "to: scene.md and scene.schema.json (JSON Schema, for editors), ...");
#endif
    command->add_option("--man", folders->man,
                        "folder to write the manual pages to: livetet.1, livetet-mesh.1, ...");
    command->add_option("--completions", folders->completions,
                        "folder to write the shells' completions to: livetet for bash, _livetet "
                        "for zsh");
    command->callback([&app, folders] {
        const Folders& f = *folders;
        if (f.pages.empty() && f.man.empty() && f.completions.empty())
            fail("reference: nothing to write, expected a folder (livetet reference --help)");
        if (!f.pages.empty()) write_pages(app, f.pages);
        if (!f.man.empty()) write_man_pages(app, f.man);
        if (!f.completions.empty()) write_completions(app, f.completions);
    });
}

}  // namespace livetet
