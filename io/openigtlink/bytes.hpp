#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/error.hpp"

namespace livetet::igtl {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// Whether a text has control characters, which could affect a terminal.
inline bool holds_controls(std::string_view text) {
    return std::any_of(text.begin(), text.end(),
                       [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

template <class T>
concept Number = std::integral<T> || std::floating_point<T>;

template <Number T>
using BitsOf = std::conditional_t<
    sizeof(T) == 1, std::uint8_t,
    std::conditional_t<sizeof(T) == 2, std::uint16_t,
                       std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;

/// Reads big-endian values from the front of a byte range. Every request is checked against the
/// remaining bytes before anything is allocated. Throws Error, naming `what`, if too few bytes are
/// left.
///
/// ByteReader and ByteWriter have the same member functions, so one declaration of a message's
/// fields serves both directions.
class ByteReader {
  public:
    static constexpr bool reading = true;

    ByteReader(ByteView bytes, std::string_view what) : bytes_(bytes), what_(what) {}

    std::size_t left() const { return bytes_.size(); }
    const std::string& what() const { return what_; }

    /// The next `size` bytes.
    ByteView take(std::uint64_t size) {
        if (size > left()) fail("{}: {} bytes are left, expected {} more", what_, left(), size);
        const ByteView taken = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        return taken;
    }
    template <Number T>
    void operator()(T& value) {
        BitsOf<T> bits = 0;
        for (const std::uint8_t byte : take(sizeof(T)))
            bits = static_cast<BitsOf<T>>(bits << (sizeof(T) > 1 ? 8 : 0) | byte);
        value = std::bit_cast<T>(bits);
    }
    template <class T, std::size_t n>
    void operator()(std::array<T, n>& values) {
        for (T& value : values) (*this)(value);
    }
    template <Number T>
    T number() {
        T value{};
        (*this)(value);
        return value;
    }
    /// `count` values.
    template <class T>
    void numbers(std::vector<T>& values, std::uint64_t count) {
        if (count > left() / sizeof(T))
            fail("{}: {} bytes are left, expected {} values of {}", what_, left(), count,
                 sizeof(T));
        values.resize(count);
        for (T& value : values) (*this)(value);
    }
    /// A name in a field of `width` bytes, ended by the first NUL if there is one. Throws Error for
    /// control characters.
    void name(std::string& text, std::size_t width) {
        const ByteView field = take(width);
        text.assign(field.begin(), std::find(field.begin(), field.end(), 0));
        if (holds_controls(text)) fail("{}: a name holds control characters, expected text", what_);
    }
    void text(std::string& text, std::uint64_t size) {
        const ByteView field = take(size);
        text.assign(field.begin(), field.end());
    }
    /// Text preceded by its length, of type `Length`.
    template <std::unsigned_integral Length>
    void counted_text(std::string& value) {
        text(value, number<Length>());
    }
    void bytes(Bytes& values, std::uint64_t size) {
        const ByteView field = take(size);
        values.assign(field.begin(), field.end());
    }
    void unused(std::size_t size) { take(size); }
    /// Elements up to the end of the content, each read by `fields`.
    template <class T, class F>
    void rest(std::vector<T>& elements, F&& fields) {
        elements.clear();
        while (left() > 0) fields(elements.emplace_back());
    }
    void end() const {
        if (left() > 0) fail("{}: {} bytes too many behind the content", what_, left());
    }

  private:
    ByteView bytes_;
    std::string what_;
};

/// Appends big-endian values to `bytes()`. Throws Error if a value does not fit its field.
class ByteWriter {
  public:
    static constexpr bool reading = false;

    explicit ByteWriter(std::string_view what) : what_(what) {}

    const Bytes& bytes() const { return bytes_; }
    Bytes take() { return std::move(bytes_); }
    const std::string& what() const { return what_; }

    template <Number T>
    void operator()(T value) {
        const auto bits = std::bit_cast<BitsOf<T>>(value);
        for (int byte = sizeof(T) - 1; byte >= 0; --byte)
            bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * byte)));
    }
    template <class T, std::size_t n>
    void operator()(const std::array<T, n>& values) {
        for (const T& value : values) (*this)(value);
    }
    /// Writes `value` as a T. Throws Error if it is too large.
    template <std::unsigned_integral T>
    void count(std::uint64_t value) {
        if (value > std::numeric_limits<T>::max())
            fail("{}: {} is too much for a field of {} bytes", what_, value, sizeof(T));
        (*this)(static_cast<T>(value));
    }
    template <class T>
    void numbers(const std::vector<T>& values, std::uint64_t) {
        for (const T& value : values) (*this)(value);
    }
    void name(std::string_view value, std::size_t width) {
        if (value.size() > width)
            fail("{}: '{}' has {} bytes, expected at most {}", what_, value, value.size(), width);
        text(value, value.size());
        unused(width - value.size());
    }
    void text(std::string_view value, std::uint64_t) {
        bytes_.insert(bytes_.end(), value.begin(), value.end());
    }
    template <std::unsigned_integral Length>
    void counted_text(std::string_view value) {
        count<Length>(value.size());
        text(value, value.size());
    }
    void bytes(const Bytes& values, std::uint64_t) {
        bytes_.insert(bytes_.end(), values.begin(), values.end());
    }
    void unused(std::size_t size) { bytes_.resize(bytes_.size() + size); }
    template <class T, class F>
    void rest(const std::vector<T>& elements, F&& fields) {
        for (const T& element : elements) fields(element);
    }

  private:
    Bytes bytes_;
    std::string what_;
};

}  // namespace livetet::igtl
