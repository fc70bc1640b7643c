#include "apps/commands/man_pages.hpp"

#include <fmt/format.h>

#include "apps/commands/option_text.hpp"

namespace livetet {

namespace {

std::string roff_char(char c) {
    switch (c) {
        case '\\':
            return "\\e";
        case '-':
            return "\\-";
        case '\'':
            return "\\(aq";
        case '`':
            return "\\(ga";
        case '^':
            return "\\(ha";
        case '~':
            return "\\(ti";
        default:
            return {c};
    }
}

/// A dot at the start of a line would begin a request.
std::string guarded(const std::string& line) { return line.starts_with('.') ? "\\&" + line : line; }

/// Literal text: names of commands and options, values, lines of a footer.
std::string roff_literal(std::string_view text) {
    std::string literal;
    for (const char c : text) literal += roff_char(c);
    return guarded(literal);
}

std::string bold(std::string_view text) { return "\\fB" + roff_literal(text) + "\\fP"; }
std::string italic(std::string_view text) { return "\\fI" + roff_literal(text) + "\\fP"; }

/// First sentence of a program's description, without its name in front.
std::string summary_of(const CLI::App& app) {
    std::string text = app.get_description();
    if (const std::size_t name = text.find(": "); text.starts_with("Livetet: "))
        text = text.substr(name + 2);
    return text.substr(0, text.find(". "));
}

std::string header(const std::string& title) {
    return fmt::format(
        ".\\\" Written by `livetet reference --man`.\n"
        ".TH {} 1 \"\" \"Livetet {}\" \"Livetet\"\n",
        roff_literal(title), LIVETET_VERSION);
}

std::string option_entry(const CLI::Option& option) {
    std::string tag;
    for (const std::string& name : names_of(option))
        tag += (tag.empty() ? "" : ", ") + (option.nonpositional() ? bold(name) : italic(name));
    const std::string value = value_text(option, "");
    if (!value.empty()) tag += "  " + italic(value);
    std::string text = roff_text(meaning_text(option));
    if (option.get_required())
        text += "; required";
    else if (const std::string preset = option.get_default_str(); !preset.empty())
        text += "; default: " + bold(preset);
    return fmt::format(".TP\n{}\n{}\n", tag, text);
}

std::string synopsis(const CLI::App& command, const std::string& path) {
    std::string text = bold(path);
    const std::vector<const CLI::Option*> options = options_of(command);
    for (const CLI::Option* option : options)
        if (option->nonpositional()) {
            text += " [" + italic("options") + "]";
            break;
        }
    for (const CLI::Option* option : options) {
        if (option->nonpositional()) continue;
        const std::string name = italic(names_of(*option).front()) +
                                 (option->get_items_expected_max() > 1 ? " ..." : "");
        text += option->get_required() ? " " + name : " [" + name + "]";
    }
    if (!subcommands_of(command).empty()) text += " " + italic("command") + " ...";
    return text + "\n";
}

/// Options, footer and sub-commands.
void append_body(std::string& text, const CLI::App& command, const std::string& path) {
    for (const CLI::Option* option : options_of(command)) text += option_entry(*option);
    if (const std::string footer = own_footer(command); !footer.empty()) {
        text += ".PP\n.EX\n";
        for (const std::string& line : CLI::detail::split(footer, '\n'))
            text += roff_literal(line) + "\n";
        text += ".EE\n";
    }
    for (const CLI::App* inner : subcommands_of(command)) {
        const std::string inner_path = path + " " + inner->get_name();
        text += fmt::format(".SS {}\n{}.\n.PP\n{}", roff_literal(inner_path),
                            roff_text(inner->get_description()), synopsis(*inner, inner_path));
        append_body(text, *inner, inner_path);
    }
}

std::string command_page(const CLI::App& command) {
    const std::string title = "livetet-" + command.get_name(),
                      path = "livetet " + command.get_name();
    std::string body;
    append_body(body, command, path);
    return fmt::format(
        "{}.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}.SH DESCRIPTION\n{}.\n{}{}"
        ".SH EXIT STATUS\nAs {} states it.\n.SH SEE ALSO\n.BR livetet (1)\n",
        header(title), roff_literal(title), roff_text(command.get_description()),
        synopsis(command, path), roff_text(command.get_description()),
        body.empty()                      ? ""
        : subcommands_of(command).empty() ? ".SH OPTIONS\n"
                                          : ".SH COMMANDS\n",
        body, bold("livetet") + "(1)");
}

std::string program_page(const CLI::App& app) {
    std::string text = fmt::format(
        "{}.SH NAME\nlivetet \\- {}\n.SH SYNOPSIS\n{}.SH DESCRIPTION\n{}\n.SH OPTIONS\n",
        header("livetet"), roff_text(summary_of(app)), synopsis(app, "livetet"),
        roff_text(app.get_description()));
    for (const CLI::Option* option : options_of(app)) text += option_entry(*option);
    text += ".SH COMMANDS\n";
    for (const CLI::App* command : subcommands_of(app))
        text +=
            fmt::format(".TP\n.BR {} (1)\n{}.\n", roff_literal("livetet-" + command->get_name()),
                        roff_text(command->get_description()));
    return text + fmt::format(".SH EXIT STATUS\n{}\n", roff_text(app.get_footer()));
}

}  // namespace

std::string roff_text(std::string_view text) {
    std::string result, code;
    bool in_code = false;
    char before = ' ';
    for (const char given : text) {
        const char c = given == '\n' ? ' ' : given;
        const bool hyphen = c == '-' && before != ' ' && before != '(' && before != '-';
        if (c == '`') {
            if (in_code) result += bold(code);
            in_code = !in_code;
            code.clear();
        } else if (in_code) {
            code += c;
        } else {
            result += hyphen ? "-" : roff_char(c);
        }
        before = c;
    }
    if (in_code) result += roff_literal("`" + code);  // one without a second
    return guarded(result);
}

std::map<std::string, std::string> man_pages(const CLI::App& app) {
    std::map<std::string, std::string> pages{{"livetet.1", program_page(app)}};
    for (const CLI::App* command : subcommands_of(app))
        pages.emplace("livetet-" + command->get_name() + ".1", command_page(*command));
    return pages;
}

}  // namespace livetet
