#include "io/itk_volume.hpp"

// Else ITK's headers bring an Eigen of their own, and a program may have one.
#define ITK_USE_SYSTEM_EIGEN
#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// The text header of a file: fields that ITK does not pass on or that must be checked before ITK
/// reads the file.
struct Header {
    std::map<std::string, std::string> fields;  ///< by lower-case name
    /// Size of the header in bytes; the voxels start here if they are in the same file.
    std::size_t end = 0;

    const std::string& of(const std::string& name) const {
        static const std::string none;
        const auto found = fields.find(name);
        return found == fields.end() ? none : found->second;
    }
    bool is_true(const std::string& name) const {
        return of(name) == "True" || of(name) == "true" || of(name) == "1";
    }
};

/// Parses `name: value` and `key:=value` up to an empty line (NRRD), or `Name = value` up to
/// ElementDataFile (MetaImage).
Header read_header(const fs::path& path, bool nrrd) {
    const std::string where = path.string();
    check_is_file(path);
    std::ifstream in(path, std::ios::binary);
    if (!in) fail("{}: cannot be read", where);
    Header header;
    constexpr std::size_t max_header_bytes = 1 << 24;
    std::string line;
    for (bool first = true; std::getline(in, line); first = false) {
        header.end += line.size() + (in.eof() ? 0 : 1);
        if (header.end > max_header_bytes) break;
        if (nrrd && first && !line.starts_with("NRRD"))
            fail("{}:1: found '{}', expected NRRD0001 to NRRD0005, as NRRD files begin", where,
                 line.substr(0, 20));
        if (trim(line).empty()) {
            if (nrrd) return header;
            continue;
        }
        if (nrrd && line[0] == '#') continue;
        const std::size_t sign = line.find(nrrd ? ':' : '=');
        if (sign == std::string::npos) {
            // MetaIO would continue beyond the end of the line and take fields from the voxels.
            if (nrrd) continue;
            const bool is_text = std::all_of(line.begin(), line.end(), [](unsigned char c) {
                return std::isprint(c) || std::isspace(c);
            });
            fail("{}: found {}, expected Name = value, as lines of MetaImage's header are", where,
                 is_text ? fmt::format("'{}'", trim(line.substr(0, 60)))
                         : "bytes that are not text");
        }
        // "key:=value" pairs of a NRRD are not its fields; they are stored as "=key".
        const bool pair = nrrd && line[sign + 1] == '=';
        const std::string name =
            (pair ? "=" : "") + lower(trim(std::string_view(line).substr(0, sign)));
        const bool added =
            header.fields.emplace(name, trim(std::string_view(line).substr(sign + (pair ? 2 : 1))))
                .second;
        // Readers disagree on which one counts.
        if (!pair && !added) fail("{}: states '{}' twice", where, name);
        if (!nrrd && line.find(':') < sign)
            fail("{}: found '{}', expected Name = value", where, line.substr(0, 60));
        if (!nrrd && name == "elementdatafile") return header;
    }
    if (nrrd && in.eof() &&
        (header.fields.contains("data file") || header.fields.contains("datafile")))
        return header;
    fail("{}: its header does not end, expected {}: the file is truncated or none of this format",
         where, nrrd ? "a blank line" : "ElementDataFile");
}

/// Position of the voxel data; no file if it is in several files.
struct Data {
    fs::path file;
    std::uint64_t offset = 0;
    bool attached = false;
    enum Coding { raw, deflated, text, hex } coding = raw;
    bool skips = false;  ///< the header requires skipping bytes or lines
};

