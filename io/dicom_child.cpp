#include "io/dicom_child.hpp"

#include <gdcmTrace.h>

#include <algorithm>
#include <exception>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/parse_in_child.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// Bytes of all files in the folder, or in that of the file.
std::uintmax_t bytes_at(const fs::path& place) {
    std::error_code error;
    if (!fs::is_directory(place, error)) {
        check_is_file(place);
        // Its series is read with it.
        return bytes_at(place.has_parent_path() ? place.parent_path() : ".");
    }
    std::uintmax_t bytes = 0;
    for (fs::directory_iterator entry(place, error), end; !error && entry != end;
         entry.increment(error))
        if (std::error_code ignored; entry->is_regular_file(ignored))
            bytes += entry->file_size(ignored);
    if (error) fail("{}: the folder cannot be read", place.string());
    return bytes;
}

}  // namespace

std::vector<char> through_gdcm(const fs::path& place,
                               const std::function<std::vector<char>()>& use) {
    const std::uintmax_t bytes = std::min(bytes_at(place), max_counted_bytes);
    return parse_in_child(place, bytes, "GDCM", [&]() -> std::vector<char> {
        gdcm::Trace::DebugOff();
        gdcm::Trace::WarningOff();
        gdcm::Trace::ErrorOff();
        try {
            return use();
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            fail("{}: needs more memory than files of its size should, is it damaged?",
                 place.string());
        } catch (const std::exception&) {
            fail("{}: is damaged, expected DICOM", place.string());
        }
    });
}

}  // namespace livetet
