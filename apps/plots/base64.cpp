#include <vtkBase64Utilities.h>

#include "apps/plots/pictures.hpp"
#include "base/file.hpp"

namespace livetet {

std::string base64_of(const std::filesystem::path& path) {
    const std::string bytes = read_text_file(path);
    std::string text(4 * (bytes.size() / 3 + 1) + 1, '\0');
    text.resize(vtkBase64Utilities::Encode(reinterpret_cast<const unsigned char*>(bytes.data()),
                                           bytes.size(),
                                           reinterpret_cast<unsigned char*>(text.data())));
    return text;
}

}  // namespace livetet
