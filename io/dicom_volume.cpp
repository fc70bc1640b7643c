#include "io/dicom_volume.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "base/error.hpp"
#include "io/dicom_child.hpp"
#include "io/dicom_segmentation.hpp"
#include "io/dicom_series.hpp"
#include "io/dicom_slices.hpp"
#include "io/parse_in_child.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// Slices of one series, or the frames of one object, as a volume.
Volume image_of(std::span<const dicom::Object> objects, const std::string& where) {
    const dicom::Slices stack = dicom::stack_slices(objects, where);
    std::vector<dicom::Scale> scales;
    std::vector<dicom::PixelFormat> formats;
    for (const dicom::Slice& slice : stack.slices) {
        scales.push_back(slice.scale);
        formats.push_back(slice.format);
    }
    Volume volume;
    volume.size = stack.grid.size;
    volume.ras_from_voxel = stack.grid.ras_from_voxel;
    volume.type = dicom::type_for(formats, scales);
    dicom::SliceReader reader;
    std::vector<double> values;
    for (const dicom::Slice& slice : stack.slices) {
        reader.read(slice, values);
        append_values(values, slice.scale, volume.type, volume.bytes);
    }
    return volume;
}

/// What a child process passes on: the voxels, then numbers and names, then the length of these.
class Packer {
  public:
    explicit Packer(std::vector<char> bytes) : bytes_(std::move(bytes)), voxels_(bytes_.size()) {}

    template <class T>
    void put(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        const auto* first = reinterpret_cast<const char*>(&value);
        bytes_.insert(bytes_.end(), first, first + sizeof value);
    }
    void put_text(const std::string& text) {
        put(text.size());
        bytes_.insert(bytes_.end(), text.begin(), text.end());
    }
    std::vector<char> packed() {
        put(bytes_.size() - voxels_);
        return std::move(bytes_);
    }

  private:
    std::vector<char> bytes_;
    std::size_t voxels_;
};

/// Reads what a Packer has put, in the same order.
class Unpacker {
  public:
    explicit Unpacker(std::vector<char> bytes) : bytes_(std::move(bytes)) {
        std::size_t length = 0;
        at_ = bytes_.size() - sizeof length;
        get(length);
        at_ = voxels_ = bytes_.size() - sizeof length - length;
    }

    template <class T>
    void get(T& value) {
        std::memcpy(&value, bytes_.data() + at_, sizeof value);
        at_ += sizeof value;
    }
    std::string get_text() {
        std::size_t length = 0;
        get(length);
        const std::string text(bytes_.data() + at_, length);
        at_ += length;
        return text;
    }
    std::vector<char> voxels() {
        bytes_.resize(voxels_);
        return std::move(bytes_);
    }

  private:
    std::vector<char> bytes_;
    std::size_t at_ = 0, voxels_ = 0;
};

std::vector<char> packed(Volume volume) {
    Packer packer(std::move(volume.bytes));
    packer.put(volume.size);
    for (int i = 0; i < 16; ++i) packer.put(volume.ras_from_voxel(i % 4, i / 4));
    packer.put(volume.type);
    packer.put(volume.label_names.size());
    for (const auto& [label, name] : volume.label_names) {
        packer.put(label);
        packer.put_text(name);
    }
    return packer.packed();
}

Volume unpacked_volume(std::vector<char> bytes) {
    Unpacker unpacker(std::move(bytes));
    Volume volume;
    unpacker.get(volume.size);
    for (int i = 0; i < 16; ++i) unpacker.get(volume.ras_from_voxel(i % 4, i / 4));
    unpacker.get(volume.type);
    std::size_t names = 0;
    unpacker.get(names);
    for (std::size_t n = 0; n < names; ++n) {
        std::int32_t label = 0;
        unpacker.get(label);
        volume.label_names[label] = unpacker.get_text();
    }
    volume.bytes = unpacker.voxels();
    return volume;
}

/// For use in the child: lowers its limits to those of an object that is read without the files
/// beside it.
void limit_to_one(std::span<const dicom::Object> objects, const fs::path& place) {
    std::error_code ignored;
    if (objects.size() == 1 && stands_alone(objects.front()) && fs::is_regular_file(place, ignored))
        limit_parser(std::min(fs::file_size(objects.front().file), max_counted_bytes));
}

}  // namespace

Volume read_dicom_volume(const DicomName& name) {
    return unpacked_volume(through_gdcm(name.place, [&] {
        const std::vector<dicom::Object> objects = dicom::find_series(name);
        limit_to_one(objects, name.place);
        const dicom::Object& first = objects.front();
        if (first.is_segmentation()) {
            std::error_code ignored;
            const bool is_folder = fs::is_directory(name.place, ignored);  // '#' chose the series
            return packed(read_segmentation(first, is_folder ? "" : name.choice));
        }
        if (!name.choice.empty() && fs::is_regular_file(name.place))
            fail("{}: is no segmentation, expected no '#{}' after its name", name.place.string(),
                 name.choice.substr(0, 64));
        return packed(image_of(objects, name.place.string()));
    }));
}

std::vector<fs::path> dicom_files(const DicomName& name) {
    const std::vector<char> names = through_gdcm(name.place, [&] {
        std::vector<char> text;
        for (const dicom::Object& object : dicom::find_series(name)) {
            const std::string file = object.file.string();
            text.insert(text.end(), file.begin(), file.end());
            text.push_back('\0');
        }
        return text;
    });
    std::vector<fs::path> files;
    for (auto at = names.begin(); at != names.end();) {
        const auto end = std::find(at, names.end(), '\0');
        files.emplace_back(std::string(at, end));
        at = end + 1;
    }
    return files;
}

}  // namespace livetet
