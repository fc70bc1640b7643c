#include "apps/outputs.hpp"

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/text.hpp"

namespace livetet {

void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path, std::initializer_list<std::filesystem::path> read) {
    for (const std::filesystem::path& input : read)
        if (same_file(path, input)) fail("{} {}: is read, expected another file to write", name, path.string());
}

void expect_ending(std::string_view name, const std::filesystem::path& path, std::string_view expected) {
    if (!path.empty() && !path.string().ends_with(expected)) fail("{} {}: expected a name that ends in {}", name, path.string(), expected);
}

}  // namespace livetet
