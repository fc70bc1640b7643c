#include "apps/warp/output_name.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

std::vector<std::string_view> parts_of(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(separator, at), text.size());
        parts.push_back(trim(text.substr(at, end - at)));
        at = end + 1;
    }
    return parts;
}

}  // namespace

fs::path output_name(std::string_view option, const fs::path& pattern, const fs::path& result,
                     std::size_t frame, std::size_t frames) {
    const std::string text = pattern.string();
    std::string name;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t open = std::min(text.find('{', at), text.size()),
                          close = text.find('}', open);
        name += text.substr(at, open - at);
        if (open == text.size()) break;
        const std::string word =
            close == text.npos ? text.substr(open) : text.substr(open, close - open + 1);
        const fs::path folder = result.parent_path();
        if (word == "{result}")
            name += result.stem().string();
        else if (word == "{folder}")
            name += folder.empty() ? "." : folder.string();
        else if (word == "{frame}" && frames > 0)
            name += fmt::format("{:0{}}", frame + 1, std::to_string(frames).size());
        else
            fail("{} {}: found {}, expected {}{{result}} or {{folder}} in braces", option, text,
                 word, frames > 0 ? "{frame}, " : "");
        at = open + word.size();
    }
    return name;
}

std::vector<std::size_t> chosen_frames(const std::string& text, std::size_t count,
                                       const std::string& where) {
    std::vector<std::size_t> frames;
    for (const std::string_view part : parts_of(text, ',')) {
        const std::vector<std::string_view> words = parts_of(part, ':');
        std::array<std::size_t, 3> range{1, count, 1};  // first, last, step
        bool valid = words.size() <= range.size() && !(words.size() == 1 && part.empty());
        for (std::size_t n = 0; valid && n < words.size(); ++n) {
            if (words[n].empty()) continue;
            const auto number = parse_index(words[n]);
            valid = number && *number >= 1;
            range[n] = number.value_or(0);
        }
        if (words.size() == 1) range[1] = range[0];
        const auto [first, last, step] = range;
        if (!valid || first > last || last > count)
            fail(
                "{}: holds {}, found --frames {}, expected numbers from 1 to {} or "
                "FIRST:LAST:STEP, separated by commas",
                where, counted(count, "frame"), text, count);
        for (std::size_t frame = first; frame <= last; frame += std::min(step, count))
            frames.push_back(frame - 1);
    }
    return frames;
}

}  // namespace livetet
