#include "apps/commands/shell_completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "apps/commands/option_text.hpp"

namespace livetet {

namespace {

/// visit(path, command) of the program and of every command below it; path: "livetet mesh".
void visit_commands(const CLI::App& command, const std::string& path,
                    const std::function<void(const std::string&, const CLI::App&)>& visit) {
    visit(path, command);
    for (const CLI::App* inner : subcommands_of(command))
        visit_commands(*inner, path + " " + inner->get_name(), visit);
}

/// "-h", "--help" and the names of all options that have a dash.
std::vector<std::string> option_names(const CLI::App& command) {
    std::vector<std::string> names = names_of(*command.get_help_ptr());
    for (const CLI::Option* option : options_of(command))
        if (option->nonpositional())
            for (std::string& name : names_of(*option)) names.push_back(std::move(name));
    return names;
}

constexpr std::string_view bash_script = R"(# Completion of livetet for bash.
# Written by `livetet reference --completions`.
_livetet() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}}
    local command=livetet words= options= commands= i
    COMPREPLY=()
    if [[ $current == = ]]; then # --option=
        current=
    elif [[ $before == = ]]; then
        before=${{COMP_WORDS[COMP_CWORD - 2]}}
    fi
    for ((i = 1; i < COMP_CWORD; i++)); do
        case "$command ${{COMP_WORDS[i]}}" in
            {}) command+=" ${{COMP_WORDS[i]}}" ;;
        esac
    done
    case "$command $before" in
{}    esac
    case $command in
{}    esac
    if [[ $current == -* ]]; then
        words=$options
    elif [[ -z $words ]]; then
        words=$commands
    fi
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o bashdefault -o default -F _livetet livetet
)";

/// Text within single quotes of zsh.
std::string zsh_quoted(const std::string& text) {
    std::string quoted;
    for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
    return "'" + quoted + "'";
}

/// The first part of a description, for a list, without what would end it there.
std::string zsh_meaning(const std::string& description) {
    std::string text;
    for (const char c : description.substr(0, description.find(';'))) {
        if (c == '[' || c == ']' || c == '\\' || c == ':') text += '\\';
        text += c == '\n' ? ' ' : c;
    }
    return text;
}

/// ":NAME:ACTION" for each value that an option takes.
std::string zsh_values(const CLI::Option& option) {
    if (is_flag(option)) return "";
    const std::vector<std::string> choices = choices_of(option);
    std::string name = names_of(option).back();
    name.erase(0, name.find_first_not_of('-'));
    const std::string action = !choices.empty()     ? fmt::format("({})", fmt::join(choices, " "))
                               : takes_text(option) ? "_files"
                                                    : " ";
    std::string values;
    for (int i = 0; i < option.get_type_size_min(); ++i) values += ":" + name + ":" + action;
    return values;
}

/// An argument of _arguments.
std::string zsh_option(const CLI::Option& option) {
    const bool several = option.get_items_expected_max() > option.get_type_size_max();
    if (!option.nonpositional()) return zsh_quoted((several ? "*" : "") + zsh_values(option));
    const std::string rest =
        fmt::format("[{}]{}", zsh_meaning(option.get_description()), zsh_values(option));
    const std::vector<std::string> names = names_of(option);
    const std::string excluded =
        several ? "*" : fmt::format("({})", fmt::join(names, " "));  // once, or more often
    std::string arguments;
    for (const std::string& name : names) {
        const bool assigned = !is_flag(option) && name.starts_with("--");
        arguments += (arguments.empty() ? "" : " ") +
                     zsh_quoted(excluded + name + (assigned ? "=" : "") + rest);
    }
    return arguments;
}

std::string zsh_function(std::string path) {
    std::replace(path.begin(), path.end(), ' ', '_');
    std::replace(path.begin(), path.end(), '-', '_');
    return "_" + path;
}

/// The function that completes the arguments of one command.
std::string zsh_function_text(const std::string& path, const CLI::App& command) {
    std::string arguments = "    _arguments -C " + zsh_option(*command.get_help_ptr());
    for (const CLI::Option* option : options_of(command))
        arguments += " \\\n        " + zsh_option(*option);
    std::string text = fmt::format(
        "{}() {{\n    local curcontext=$curcontext state line\n    typeset -A opt_args\n",
        zsh_function(path));
    const std::vector<const CLI::App*> inner = subcommands_of(command);
    if (inner.empty()) return text + arguments + "\n}\n";
    std::string names, calls;
    for (const CLI::App* c : inner) {
        names += "                " +
                 zsh_quoted(c->get_name() + ":" + zsh_meaning(c->get_description())) + "\n";
        calls += fmt::format("                {}) {} ;;\n", c->get_name(),
                             zsh_function(path + " " + c->get_name()));
    }
    return fmt::format(
        "{}{} \\\n        '1:command:->command' '*::argument:->argument'\n"
        "    case $state in\n        command)\n            local -a commands=(\n{}            )\n"
        "            _describe command commands ;;\n        argument)\n"
        "            case $words[1] in\n{}            esac ;;\n    esac\n}}\n",
        text, arguments, names, calls);
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
    std::vector<std::string> paths;
    std::string values, words;
    visit_commands(app, "livetet", [&](const std::string& path, const CLI::App& command) {
        if (&command != &app) paths.push_back(fmt::format("\"{}\"", path));
        std::vector<std::string> names;
        for (const CLI::App* inner : subcommands_of(command)) names.push_back(inner->get_name());
        for (const CLI::Option* option : options_of(command)) {
            if (is_flag(*option) || !option->nonpositional()) continue;
            std::vector<std::string> with;
            for (const std::string& name : names_of(*option))
                with.push_back(fmt::format("\"{} {}\"", path, name));
            const std::vector<std::string> choices = choices_of(*option);
            values += fmt::format(
                "        {}) {} ;;\n", fmt::join(with, " | "),
                choices.empty() ? "return" : fmt::format("words=\"{}\"", fmt::join(choices, " ")));
        }
        words += fmt::format("        \"{}\") options=\"{}\" commands=\"{}\" ;;\n", path,
                             fmt::join(option_names(command), " "), fmt::join(names, " "));
    });
    return fmt::format(bash_script, fmt::join(paths, " | "), values, words);
}

std::string zsh_completion(const CLI::App& app) {
    std::string text =
        "#compdef livetet\n# Completion of livetet for zsh.\n"
        "# Written by `livetet reference --completions`.\n\n";
    visit_commands(app, "livetet", [&](const std::string& path, const CLI::App& command) {
        text += zsh_function_text(path, command) + "\n";
    });
    return text + "_livetet \"$@\"\n";
}

}  // namespace livetet
