#include "config/yaml.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace livetet {

namespace {

/// Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t substitute = diagonal + (a[i] != b[j]);
            diagonal = row[j + 1];
            row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, substitute});
        }
    }
    return row.back();
}

}  // namespace

std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates) {
    std::string nearest;
    std::size_t min_distance = std::max<std::size_t>(2, word.size() / 2) + 1;
    for (const std::string& c : candidates)
        if (const std::size_t d = edit_distance(word, c); d < min_distance) {
            min_distance = d;
            nearest = c;
        }
    return nearest;
}

std::string range_missed_by(std::string_view found) {
    using Limits = std::numeric_limits<int>;
    for (std::size_t at = 0; at < found.size();) {
        at = std::min(found.find_first_of("0123456789", at), found.size());
        const std::size_t end = std::min(found.find_first_not_of("0123456789", at), found.size());
        if (end - at > Limits::digits10)
            return fmt::format(" from {} to {}", Limits::min(), Limits::max());
        at = end;
    }
    return "";
}

void YamlReader::check_all_known() const {
    if (!node_ || !node_.IsMap()) return;
    std::vector<std::string> seen;
    for (const auto& entry : node_) {
        if (!entry.first.IsScalar())
            fail("{}: a key is not a scalar, expected a name ({})", prefix_, place(entry.first));
        const auto key = entry.first.as<std::string>();
        if (std::find(seen.begin(), seen.end(), key) != seen.end())
            fail("{}{} is given twice ({})", prefix_, key, place(entry.first));
        seen.push_back(key);
        if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
        for (const KeyOfVariant& other : keys_of_others_)
            if (other.key == key)
                fail("{}{} belongs to {}, found {} ({})", prefix_, key, other.with, other.found,
                     place(entry.first));
        if (const std::string nearest = nearest_name(key, known_); !nearest.empty())
            fail("unknown key {}{}, did you mean {}{}? ({})", prefix_, key, prefix_, nearest,
                 place(entry.first));
        fail("unknown key {}{}, expected one of {} ({})", prefix_, key, fmt::join(known_, ", "),
             place(entry.first));
    }
}

std::string YamlReader::text_of(const YAML::Node& node) {
    YAML::Emitter out;
    out << YAML::Flow << node;
    std::string text = out.c_str();
    if (text.size() > 60) text.replace(57, std::string::npos, "...");
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

void ReferencePrinter::heading(std::string_view key, std::string_view text) {
    text_ += fmt::format("{:{}}{}:\n{:{}}  # {}\n", "", indent_, key, "", indent_, text);
}

void ReferencePrinter::row(std::string_view key, const std::string& value, std::string_view unit,
                           std::string_view text, std::string_view check) {
    const std::string pair =
        fmt::format("{:{}}{}: {}", "", indent_, key, value.empty() ? "\"\"" : value);
    text_ += fmt::format("{:<{}} # {}{}{}{}{}\n", pair, 34,
                         unit.empty() ? "" : fmt::format("[{}] ", unit), text,
                         check.empty() ? "" : "; must be ", check, "");
}

}  // namespace livetet
