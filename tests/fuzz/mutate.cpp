#include "fuzz/mutate.hpp"

#include <algorithm>
#include <string_view>

namespace livetet::fuzz {

namespace {

class Mutator {
  public:
    Mutator(const std::vector<Bytes>& seeds, std::mt19937_64& random)
        : seeds_(seeds), random_(random) {}

    Bytes mutated() {
        bytes_ = seeds_[below(seeds_.size())];
        for (std::size_t changes = std::size_t(1) << below(5); changes > 0; --changes) change();
        return std::move(bytes_);
    }

  private:
    std::size_t below(std::size_t end) { return end == 0 ? 0 : random_() % end; }
    /// A position, often near the front, where headers are.
    std::size_t place() {
        return below(2) ? below(std::min<std::size_t>(bytes_.size(), 512)) : below(bytes_.size());
    }

    void change() {
        if (bytes_.empty()) return put(0, seeds_[below(seeds_.size())]);
        switch (below(9)) {
            case 0:
                bytes_[place()] ^= static_cast<std::uint8_t>(1 << below(8));
                return;
            case 1:
                bytes_[place()] = static_cast<std::uint8_t>(random_());
                return;
            case 2:
                return extreme_integer();
            case 3:
                return extreme_word();
            case 4:
                return cut();
            case 5:
                return put(place(), piece_of(bytes_));
            case 6:
                return put(place(), piece_of(seeds_[below(seeds_.size())]));
            case 7:
                return bytes_.resize(below(bytes_.size()) + 1);
            default:
                return shift_integer();
        }
    }
    void extreme_integer() {
        constexpr std::uint64_t values[] = {0,
                                            1,
                                            0x7f,
                                            0x80,
                                            0xff,
                                            0x7fff,
                                            0x8000,
                                            0xffff,
                                            0x7fffffff,
                                            0x80000000,
                                            0xffffffff,
                                            0x3fffffff,
                                            0x7ff0000000000000,
                                            0x7fffffffffffffff,
                                            ~0ull};
        write(values[below(std::size(values))]);
    }
    /// Adds a small number to an integer.
    void shift_integer() {
        bytes_[place()] += static_cast<std::uint8_t>(below(2) ? 1 + below(4) : 255 - below(4));
    }
    void write(std::uint64_t value) {
        const std::size_t size = std::size_t(1) << below(4), at = place();
        const bool big_endian = below(2);
        for (std::size_t i = 0; i < size && at + i < bytes_.size(); ++i)
            bytes_[at + i] =
                static_cast<std::uint8_t>(value >> (8 * (big_endian ? size - 1 - i : i)));
    }
    /// Replaces a number in a text.
    void extreme_word() {
        constexpr std::string_view words[] = {
            "nan",        "-1",         "0",   "1e308", "-1e400", "99999999999",
            "4294967296", "2147483647", "inf", "",      "1e-320", "0x10",
            "null",       "[]",         "{}",  "\"\"",  "-0"};
        const auto is_digit = [](std::uint8_t c) {
            return (c >= '0' && c <= '9') || c == '.' || c == '-';
        };
        const auto first = std::find_if(bytes_.begin() + place(), bytes_.end(), is_digit);
        const auto last = std::find_if_not(first, bytes_.end(), is_digit);
        const std::size_t at = first - bytes_.begin();
        bytes_.erase(first, last);
        const std::string_view word = words[below(std::size(words))];
        put(at, {word.begin(), word.end()});
    }
    void cut() {
        const std::size_t at = place(),
                          size = below(std::min<std::size_t>(bytes_.size() - at, 64)) + 1;
        bytes_.erase(bytes_.begin() + at, bytes_.begin() + at + size);
    }
    Bytes piece_of(const Bytes& from) {
        if (from.empty()) return {};
        const std::size_t at = below(from.size());
        return {from.begin() + at,
                from.begin() + at + below(std::min<std::size_t>(from.size() - at, 256)) + 1};
    }
    void put(std::size_t at, const Bytes& piece) {
        bytes_.insert(bytes_.begin() + at, piece.begin(), piece.end());
    }

    const std::vector<Bytes>& seeds_;
    std::mt19937_64& random_;
    Bytes bytes_;
};

}  // namespace

Bytes mutated(const std::vector<Bytes>& seeds, std::mt19937_64& random) {
    return Mutator(seeds, random).mutated();
}

}  // namespace livetet::fuzz
