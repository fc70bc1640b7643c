#include "io/dicom_series.hpp"

#include <algorithm>
#include <map>

#include "base/error.hpp"
#include "base/file.hpp"

namespace livetet::dicom {

namespace {

namespace fs = std::filesystem;

using Series = std::vector<Object>;

constexpr std::size_t max_listed = 20;

/// The files of a folder except hidden ones, such as the `._IM0001.dcm` of macOS.
std::vector<fs::path> files_of(const fs::path& folder) {
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error))
        if (std::error_code ignored;
            entry->is_regular_file(ignored) && !entry->path().filename().string().starts_with('.'))
            files.push_back(entry->path());
    if (error) fail("{}: the folder cannot be read", folder.string());
    std::sort(files.begin(), files.end());
    return files;
}

/// The series of a folder, by UID, and for each that cannot be read the reason.
struct Folder {
    std::map<std::string, Series> series;
    std::map<std::string, std::string> faults;

    /// Throws Error if a series has a fault.
    void check(const std::string& uid) const {
        if (const auto fault = faults.find(uid); fault != faults.end()) fail("{}", fault->second);
    }
};

/// Reads the headers of a folder's files. Files that are not DICOM and series without an image are
/// passed over. Throws Error for a damaged file that does not say which series it belongs to.
Folder folder_at(const fs::path& place) {
    Folder folder;
    std::map<std::string, fs::path> other_files;
    for (const fs::path& file : files_of(place)) {
        if (!has_dicom_mark(file) && !ends_as_dicom(file)) continue;
        try {
            if (std::optional<Object> object = read_object(file))
                folder.series[object->series_uid].push_back(std::move(*object));
            else
                other_files.emplace(series_uid_of(file), file);
        } catch (const Error& error) {
            const std::string uid = series_uid_of(file);
            if (uid.empty()) throw;
            folder.faults.emplace(uid, error.what());
        }
    }
    for (const auto& [uid, file] : other_files)
        if (folder.series.contains(uid))
            folder.faults.emplace(uid, fmt::format("{}: states no Rows or Columns, expected an "
                                                   "image as in other files of its series",
                                                   file.string()));
    return folder;
}

/// What a series is chosen by: its number if no other series has it, else the end of its UID.
std::string key_of(const Series& series, const std::map<std::string, Series>& all) {
    const std::string &number = series.front().series_number, &uid = series.front().series_uid;
    const auto same = std::count_if(all.begin(), all.end(), [&](const auto& other) {
        return other.second.front().series_number == number;
    });
    if (!number.empty() && same == 1) return number;
    std::size_t digits = std::min<std::size_t>(uid.size(), 8);
    const auto ambiguous = [&] {
        const std::string end = uid.substr(uid.size() - digits);
        return std::count_if(all.begin(), all.end(),
                             [&](const auto& other) { return other.first.ends_with(end); }) > 1;
    };
    while (digits < uid.size() && ambiguous()) ++digits;
    return uid.substr(uid.size() - digits);
}

std::string modality_of(const Object& object) {
    const bool is_code = std::all_of(object.modality.begin(), object.modality.end(), [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    });
    return is_code && object.modality.size() <= 16 ? object.modality : "?";
}

std::string list_of(const std::map<std::string, Series>& all) {
    std::string text;
    std::size_t listed = 0;
    for (const auto& [uid, series] : all) {
        if (++listed > max_listed)
            return text + fmt::format("; and {} more", all.size() - max_listed);
        const Object& first = series.front();
        std::size_t frames = 0;
        for (const Object& object : series) frames += object.frames;
        text += fmt::format("{}#{} ({}, {} x {} pixels, {} {})", text.empty() ? "" : "; ",
                            key_of(series, all), modality_of(first), first.size[0], first.size[1],
                            frames, first.is_segmentation() ? "frames" : "slices");
    }
    return text;
}

Series chosen_series(Folder folder, const DicomName& name) {
    const std::string where = name.place.string();
    auto& all = folder.series;
    if (name.choice.empty() && all.size() > 1)
        fail("{}: holds {} series, expected a choice after its name, such as '{}#{}': {}", where,
             all.size(), where, key_of(all.begin()->second, all), list_of(all));
    if (all.empty() || name.choice.empty()) {  // a faulty series may be the one that is meant
        if (!folder.faults.empty()) folder.check(folder.faults.begin()->first);
        if (all.empty())
            fail(
                "{}: holds no DICOM image, expected the files of a series (subfolders are not "
                "searched)",
                where);
        return std::move(all.begin()->second);
    }
    folder.check(name.choice);
    for (auto& [uid, series] : all)
        if (name.choice == uid || name.choice == key_of(series, all)) {
            folder.check(uid);
            return std::move(series);
        }
    fail("{}: has no series '{}' (after the '#'), expected one of {}", where,
         name.choice.substr(0, 64), list_of(all));
}

}  // namespace

bool stands_alone(const Object& object) {
    return object.is_segmentation() || object.frames > 1 || object.is_enhanced();
}

std::vector<Object> find_series(const DicomName& name) {
    std::error_code ignored;
    if (fs::is_directory(name.place, ignored)) {
        Series series = chosen_series(folder_at(name.place), name);
        const auto alone = std::find_if(series.begin(), series.end(), stands_alone);
        if (series.size() > 1 && alone != series.end())
            fail(
                "{}: its series has {} objects, of which {} is a volume of its own; expected the "
                "name of one file",
                name.place.string(), series.size(), alone->file.filename().string());
        return series;
    }
    check_is_file(name.place);
    std::optional<Object> object = read_object(name.place);
    if (!object)
        fail("{}: is no DICOM image, expected a slice, a multi-frame image or a segmentation",
             name.place.string());
    std::vector<Object> series;
    if (stands_alone(*object)) {
        series.push_back(std::move(*object));
        return series;
    }
    const fs::path folder = name.place.has_parent_path() ? name.place.parent_path() : fs::path(".");
    Folder beside = folder_at(folder);
    beside.check(object->series_uid);
    series = std::move(beside.series[object->series_uid]);
    std::erase_if(series, stands_alone);
    if (series.empty()) series.push_back(std::move(*object));
    return series;
}

}  // namespace livetet::dicom
