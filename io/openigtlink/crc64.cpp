#include "io/openigtlink/crc64.hpp"

#include <array>

namespace livetet::igtl {

namespace {

constexpr std::uint64_t polynomial = 0x42F0E1EBA9EA3693;

constexpr std::array<std::uint64_t, 256> table = [] {
    std::array<std::uint64_t, 256> remainders{};
    for (std::uint64_t byte = 0; byte < 256; ++byte) {
        std::uint64_t crc = byte << 56;
        for (int bit = 0; bit < 8; ++bit) crc = crc << 1 ^ (crc >> 63 ? polynomial : 0);
        remainders[byte] = crc;
    }
    return remainders;
}();

}  // namespace

std::uint64_t crc64(std::span<const std::uint8_t> bytes, std::uint64_t crc) {
    for (const std::uint8_t byte : bytes) crc = crc << 8 ^ table[crc >> 56 ^ byte];
    return crc;
}

}  // namespace livetet::igtl
