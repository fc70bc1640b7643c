#include "io/dicom_dataset.hpp"

#include <gdcmByteValue.h>

#include <cstring>
#include <limits>

#include "io/text.hpp"

namespace livetet::dicom {

namespace {

constexpr std::size_t max_text = 4096;

/// The bytes of an element; null if it is missing, empty or a sequence.
const gdcm::ByteValue* bytes_of_element(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    if (!set.FindDataElement(tag)) return nullptr;
    const gdcm::ByteValue* bytes = set.GetDataElement(tag).GetByteValue();
    return bytes && bytes->GetPointer() ? bytes : nullptr;
}

}  // namespace

std::string text_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    const gdcm::ByteValue* bytes = bytes_of_element(set, tag);
    if (!bytes || bytes->GetLength() > max_text) return {};
    std::string text(bytes->GetPointer(), bytes->GetLength());
    text.resize(std::min(text.size(), text.find('\0')));
    return std::string(trim(text));
}

std::vector<double> numbers_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    const std::string text = text_of(set, tag);
    std::vector<double> numbers;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\\', at), text.size());
        numbers.push_back(parse_number(trim(std::string_view(text).substr(at, end - at)))
                              .value_or(std::numeric_limits<double>::quiet_NaN()));
        at = end + 1;
    }
    return numbers;
}

std::optional<double> number_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    const std::vector<double> numbers = numbers_of(set, tag);
    return numbers.empty() ? std::nullopt : std::optional(numbers.front());
}

std::vector<int> integers_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    const gdcm::ByteValue* bytes = bytes_of_element(set, tag);
    std::vector<int> values;
    std::uint16_t value = 0;
    for (std::size_t at = 0; bytes && at + sizeof value <= bytes->GetLength(); at += sizeof value) {
        std::memcpy(&value, bytes->GetPointer() + at, sizeof value);
        values.push_back(value);
    }
    return values;
}

std::optional<int> integer_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    const std::vector<int> values = integers_of(set, tag);
    return values.empty() ? std::nullopt : std::optional(values.front());
}

Sequence sequence_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    if (!set.FindDataElement(tag)) return {};
    return set.GetDataElement(tag).GetValueAsSQ();
}

std::size_t item_count(const Sequence& sequence) {
    return sequence ? sequence->GetNumberOfItems() : 0;
}

std::vector<gdcm::DataSet> items_of(const gdcm::DataSet& set, const gdcm::Tag& tag) {
    const Sequence sequence = sequence_of(set, tag);
    std::vector<gdcm::DataSet> items;
    for (std::size_t n = 0; n < item_count(sequence); ++n) items.push_back(item_of(sequence, n));
    return items;
}

const gdcm::DataSet& item_of(const Sequence& sequence, std::size_t n) {
    return static_cast<const gdcm::SequenceOfItems&>(*sequence).GetItem(n + 1).GetNestedDataSet();
}

}  // namespace livetet::dicom