Data data_of(const fs::path& path, const Header& header, bool nrrd) {
    const std::string where = path.string();
    std::string name = header.of("elementdatafile");
    if (nrrd)
        name = header.fields.contains("data file") ? header.of("data file") : header.of("datafile");
    Data data;
    data.attached = nrrd ? name.empty() : lower(name) == "local";
    if (data.attached) {
        data.file = path;
        data.offset = header.end;
    } else if (name.find('%') != std::string::npos) {
        // MetaIO and NrrdIO pass the name to printf with one integer.
        const std::size_t sign = name.find('%'),
                          letter = name.find_first_not_of("0123456789", sign + 1);
        if (letter == std::string::npos || name[letter] != 'd' || letter - sign > 3 ||
            name.find('%', letter) != std::string::npos)
            fail(
                "{}: its voxels should lie in '{}', expected one %d, such as %03d, where the "
                "number of the file goes",
                where, name);
        for (const std::string_view word : split_words(name))  // MetaIO's buffer has 80 characters
            if (word.size() > 79)
                fail("{}: found {} characters in ElementDataFile's '{}...', expected at most 79",
                     where, word.size(), word.substr(0, 20));
    } else if (!name.starts_with("LIST")) {
        data.file = path.parent_path() / name;
        std::error_code ignored;
        if (!fs::is_regular_file(data.file, ignored))
            fail("{}: its voxels should lie in '{}', which is not there", where,
                 data.file.string());
    }
    if (nrrd) {
        const std::string encoding = lower(header.of("encoding"));
        if (encoding == "gzip" || encoding == "gz")
            data.coding = Data::deflated;
        else if (encoding == "ascii" || encoding == "text" || encoding == "txt")
            data.coding = Data::text;
        else if (encoding == "hex")
            data.coding = Data::hex;
        else if (encoding != "raw")
            fail("{}: its encoding is '{}', expected raw, gzip, ascii or hex", where, encoding);
        for (const char* skip : {"byte skip", "byteskip", "line skip", "lineskip"})
            data.skips |= header.fields.contains(skip) && header.of(skip) != "0";
    } else {
        if (header.is_true("compresseddata"))
            data.coding = Data::deflated;
        else if (header.fields.contains("binarydata") && !header.is_true("binarydata"))
            data.coding = Data::text;
        if (const std::string skipped = header.of("headersize");
            !skipped.empty() && skipped != "0") {
            if (data.attached)
                fail("{}: skips {} bytes (HeaderSize) of its own header, expected none", where,
                     skipped);
            if (const auto bytes = parse_index(skipped))
                data.offset = *bytes;
            else
                data.skips = true;  // -1: the voxels are the last bytes
        }
    }
    return data;
}

/// Decompressed size, counted up to `enough`, of a zlib or gzip stream of `packed_size` bytes at
/// `offset`.
std::uint64_t inflated_size(const Data& data, std::uint64_t packed_size, std::uint64_t enough,
                            const std::string& where) {
    std::ifstream in(data.file, std::ios::binary);
    in.seekg(static_cast<std::streamoff>(data.offset));
    z_stream stream{};
    if (inflateInit2(&stream, 15 + 32) != Z_OK) fail("{}: zlib cannot be started", where);
    const std::unique_ptr<z_stream, int (*)(z_stream*)> guard(&stream, inflateEnd);
    std::vector<char> packed(1 << 16), open(1 << 18);
    std::uint64_t size = 0;
    while (size < enough) {
        if (stream.avail_in == 0) {
            in.read(packed.data(), static_cast<std::streamsize>(
                                       std::min<std::uint64_t>(packed.size(), packed_size)));
            stream.next_in = reinterpret_cast<Bytef*>(packed.data());
            stream.avail_in = static_cast<uInt>(in.gcount());
            packed_size -= stream.avail_in;
            if (stream.avail_in == 0)
                fail("{}: its compressed voxels do not end: the file is truncated", where);
        }
        stream.next_out = reinterpret_cast<Bytef*>(open.data());
        stream.avail_out = static_cast<uInt>(open.size());
        const int status = inflate(&stream, Z_NO_FLUSH);
        size += open.size() - stream.avail_out;
        if (status == Z_STREAM_END) {  // gzip members may be concatenated
            if (size + 1 >= enough ||
                (stream.avail_in == 0 &&
                 (packed_size == 0 || in.peek() == std::ifstream::traits_type::eof())))
                break;
            inflateReset(&stream);
            continue;
        }
        if (status != Z_OK && status != Z_BUF_ERROR)
            fail("{}: its compressed voxels are damaged ({})", where,
                 stream.msg ? stream.msg : "zlib gives no reason");
    }
    return size;
}

