#include "house/links.hpp"

#include <cctype>
#include <map>
#include <regex>
#include <sstream>

#include "house/source_tree.hpp"

namespace livetet::house {
namespace {

/// Lines of a page outside of fenced code.
std::vector<std::string> prose(std::string_view page) {
    static const std::regex fence(R"(^\s*(```|~~~))");
    std::vector<std::string> kept;
    std::istringstream stream{std::string(page)};
    bool code = false;
    for (std::string line; std::getline(stream, line);) {
        if (std::regex_search(line, fence)) {
            code = !code;
        } else if (!code) {
            kept.push_back(line);
        }
    }
    return kept;
}

/// GitHub's rule: lower case, spaces to hyphens, punctuation left out.
std::string anchor_of(std::string heading) {
    static const std::regex link(R"(\[([^\]]*)\]\([^)]*\))"), html(R"(<[^>]*>)"),
        closing(R"(\s+#*\s*$)");
    heading = std::regex_replace(heading, link, "$1");
    heading = std::regex_replace(heading, html, "");
    heading = std::regex_replace(heading, closing, "");
    std::string anchor;
    for (const char c : heading) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == ' ') {
            anchor += '-';
        } else if (std::isalnum(byte) || c == '-' || c == '_' || byte >= 0x80) {
            anchor += static_cast<char>(std::tolower(byte));
        }
    }
    return anchor;
}

}  // namespace

std::set<std::string> anchors(std::string_view page) {
    static const std::regex heading(R"(^#{1,6}\s+(.*)$)"),
        id(R"re(<[^>]*\b(?:id|name)="([^"]+)")re");
    std::set<std::string> found;
    std::map<std::string, int> seen;
    for (const auto& line : prose(page)) {
        std::smatch match;
        if (std::regex_match(line, match, heading)) {
            const auto anchor = anchor_of(match[1]);
            const int repeat = seen[anchor]++;
            found.insert(repeat == 0 ? anchor : anchor + "-" + std::to_string(repeat));
        }
        if (std::regex_search(line, match, id)) {
            found.insert(match[1]);
        }
    }
    return found;
}

std::vector<std::string> link_targets(std::string_view page) {
    static const std::regex code(R"(`[^`]*`)"),
        target(R"re(\]\(\s*<?([^)\s>]+)|^\s*\[[^\]]+\]:\s*(\S+)|\b(?:href|src)="([^"]+)")re");
    std::vector<std::string> found;
    for (const auto& line : prose(page)) {
        const auto text = std::regex_replace(line, code, "");
        for (std::sregex_iterator match(text.begin(), text.end(), target), end; match != end;
             ++match) {
            found.push_back((*match)[1].str() + (*match)[2].str() + (*match)[3].str());
        }
    }
    return found;
}

std::vector<std::string> broken_links(const std::filesystem::path& root,
                                      const std::vector<std::filesystem::path>& pages) {
    static const std::regex elsewhere(R"(^([a-z][a-z0-9+.-]*:|//))");
    std::vector<std::string> broken;
    for (const auto& page : pages) {
        for (const auto& target : link_targets(read_text(root / page))) {
            if (std::regex_search(target, elsewhere)) {
                continue;
            }
            const auto hash = target.find('#');
            const auto path = target.substr(0, hash);
            const auto file = path.empty() ? root / page : (root / page).parent_path() / path;
            const bool exists = std::filesystem::exists(file);
            const bool anchored = exists && hash != target.npos && file.extension() == ".md";
            if (!exists ||
                (anchored && !anchors(read_text(file)).contains(target.substr(hash + 1)))) {
                broken.push_back(page.string() + ": " + target);
            }
        }
    }
    return broken;
}

}  // namespace livetet::house
