#include "config/key_places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace livetet {

namespace {

/// The entry of a table or list; an undefined node if there is none.
YAML::Node entry_of(const YAML::Node& node, std::string_view key) {
    if (node.IsMap())
        for (const auto& entry : node)
            if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
    std::size_t i = 0;
    const bool is_index = std::from_chars(key.data(), key.data() + key.size(), i).ec == std::errc{};
    if (node.IsSequence() && is_index && i < node.size()) return node[i];
    return YAML::Node(YAML::NodeType::Undefined);
}

}  // namespace

KeyPlaces::KeyPlaces(std::string file, const std::string& text)
    : file_(std::move(file)), root_(YAML::Load(text)) {}

std::string KeyPlaces::operator()(std::string_view key) const {
    YAML::Node node = root_;
    bool is_known = false;
    while (!key.empty()) {
        const std::size_t end = std::min(key.find_first_of(".["), key.size());
        std::string_view name = key.substr(0, end);
        key.remove_prefix(std::min(end + 1, key.size()));
        if (name.ends_with(']')) name.remove_suffix(1);
        const YAML::Node entry = entry_of(node, name);
        if (!entry.IsDefined()) break;
        node.reset(entry);
        is_known = true;
    }
    if (!is_known || node.Mark().is_null()) return file_;
    return fmt::format("{}:{}", file_, node.Mark().line + 1);
}

}  // namespace livetet