/// Checks, before memory is allocated, that the file has `count` voxels of `bytes` in all.
void check_holds(const Data& data, const Header& header, std::uint64_t count, std::uint64_t bytes,
                 const std::string& where) {
    // A list of files: only bound the allocation; ITK reports the file that is missing or short.
    if (data.file.empty()) {
        std::uint64_t all = 0;
        for (const auto& entry :
             fs::directory_iterator(fs::absolute(fs::path(where)).parent_path()))
            if (entry.is_regular_file()) all += entry.file_size();
        constexpr std::uint64_t max_deflated = 1032;
        if (bytes > (data.coding == Data::raw ? all : max_deflated * all))
            fail("{}: found {} bytes in all files beside it, expected {} of voxels", where, all,
                 bytes);
        return;
    }
    const std::uint64_t size = fs::file_size(data.file);
    const std::uint64_t stored = size > data.offset ? size - data.offset : 0;
    std::uint64_t found = stored, expected = bytes;
    const char* kind = "bytes of voxels";
    if (data.coding == Data::deflated) {
        const auto stated = parse_index(header.of("compresseddatasize"));
        if (stated && *stated > stored)
            fail(
                "{}: found {} bytes of compressed voxels, expected CompressedDataSize = {}: the "
                "file is truncated",
                where, stored, *stated);
        found = inflated_size(data, stated ? *stated : stored, bytes + (data.skips ? 0 : 1), where);
    } else if (data.coding == Data::text) {
        if (2 * count > stored + 1)
            fail("{}: found {} bytes of text, expected {} numbers", where, stored, count);
        found = split_words(std::string_view(read_text_file(data.file)).substr(data.offset)).size();
        expected = count;
        kind = "numbers";
    } else if (data.coding == Data::hex) {
        found = stored / 2;
    }
    if (found < expected)
        fail("{}: found {} {}, expected {}: the file is truncated", where, found, kind, expected);
    const bool exact = data.coding == Data::deflated || data.coding == Data::raw;
    if (found > expected && exact && !data.skips)
        fail("{}: found {} or more {}, expected {}: its header gives a wrong size", where, found,
             kind, expected);
}

/// The header's unit in metres; mm if it names none.
double metres_per_unit(const Header& header, bool nrrd, const std::string& where) {
    std::string unit = header.of("distanceunits");
    if (nrrd) {
        const std::string text = header.of("space units");
        for (std::size_t at = 0, end = 0; (at = text.find('"', at)) != std::string::npos;
             at = end + 1) {
            end = text.find('"', at + 1);
            if (end == std::string::npos)
                fail("{}: its space units {} have an open quote", where, text);
            const std::string next = text.substr(at + 1, end - at - 1);
            if (!unit.empty() && next != unit)
                fail("{}: its space units {} differ, expected one", where, text);
            unit = next;
        }
    }
    if (unit.empty() || unit == "mm" || unit == "?") return 1e-3;
    if (unit == "m") return 1;
    if (unit == "cm") return 1e-2;
    if (unit == "um" || unit == "micron") return 1e-6;
    fail("{}: its unit of length is '{}', expected mm, cm, m or um", where, unit);
}

/// Bounds the sizes: ITK stores them in 32 bits and would read past its buffer.
void check_sizes(const std::vector<std::string_view>& sizes, const std::string& where) {
    for (const std::string_view size : sizes)
        if (const auto n = parse_index(size); !n || *n < 1 || *n > 1 << 20)
            fail("{}: has '{}' voxels along an axis, expected 1 to {}", where, size, 1 << 20);
}

void check_nrrd(const Header& header, const std::string& where) {
    const std::string space = lower(header.of("space"));
    if (space.empty() && header.fields.contains("space dimension"))
        fail("{}: names no space, only its dimension; expected space: RAS, LAS or LPS", where);
    constexpr const char* known[] = {
        "",    "right-anterior-superior", "ras", "left-anterior-superior",
        "las", "left-posterior-superior", "lps"};
    if (std::find(std::begin(known), std::end(known), space) == std::end(known))
        fail("{}: its space is '{}', expected RAS, LAS or LPS", where, header.of("space"));
    const auto dimension = parse_index(header.of("dimension"));
    const auto sizes = split_words(header.of("sizes"));
    if (!dimension || *dimension < 1 || *dimension > 16 || sizes.size() != *dimension)
        fail("{}: has dimension '{}' and sizes '{}', expected as many sizes as dimensions", where,
             header.of("dimension"), header.of("sizes"));
    check_sizes(sizes, where);
    if (!header.fields.contains("spacings") && !header.fields.contains("space directions"))
        fail("{}: states no spacing, expected space directions or spacings", where);
    const auto spacings = split_words(header.of("spacings"));
    const auto missing = std::count_if(spacings.begin(), spacings.end(), [](std::string_view s) {
        return !std::isfinite(parse_number(s).value_or(NAN));
    });
    if (missing > static_cast<std::ptrdiff_t>(*dimension) - 3 && missing > 0)
        fail("{}: its spacings are {}, expected a number for each axis", where,
             header.of("spacings"));
    const bool segments = header.fields.contains("=segment0_id");
    if (segments && *dimension == 4 && sizes[0] != "1")
        fail(
            "{}: is a Slicer segmentation of {} layers, whose segments overlap, expected one; in "
            "Slicer's Segmentations module export the segments wanted to a labelmap, and save that",
            where, sizes[0]);
}

