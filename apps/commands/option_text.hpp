#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace livetet {

/// Sub-commands of a command, in the order of its help.
std::vector<const CLI::App*> subcommands_of(const CLI::App& command);

/// Options of a command, positional ones first; without `--help`.
std::vector<const CLI::Option*> options_of(const CLI::App& command);

/// All names of an option: "-o" and "--output"; of a positional one the name that its value has.
std::vector<std::string> names_of(const CLI::Option& option);

/// Whether an option takes no value.
bool is_flag(const CLI::Option& option);

/// Names that an option's value may have, of an enumeration; empty for any other option.
std::vector<std::string> choices_of(const CLI::Option& option);

/// Whether an option's value is a text that may be the name of a file.
bool takes_text(const CLI::Option& option);

/// The values that an option takes, in words; names of an enumeration stand in `quote`. Empty for a
/// flag.
std::string value_text(const CLI::Option& option, std::string_view quote);

/// Its description and the options that it excludes or needs, which stand in backticks.
std::string meaning_text(const CLI::Option& option);

/// The footer of a command's own: CLI11 hands a footer down to the sub-commands. Empty if it has
/// none.
std::string own_footer(const CLI::App& command);

/// Help of a command as CLI11 writes it, but for enumerations: "TEXT:{lps,ras}" in place of the
/// numbers behind the names.
std::shared_ptr<CLI::FormatterBase> help_formatter();

}  // namespace livetet
