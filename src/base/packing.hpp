#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace livetet {

/// Serialises arrays of plain values, each preceded by its length: the result a child process sends
/// to its parent.
class Packer {
  public:
    template <class T>
    void add(const std::vector<T>& values) {
        add_bytes(values.data(), values.size(), sizeof(T));
    }
    void add(const std::string& text) { add_bytes(text.data(), text.size(), 1); }
    void add_count(std::uint64_t count) { add_bytes(nullptr, count, 0); }
    std::vector<char> take_bytes() { return std::move(bytes_); }

  private:
    void add_bytes(const void* data, std::uint64_t count, std::size_t size) {
        const auto append = [&](const void* from, std::size_t n) {
            const char* at = static_cast<const char*>(from);
            bytes_.insert(bytes_.end(), at, at + n);
        };
        append(&count, sizeof count);
        if (count * size > 0) append(data, count * size);
    }

    std::vector<char> bytes_;
};

/// Reads back the values of a Packer in the same order. Throws Error, naming the sender `who`, if
/// bytes are missing.
class Unpacker {
  public:
    Unpacker(std::span<const char> bytes, std::string who) : left_(bytes), who_(std::move(who)) {}

    template <class T>
    std::vector<T> take() {
        const std::uint64_t count = take_count();
        need(count, sizeof(T));
        std::vector<T> values(count);
        if (count > 0)
            std::memcpy(static_cast<void*>(values.data()), left_.data(), count * sizeof(T));
        left_ = left_.subspan(count * sizeof(T));
        return values;
    }
    std::string take_text() {
        const std::vector<char> text = take<char>();
        return {text.begin(), text.end()};
    }
    std::uint64_t take_count() {
        std::uint64_t count = 0;
        need(1, sizeof count);
        std::memcpy(&count, left_.data(), sizeof count);
        left_ = left_.subspan(sizeof count);
        return count;
    }
    /// Throws Error if bytes are left over.
    void finish() const {
        if (!left_.empty()) fail("{}: its result has {} bytes too many", who_, left_.size());
    }

  private:
    void need(std::uint64_t count, std::size_t size) const {
        if (count > left_.size() / size)
            fail("{}: its result ends after {} bytes, expected {} values of {}", who_, left_.size(),
                 count, size);
    }

    std::span<const char> left_;
    std::string who_;
};

}  // namespace livetet