void check_meta(const Header& header, const std::string& where) {
    const auto dimension = parse_index(header.of("ndims"));
    if (!dimension || *dimension < 1 || *dimension > 10)
        fail("{}: has NDims = '{}', expected 3", where, header.of("ndims"));
    check_sizes(split_words(header.of("dimsize")), where);
    if (!header.fields.contains("elementspacing") && !header.fields.contains("elementsize"))
        fail("{}: states no spacing, expected ElementSpacing", where);
    for (const auto& [name, value] : header.fields)
        if (name.starts_with("seq_frame"))
            fail("{}: is a sequence of tracked frames, expected one image", where);
    for (const auto& [name, neutral] : {std::pair{"elementtointensityfunctionslope", 1.0},
                                        std::pair{"elementtointensityfunctionoffset", 0.0}})
        if (header.fields.contains(name) && parse_number(header.of(name)) != neutral)
            fail("{}: scales its values ({} = {}), expected values as they are", where, name,
                 header.of(name));
    if (header.is_true("compresseddata") && lower(header.of("elementdatafile")) == "local" &&
        !parse_index(header.of("compresseddatasize")))
        fail("{}: its voxels are compressed but it states no CompressedDataSize", where);
}

ScalarType type_of(const itk::ImageIOBase& io, const std::string& where) {
    using Type = itk::IOComponentEnum;
    switch (io.GetComponentType()) {
        case Type::UCHAR:
            return ScalarType::uint8;
        case Type::CHAR:
            return ScalarType::int8;
        case Type::USHORT:
            return ScalarType::uint16;
        case Type::SHORT:
            return ScalarType::int16;
        case Type::UINT:
            return ScalarType::uint32;
        case Type::INT:
            return ScalarType::int32;
        case Type::ULONG:
            return sizeof(long) == 8 ? ScalarType::uint64 : ScalarType::uint32;
        case Type::LONG:
            return sizeof(long) == 8 ? ScalarType::int64 : ScalarType::int32;
        case Type::ULONGLONG:
            return ScalarType::uint64;
        case Type::LONGLONG:
            return ScalarType::int64;
        case Type::FLOAT:
            return ScalarType::float32;
        case Type::DOUBLE:
            return ScalarType::float64;
        default:
            break;
    }
    fail(
        "{}: has voxels of a type that is not known, expected integers of 8 to 64 bits, float or "
        "double",
        where);
}

/// ras_from_voxel from ITK's axes and origin, which are LPS in the header's unit. For LAS, ITK 5.2
/// negates x instead of y, so the result is RAS. A negative spacing flips its axis.
Eigen::Matrix4d affine_of(const itk::ImageIOBase& io, bool las, double metres) {
    Eigen::Matrix4d affine = Eigen::Matrix4d::Identity();
    const double sign = las ? 1 : -1;
    const Eigen::Vector3d ras_from_itk(sign * metres, sign * metres, metres);
    for (int i = 0; i < 3; ++i) {
        const std::vector<double> axis = io.GetDirection(i);
        for (int k = 0; k < 3; ++k) affine(k, i) = ras_from_itk[k] * axis[k] * io.GetSpacing(i);
        affine(i, 3) = ras_from_itk[i] * io.GetOrigin(i);
    }
    return affine;
}

/// Captures the messages that MetaIO writes to std::cerr, for a one-line Error.
class Hush {
  public:
    Hush() : error_(std::cerr.rdbuf(said_.rdbuf())), out_(std::cout.rdbuf(said_.rdbuf())) {
        itk::Object::GlobalWarningDisplayOff();
    }
    ~Hush() {
        std::cerr.rdbuf(error_);
        std::cout.rdbuf(out_);
        std::cerr.clear();
    }
    Hush(const Hush&) = delete;
    Hush& operator=(const Hush&) = delete;

