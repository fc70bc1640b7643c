#include "io/dicom_derived.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.hpp"
#include "base/pending_folder.hpp"
#include "io/dicom_child.hpp"
#include "io/dicom_dataset.hpp"
#include "io/dicom_derivation.hpp"
#include "io/dicom_derived_segmentation.hpp"
#include "io/dicom_series.hpp"
#include "io/dicom_slices.hpp"
#include "io/text.hpp"

namespace livetet {

namespace dicom {

namespace {

namespace fs = std::filesystem;
using gdcm::VR;

/// Reads voxel n of slice k of the derived image.
using ValueAt = std::function<double(int k, std::size_t n)>;

/// Stores the values of a slice as words of the source's format. `stored`: the source's values.
/// Returns the number of values that were clamped.
template <class Word>
std::size_t store(const Slice& slice, std::span<const double> stored, int k,
                  const ValueAt& value_at, char* to) {
    const auto [slope, intercept] = slice.scale;
    const double range = std::ldexp(1.0, slice.format.stored),
                 min_word = slice.format.is_signed ? -range / 2 : 0,
                 max_word = min_word + range - 1;
    std::size_t clamped = 0;
    for (std::size_t n = 0; n < stored.size(); ++n) {
        const double value = value_at(k, n);
        double word = stored[n];
        // Images are read as float.
        if (static_cast<double>(static_cast<float>(slope * word + intercept)) != value) {
            word = std::round((value - intercept) / slope);
            clamped += word < min_word || word > max_word;
            word = std::clamp(word, min_word, max_word);
        }
        const auto bits = static_cast<Word>(static_cast<std::int64_t>(word));  // two's complement
        std::memcpy(to + n * sizeof bits, &bits, sizeof bits);
    }
    return clamped;
}

std::size_t store_words(const Slice& slice, std::span<const double> stored, int k,
                        const ValueAt& value_at, char* to) {
    if (slice.format.allocated == 8) return store<std::uint8_t>(slice, stored, k, value_at, to);
    if (slice.format.allocated == 16) return store<std::uint16_t>(slice, stored, k, value_at, to);
    return store<std::uint32_t>(slice, stored, k, value_at, to);
}

/// The instances that slices first to last come from, each once.
std::vector<DicomInstance> sources_of(const Slices& stack, int first, int last, int reach) {
    std::vector<DicomInstance> sources;
    const Object* before = nullptr;
    const int end = std::min(last + reach + 1, static_cast<int>(stack.slices.size()));
    for (int k = std::max(first - reach, 0); k < end; ++k) {
        if (stack.slices[k].object != before)
            sources.push_back(instance_of(*stack.slices[k].object));
        before = stack.slices[k].object;
    }
    return sources;
}

/// What a child process passes on, a line each.
std::vector<char> packed(const DerivedSeries& series) {
    std::string text = fmt::format("{}\n{}\n", series.clamped, series.series_uid);
    for (const DicomInstance& i : series.instances)
        text += fmt::format("{} {}\n", i.sop_class, i.sop_instance);
    return {text.begin(), text.end()};
}

DerivedSeries derived_series(const std::vector<char>& bytes) {
    const std::string text(bytes.begin(), bytes.end());
    const std::vector<std::string_view> lines = split_lines(text);
    DerivedSeries series;
    series.clamped = parse_index(lines.at(0)).value_or(0);
    series.series_uid = lines.at(1);
    for (std::size_t n = 2; n < lines.size(); ++n)
        if (const auto words = split_words(lines[n]); words.size() == 2)
            series.instances.push_back({std::string(words[0]), std::string(words[1])});
    return series;
}

/// Writes one file of an image: its slices `first` to `last`.
class FileWriter {
  public:
    FileWriter(const fs::path& folder, const fs::path& target, const Slices& stack,
               const DicomDerivation& derivation, ValueAt value_at)
        : folder_(folder),
          target_(target),
          stack_(stack),
          derivation_(derivation),
          value_at_(std::move(value_at)),
          series_(new_series(*stack.slices.front().object, derivation, 1000)) {
        written_.series_uid = series_.uid;
    }

