#include "apps/commands/option_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace livetet {

namespace {

/// Type of an option before and after the colon. CLI11 writes "INT:INT in [1 - 100]", "TEXT:{a,b}"
/// or "ENUM:value in {b->1,a->0} OR {1,0}".
struct OptionType {
    explicit OptionType(const CLI::Option& option) : text(option.get_type_name()) {
        colon = text.find(':');
        base = text.substr(0, colon);
    }
    bool is_whole() const { return base.find("INT") != base.npos; }
    /// One of CLI11's own: not a name that a command gave to its values.
    bool is_built_in() const {
        return is_whole() || base == "FLOAT" || base == "TEXT" || base == "ENUM";
    }
    bool is_enumeration() const { return is_built_in() && text.find('{') != text.npos; }
    std::string between(char open, char close) const {
        const std::size_t begin = text.find(open) + 1;
        return text.substr(begin, text.find(close, begin) - begin);
    }

    std::string text, base;
    std::size_t colon;
};

std::string limits_text(const OptionType& type) {
    if (type.text.find('[') != type.text.npos) {
        const std::string range = type.between('[', ']');
        const std::size_t dash = range.find(" - ");
        return fmt::format(", {} to {}", range.substr(0, dash), range.substr(dash + 3));
    }
    if (type.text.find("NONNEGATIVE") != type.text.npos) return ", at least 0";
    if (type.text.find("POSITIVE") != type.text.npos) return ", greater than 0";
    return type.colon != type.text.npos ? ", " + type.text.substr(type.colon + 1) : "";
}

/// "; not with `--a`, `--b`", sorted, since CLI11 keeps a set of pointers.
std::string others_text(std::string_view relation, const std::set<CLI::Option*>& others) {
    std::vector<std::string> names;
    for (const CLI::Option* other : others) names.push_back(fmt::format("`{}`", other->get_name()));
    std::sort(names.begin(), names.end());
    return names.empty() ? "" : fmt::format("; {} {}", relation, fmt::join(names, ", "));
}

class HelpFormatter final : public CLI::Formatter {
  public:
    std::string make_option_opts(const CLI::Option* option) const override {
        std::string text = CLI::Formatter::make_option_opts(option);
        const std::string type = option->get_type_name();
        const std::size_t at = text.find(type);
        const std::vector<std::string> names = choices_of(*option);
        if (names.empty() || at == text.npos) return text;
        return text.replace(at, type.size(), fmt::format("TEXT:{{{}}}", fmt::join(names, ",")));
    }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<HelpFormatter>(); }

std::vector<const CLI::App*> subcommands_of(const CLI::App& command) {
    return command.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<const CLI::Option*> options_of(const CLI::App& command) {
    std::vector<const CLI::Option*> options;
    for (const bool positional : {true, false})
        for (const CLI::Option* option : command.get_options())
            if (option != command.get_help_ptr() && option->nonpositional() != positional)
                options.push_back(option);
    return options;
}

std::vector<std::string> names_of(const CLI::Option& option) {
    if (!option.nonpositional()) return {option.get_name(true)};
    std::vector<std::string> names;
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    return names;
}

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

std::vector<std::string> choices_of(const CLI::Option& option) {
    const OptionType type(option);
    std::vector<std::string> names;
    if (is_flag(option) || !type.is_enumeration()) return names;
    for (const std::string& name : CLI::detail::split(type.between('{', '}'), ','))
        names.push_back(name.substr(0, name.find("->")));
    return names;
}

bool takes_text(const CLI::Option& option) {
    const OptionType type(option);
    return !is_flag(option) && !type.is_whole() && type.base != "FLOAT" && !type.is_enumeration();
}

std::string value_text(const CLI::Option& option, std::string_view quote) {
    if (is_flag(option)) return "";
    const OptionType type(option);
    if (!type.is_built_in()) return type.text;
    std::string text;
    for (const std::string& name : choices_of(option))
        text += fmt::format("{}{}{}{}", text.empty() ? "" : ", ", quote, name, quote);
    if (text.empty())
        text = (type.base == "TEXT" ? "text"
                : type.is_whole()   ? "whole number"
                                    : "number") +
               limits_text(type);
    const int items = option.get_items_expected_max();
    if (option.get_type_size_min() > 1 && option.get_type_size_max() == option.get_type_size_min())
        return fmt::format("{} x {}", option.get_type_size_max(), text);
    return items > 1 ? text + "; several" : text;
}

std::string meaning_text(const CLI::Option& option) {
    return option.get_description() + others_text("not with", option.get_excludes()) +
           others_text("only with", option.get_needs());
}

std::string own_footer(const CLI::App& command) {
    const CLI::App* parent = command.get_parent();
    return parent && command.get_footer() == parent->get_footer() ? "" : command.get_footer();
}

}  // namespace livetet
