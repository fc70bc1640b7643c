#include "io/dicom_name.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>

#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
    std::error_code ignored;
    return fs::exists(path, ignored);
}

bool is_folder(const fs::path& path) {
    std::error_code ignored;
    return fs::is_directory(path, ignored);
}

fs::path without_last_slash(const fs::path& path) {
    return path.has_relative_path() && !path.has_filename() ? path.parent_path() : path;
}

DicomName split(const fs::path& path) {
    const std::string text = path.string();
    const std::size_t sign = text.rfind('#');
    if (sign == std::string::npos || sign == 0 || is_there(path) ||
        text.find('/', sign) != std::string::npos)  // it belongs to a folder's name
        return {without_last_slash(path), {}};
    const fs::path place = text.substr(0, sign);
    if (!is_there(place) && !ends_as_dicom(place)) return {without_last_slash(path), {}};
    return {without_last_slash(place), text.substr(sign + 1)};
}

}  // namespace

bool ends_as_dicom(const fs::path& path) {
    const std::string end = ending(path);
    return end == ".dcm" || end == ".dicom";
}

bool has_dicom_mark(const fs::path& file) {
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) return false;  // opening a pipe would wait
    char start[132] = {};
    std::ifstream in(file, std::ios::binary);
    return in.read(start, sizeof start) && std::memcmp(start + 128, "DICM", 4) == 0;
}

std::optional<DicomName> dicom_name(const fs::path& path) {
    constexpr const char* others[] = {".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd"};
    DicomName name = split(path);
    const std::string end = ending(name.place);
    if (std::find(std::begin(others), std::end(others), end) != std::end(others)) return {};
    if (name.place.empty()) return {};
    if (is_folder(name.place) || ends_as_dicom(name.place) || has_dicom_mark(name.place))
        return name;
    return {};
}

fs::path image_place(const fs::path& path) {
    const auto name = dicom_name(path);
    return name ? name->place : path;
}

fs::path image_filename(const fs::path& path) {
    const auto name = dicom_name(path);
    if (!name) return path.filename();
    const std::string file = name->place.filename().string();
    return name->choice.empty() ? file : file + '#' + name->choice;
}

fs::path derived_filename(const fs::path& path, const std::string& extension) {
    if (is_folder(image_place(path))) return image_filename(path).string() + extension;
    return image_place(path).filename().replace_extension(extension);
}

}  // namespace livetet
