#include "apps/commands/mesh_source_options.hpp"

#include <algorithm>
#include <map>
#include <string>

namespace livetet {

namespace {

/// Visitor of a field table that makes options of its keys.
class OptionMaker {
  public:
    explicit OptionMaker(CLI::App& command) : command_(command) {}

    template <class T>
    void field(std::string_view key, T& value, std::string_view unit, std::string_view text,
               Check<T> check = {}) {
        add<T>(key, value, unit, text, check);
    }
    template <class T>
    void field(std::string_view key, std::optional<T>& value, std::string_view unit,
               std::string_view text, Check<T> check = {}) {
        add<T>(key, value, unit, text, check);
    }
    /// A flag that takes the choice of its MeshKey, or an option with the name of one.
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, E& value, std::string_view text, const Choices& choices) {
        const MeshKey* with = key_of(key);
        if (!with) return;
        const auto meaning = [&](const auto& has) {
            return std::find_if(choices.begin(), choices.end(), has)->meaning;
        };
        if (with->flag) {
            const auto* chosen = std::find_if(choices.begin(), choices.end(),
                                              [&](const auto& c) { return c.name == with->flag; });
            command_.add_flag(
                with->option, [&value, to = chosen->value](std::int64_t) { value = to; },
                fmt::format("{}: {} (default: {})", text, chosen->meaning,
                            meaning([&](const auto& c) { return c.value == value; })));
            return;
        }
        std::map<std::string, E> values;
        std::string meanings, name_of_default;
        for (const auto& c : choices) {
            values.emplace(c.name, c.value);
            meanings += fmt::format("; {}: {}", c.name, c.meaning);
            if (c.value == value) name_of_default = c.name;
        }
        command_.add_option(with->option, value, fmt::format("{}{}", text, meanings))
            ->transform(CLI::CheckedTransformer(values))
            ->default_str(name_of_default);
    }

  private:
    /// The key's entry among those with an option; none: nullptr.
    static const MeshKey* key_of(std::string_view key) {
        for (const MeshKey& k : mesh_keys())
            if (k.option && k.key && key == k.key) return &k;
        return nullptr;
    }

    template <class T, class Value>
    void add(std::string_view key, Value& value, std::string_view unit, std::string_view text,
             Check<T> check) {
        const MeshKey* with = key_of(key);
        if (!with) return;
        CLI::Option* option = command_.add_option(
            with->option, value, fmt::format("{}{}{}", text, unit.empty() ? "" : "; in ", unit));
        if constexpr (std::is_same_v<Value, int>) option->capture_default_str();
        if constexpr (std::is_same_v<T, std::vector<double>> || std::is_same_v<T, std::vector<int>>)
            option->delimiter(',');
        else if (!check.text.empty())
            option->check(CLI::Validator(
                [check](const std::string& found) { return refusal(found, check); }, check.text));
    }

    /// Empty if the text is a value that the check accepts.
    template <class T>
    static std::string refusal(const std::string& found, const Check<T>& check) {
        T value{};
        if (CLI::detail::lexical_cast(found, value) && check.holds(value)) return {};
        const char* kind = std::is_same_v<T, int>      ? "a whole number "
                           : std::is_same_v<T, double> ? "a number "
                                                       : "";
        return fmt::format("found {}, expected {}{}", found, kind, check.text);
    }

    CLI::App& command_;
};

}  // namespace

void add_source_options(CLI::App& command, MeshSource& source) {
    OptionMaker maker(command);
    visit_fields(maker, source);
}

}  // namespace livetet