    /// The first captured line; empty if there was none.
    std::string first() const {
        const std::string said = said_.str();
        for (const auto line : split_lines(said))
            if (!trim(line).empty()) return without_addresses(std::string(trim(line)));
        return {};
    }

  private:
    std::ostringstream said_;
    std::streambuf *error_, *out_;
};

/// The last line of an ITK message is the cause; source locations precede it.
std::string last_line(const std::string& text) {
    std::string last;
    for (const auto line : split_lines(text))
        if (!trim(line).empty()) last = trim(line);
    const std::size_t colon = last.starts_with("[nrrd]") ? last.find(": ") : std::string::npos;
    return without_addresses(colon == std::string::npos ? last : last.substr(colon + 2));
}

enum class Whispers { ignored, errors };

template <class Action>
void through_itk(const std::string& where, Whispers whispers, const Action& action) {
    Hush hush;
    try {
        action();
        if (const std::string said = hush.first(); whispers == Whispers::errors && !said.empty())
            fail("{}: cannot be read: {}", where, said);
    } catch (const Error&) {
        throw;
    } catch (const itk::ExceptionObject& e) {
        const std::string said = hush.first();
        fail("{}: cannot be read: {}", where, said.empty() ? last_line(e.GetDescription()) : said);
    } catch (const std::exception& e) {
        fail("{}: cannot be read: {}", where, last_line(e.what()));
    }
}

bool is_nrrd(const fs::path& path) { return ending(path) == ".nrrd" || ending(path) == ".nhdr"; }

Header checked_header(const fs::path& path) {
    const std::string where = path.string(), end = ending(path);
    if (!is_nrrd(path) && end != ".mha" && end != ".mhd")
        fail(
            "{}: the name ends in '{}', expected an image: .nii, .nii.gz, .nrrd, .nhdr, .mha or "
            ".mhd",
            where, end);
    Header header = read_header(path, is_nrrd(path));
    is_nrrd(path) ? check_nrrd(header, where) : check_meta(header, where);
    return header;
}

}  // namespace

std::optional<fs::path> itk_voxel_file(const fs::path& path) {
    const fs::path file = data_of(path, checked_header(path), is_nrrd(path)).file;
    return file.empty() ? std::nullopt : std::optional(file);
}

Volume read_itk_volume(const fs::path& path) {
    const std::string where = path.string();
    const bool nrrd = is_nrrd(path);
    const Header header = checked_header(path);
    const Data data = data_of(path, header, nrrd);
    const double metres = metres_per_unit(header, nrrd, where);

    itk::ImageIOBase::Pointer io;
    if (nrrd)
        io = itk::NrrdImageIO::New().GetPointer();
    else
        io = itk::MetaImageIO::New().GetPointer();
    through_itk(where, Whispers::ignored, [&] {
        io->SetFileName(where);
        io->ReadImageInformation();
    });
    if (io->GetNumberOfComponents() != 1)
        fail("{}: has {} values a voxel (colours, vectors or layers), expected grey or labels",
             where, io->GetNumberOfComponents());
    if (io->GetNumberOfDimensions() != 3)
        fail("{}: has {} dimensions, expected one image of three", where,
             io->GetNumberOfDimensions());
    Volume volume;
    std::array<std::int64_t, 3> size;
    for (int i = 0; i < 3; ++i) size[i] = static_cast<std::int64_t>(io->GetDimensions(i));
    const std::size_t count = checked_voxel_count(size, where);
    for (int i = 0; i < 3; ++i) volume.size[i] = static_cast<int>(size[i]);
    const std::string space = lower(header.of("space"));
    volume.ras_from_voxel =
        affine_of(*io, space == "las" || space == "left-anterior-superior", metres);
    check_spans_space(volume.ras_from_voxel, where,
                      nrrd ? "space directions" : "TransformMatrix and ElementSpacing");
    volume.type = type_of(*io, where);
    check_holds(data, header, count, count * bytes_of(volume.type), where);

    volume.bytes.resize(count * bytes_of(volume.type));
    itk::ImageIORegion region(3);
    for (int i = 0; i < 3; ++i) region.SetSize(i, static_cast<itk::SizeValueType>(size[i]));
    // The size of voxels in several files was not checked, and MetaIO only prints a warning if one
    // is short.
    through_itk(where, data.file.empty() || data.skips ? Whispers::errors : Whispers::ignored, [&] {
        io->SetIORegion(region);
        io->Read(volume.bytes.data());
    });
    return volume;
}

}  // namespace livetet
