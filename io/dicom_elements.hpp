#pragma once

#include <gdcmDataSet.h>
#include <gdcmTag.h>
#include <gdcmVR.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

/// Sets elements of DICOM objects that are written, and writes these.
namespace livetet::dicom {

/// Sets an element of text (CS, DA, DS, IS, LO, ST, TM, UI and so on). Values are separated by '\'.
void put_text(gdcm::DataSet& set, const gdcm::Tag& tag, gdcm::VR vr, std::string text);

/// Sets an element of one 16-bit integer (US).
void put_integer(gdcm::DataSet& set, const gdcm::Tag& tag, std::uint16_t value);

/// Sets an element of binary values (FD, OB, OF, OW, UL), little-endian as this machine is. Throws
/// Error, naming `where`, above the 4 GiB that an element may have.
void put_bytes(gdcm::DataSet& set, const gdcm::Tag& tag, gdcm::VR vr, std::span<const char> bytes,
               const std::string& where);

/// Sets a sequence; no items: an empty one.
void put_items(gdcm::DataSet& set, const gdcm::Tag& tag, const std::vector<gdcm::DataSet>& items);

/// A coded concept (DICOM PS3.3, table 8.8-1).
struct Code {
    const char *value, *meaning;
    const char* scheme = "DCM";  ///< DICOM PS3.16, annex D
};

/// Sets a sequence of this one concept.
void put_code(gdcm::DataSet& set, const gdcm::Tag& tag, const Code& code);

/// Numbers as decimal strings of at most 16 characters each, separated by '\'.
std::string decimal_strings(std::span<const double> numbers);

/// A new unique identifier below the root 2.25: a random UUID as a decimal number (DICOM PS3.5,
/// B.2). Nobody has to register that root.
std::string new_uid();

/// The time now in the formats DA and TM.
struct DateTime {
    std::string date, time;
};
DateTime date_time_now();

/// How elements of a written file state their types.
enum class Syntax { explicit_types, implicit_types };

/// Writes an object, little-endian and uncompressed. Its SOP Class UID and SOP Instance UID must be
/// set. `target`: the file's name in messages. Throws Error if the file cannot be written.
void write_object(const std::filesystem::path& file, const std::filesystem::path& target,
                  const gdcm::DataSet& object, Syntax syntax);

}  // namespace livetet::dicom
