#include "io/ply_check.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

using Words = std::vector<std::string_view>;

struct Property {
    std::size_t count_bytes, bytes;  ///< size of a list's length (0: no list) and of a value
};

struct Element {
    std::string_view name;
    std::size_t rows = 0;
    std::vector<Property> properties;
};

std::optional<std::size_t> bytes_of(std::string_view type) {
    for (const auto& [bytes, names] :
         {std::pair<std::size_t, const char*>{1, " char uchar int8 uint8 "},
          {2, " short ushort int16 uint16 "},
          {4, " int uint int32 uint32 float float32 "},
          {8, " double float64 "}})
        if (std::string(names).find(fmt::format(" {} ", type)) != std::string::npos) return bytes;
    return std::nullopt;
}

class PlyFile {
  public:
    explicit PlyFile(const std::filesystem::path& path)
        : where_(path.string()), text_(read_text_file(path)) {
        left_ = text_;
        if (next_line() != Words{"ply"}) fail("{}:1: does not begin with ply", where_);
        for (Words words = next_line(); words != Words{"end_header"}; words = next_line())
            if (!take_header_line(words))
                fail("{}:{}: is not a line of a PLY header", where_, line_);
        if (format_ == "ascii") words_ = split_words(left_);
    }

    void step_over_rows() {
        for (const Element& element : elements_)
            for (std::size_t row = 0; row < element.rows && !element.properties.empty(); ++row)
                for (const Property& property : element.properties)
                    if (const auto values =
                            property.count_bytes > 0 ? take_count(property.count_bytes) : 1;
                        !values || !skip(*values, property.bytes))
                        fail("{}: ends in '{}' {} of {}: the file is truncated", where_,
                             element.name, row, element.rows);
    }

  private:
    Words next_line() {
        ++line_;
        const std::size_t end = left_.find('\n');
        if (end == left_.npos) fail("{}:{}: its header does not end: truncated", where_, line_);
        Words words = split_words(left_.substr(0, end));
        left_.remove_prefix(end + 1);
        return words;
    }

    bool take_header_line(const Words& words) {
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return true;
        if (words[0] == "format" && words.size() == 3) {
            format_ = words[1];
            return format_ == "ascii" || format_ == "binary_little_endian" ||
                   format_ == "binary_big_endian";
        }
        if (words[0] == "element" && words.size() == 3) {
            const auto rows = parse_index(words[2]);
            elements_.push_back({words[1], rows.value_or(0), {}});
            return rows.has_value();
        }
        if (words[0] != "property" || elements_.empty()) return false;
        const bool list = words.size() == 5 && words[1] == "list";
        if (!list && words.size() != 3) return false;
        const auto count_bytes = list ? bytes_of(words[2]) : 0,
                   bytes = bytes_of(words[list ? 3 : 1]);
        if (!count_bytes || !bytes) return false;
        elements_.back().properties.push_back({*count_bytes, *bytes});
        return true;
    }

    /// Length of a list; nothing at the end of the file.
    std::optional<std::size_t> take_count(std::size_t bytes) {
        if (format_ == "ascii")
            return at_ < words_.size() ? parse_index(words_[at_++]) : std::nullopt;
        if (bytes > left_.size() || bytes > 4) return std::nullopt;
        std::size_t count = 0;
        for (std::size_t i = 0; i < bytes; ++i) {
            const std::size_t place = format_ == "binary_little_endian" ? i : bytes - 1 - i;
            count |= std::size_t(static_cast<unsigned char>(left_[i])) << 8 * place;
        }
        left_.remove_prefix(bytes);
        return count;
    }

    bool skip(std::size_t values, std::size_t bytes) {
        if (format_ == "ascii") {
            if (values > words_.size() - at_) return false;
            at_ += values;
            return true;
        }
        if (values > left_.size() / bytes) return false;
        left_.remove_prefix(values * bytes);
        return true;
    }

    std::string where_, text_;
    std::string_view left_, format_;
    std::size_t line_ = 0, at_ = 0;
    Words words_;
    std::vector<Element> elements_;
};

}  // namespace

void check_ply_is_whole(const std::filesystem::path& path) { PlyFile(path).step_over_rows(); }

}  // namespace livetet
