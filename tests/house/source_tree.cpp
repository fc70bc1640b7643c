#include "house/source_tree.hpp"

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace livetet::house {

const std::vector<std::string>& source_folders() {
    static const std::vector<std::string> folders{"src",  "solvers", "io",         "meshing",
                                                  "apps", "tests",   "benchmarks", "examples"};
    return folders;
}

std::string read_text(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) {
        throw std::runtime_error("cannot read " + file.string());
    }
    return {std::istreambuf_iterator<char>(stream), {}};
}

SourceFiles read_sources(const std::filesystem::path& root,
                         const std::vector<std::string>& folders) {
    SourceFiles files;
    for (const auto& folder : folders) {
        if (!std::filesystem::is_directory(root / folder)) {
            continue;
        }
        for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
            const auto& path = entry.path();
            if (path.extension() == ".hpp" || path.extension() == ".cpp") {
                files[path.lexically_relative(root).generic_string()] = read_text(path);
            }
        }
    }
    return files;
}

std::filesystem::path tree_root() { return LIVETET_ROOT; }

std::string lines(const std::vector<std::string>& findings) {
    std::string text;
    for (const auto& finding : findings) {
        text += "  " + finding + '\n';
    }
    return text;
}

}  // namespace livetet::house