    void write(int first, int last) {
        const Object& source = *stack_.slices[first].object;
        gdcm::DataSet set = copied_header(source);
        const std::vector<DicomInstance> sources =
            sources_of(stack_, first, last, derivation_.slice_reach);
        if (source.is_enhanced())
            put_frame_derivation(set, derivation_, sources);
        else
            put_derivation(set, derivation_, sources);
        put_equipment(set, derivation_);
        const std::string instance = put_instance(set, series_);
        put_pixels(set, source, first, last);
        const std::string name = fmt::format("IM{:04}.dcm", first + 1);
        write_object(folder_ / name, target_ / name, set, syntax_of(source));
        written_.instances.push_back({instance_of(source).sop_class, instance});
    }

    const DerivedSeries& written() const { return written_; }

  private:
    void put_pixels(gdcm::DataSet& set, const Object& source, int first, int last) {
        const PixelFormat& format = stack_.slices[first].format;
        const std::size_t slice_bytes =
            std::size_t(source.size[0]) * source.size[1] * (format.allocated / 8);
        std::vector<char> bytes(slice_bytes * source.frames + slice_bytes * source.frames % 2);
        for (int k = first; k <= last; ++k) {
            const Slice& slice = stack_.slices[k];
            reader_.read(slice, stored_);
            written_.clamped +=
                store_words(slice, stored_, k, value_at_, bytes.data() + slice.frame * slice_bytes);
        }
        put_bytes(set, tag::pixel_data, format.allocated == 8 ? VR::OB : VR::OW, bytes,
                  source.file.string());
    }

    const fs::path &folder_, &target_;
    const Slices& stack_;
    const DicomDerivation& derivation_;
    ValueAt value_at_;
    NewSeries series_;
    SliceReader reader_;
    std::vector<double> stored_;
    DerivedSeries written_;
};

DerivedSeries write_image_files(const fs::path& folder, const fs::path& target,
                                std::span<const Object> objects, const std::string& where,
                                const ImageGrid& grid, const ValueAt& value_at,
                                const DicomDerivation& derivation) {
    const Slices stack = stack_slices(objects, where);
    check_same_grid(grid, stack.grid, where);
    FileWriter writer(folder, target, stack, derivation, value_at);
    const int slices = static_cast<int>(stack.slices.size());
    for (int first = 0, last = 0; first < slices; first = last + 1) {
        last = first;
        while (last + 1 < slices && stack.slices[last + 1].object == stack.slices[first].object)
            ++last;
        writer.write(first, last);
    }
    return writer.written();
}

template <class T>
DerivedSeries write_series(const fs::path& folder, const DicomName& source, const Image<T>& image,
                           const DicomDerivation& derivation) {
    const std::string where = source.place.string();
    PendingFolder pending(folder);
    const std::vector<char> written = through_gdcm(source.place, [&] {
        const std::vector<Object> objects = find_series(source);
        const std::size_t slice = std::size_t(image.size[0]) * image.size[1];
        const auto value_at = [&](int k, std::size_t n) {
            return static_cast<double>(image.values[k * slice + n]);
        };
        if (!objects.front().is_segmentation())
            return packed(write_image_files(pending.path(), folder, objects, where, grid_of(image),
                                            value_at, derivation));
        if constexpr (std::is_same_v<T, std::int32_t>)
            return packed(write_derived_segmentation(pending.path(), folder, objects.front(), image,
                                                     derivation));
        else
            fail(
                "{}: is a segmentation, found interpolated grey values for its voxels, expected "
                "labels (interpolation nearest)",
                objects.front().file.string());
    });
    pending.commit();
    return derived_series(written);
}

}  // namespace

}  // namespace dicom

DerivedSeries write_dicom_series(const std::filesystem::path& folder, const DicomName& source,
                                 const GreyImage& image, const DicomDerivation& derivation) {
    return dicom::write_series(folder, source, image, derivation);
}

DerivedSeries write_dicom_series(const std::filesystem::path& folder, const DicomName& source,
                                 const LabelImage& image, const DicomDerivation& derivation) {
    return dicom::write_series(folder, source, image, derivation);
}

}  // namespace livetet
