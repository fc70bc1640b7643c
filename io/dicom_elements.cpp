#include "io/dicom_elements.hpp"

#include <fmt/chrono.h>
#include <gdcmFile.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmUIDGenerator.h>
#include <gdcmWriter.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <limits>
#include <sstream>

#include "base/error.hpp"
#include "io/dicom_dataset.hpp"

namespace livetet::dicom {

void put_text(gdcm::DataSet& set, const gdcm::Tag& tag, gdcm::VR vr, std::string text) {
    if (text.size() % 2 != 0) text += vr == gdcm::VR::UI ? '\0' : ' ';
    gdcm::DataElement element(tag);
    element.SetVR(vr);
    element.SetByteValue(text.data(), gdcm::VL(static_cast<std::uint32_t>(text.size())));
    set.Replace(element);
}

void put_integer(gdcm::DataSet& set, const gdcm::Tag& tag, std::uint16_t value) {
    put_bytes(set, tag, gdcm::VR::US, {reinterpret_cast<const char*>(&value), sizeof value}, "");
}

void put_bytes(gdcm::DataSet& set, const gdcm::Tag& tag, gdcm::VR vr, std::span<const char> bytes,
               const std::string& where) {
    constexpr std::size_t max_bytes = std::numeric_limits<std::uint32_t>::max() - 1;  // even
    if (bytes.size() > max_bytes)
        fail("{}: has {} bytes, expected at most {} in one element of DICOM", where, bytes.size(),
             max_bytes);
    gdcm::DataElement element(tag);
    element.SetVR(vr);
    element.SetByteValue(bytes.data(), gdcm::VL(static_cast<std::uint32_t>(bytes.size())));
    set.Replace(element);
}

void put_items(gdcm::DataSet& set, const gdcm::Tag& tag, const std::vector<gdcm::DataSet>& items) {
    const gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
    sequence->SetLengthToUndefined();
    for (const gdcm::DataSet& elements : items) {
        gdcm::Item item;
        item.SetVLToUndefined();
        item.SetNestedDataSet(elements);
        sequence->AddItem(item);
    }
    gdcm::DataElement element(tag);
    element.SetVR(gdcm::VR::SQ);
    element.SetValue(*sequence);
    element.SetVLToUndefined();
    set.Replace(element);
}

void put_code(gdcm::DataSet& set, const gdcm::Tag& tag, const Code& code) {
    gdcm::DataSet item;
    put_text(item, tag::code_value, gdcm::VR::SH, code.value);
    put_text(item, tag::coding_scheme_designator, gdcm::VR::SH, code.scheme);
    put_text(item, tag::code_meaning, gdcm::VR::LO, code.meaning);
    put_items(set, tag, {item});
}

std::string decimal_strings(std::span<const double> numbers) {
    std::string text;
    for (const double number : numbers) {
        std::string digits;
        for (int precision = 14; precision > 0; --precision) {  // the sign and "e-05" need room
            digits = fmt::format("{:.{}g}", number + 0.0, precision);
            if (digits.size() <= 16) break;
        }
        text += (text.empty() ? "" : "\\") + digits;
    }
    return text;
}

std::string new_uid() {
    gdcm::UIDGenerator::SetRoot("2.25");
    gdcm::UIDGenerator generator;
    return generator.Generate();
}

DateTime date_time_now() {
    const std::tm now = fmt::localtime(std::time(nullptr));
    return {fmt::format("{:%Y%m%d}", now), fmt::format("{:%H%M%S}", now)};
}

void write_object(const std::filesystem::path& file, const std::filesystem::path& target,
                  const gdcm::DataSet& object, Syntax syntax) {
    gdcm::Writer writer;
    writer.GetFile().GetDataSet() = object;
    writer.GetFile().GetHeader().SetDataSetTransferSyntax(
        syntax == Syntax::explicit_types ? gdcm::TransferSyntax::ExplicitVRLittleEndian
                                         : gdcm::TransferSyntax::ImplicitVRLittleEndian);
    std::ostringstream bytes;  // GDCM ends the process if a stream fails
    writer.SetStream(bytes);
    if (!writer.Write())
        fail("{}: cannot be written, elements of its source are no valid DICOM", target.string());
    std::ofstream out(file, std::ios::binary);
    out << bytes.view();
    out.close();
    if (!out) fail("{}: cannot be written (is the disk full?)", target.string());
}

}  // namespace livetet::dicom
