#pragma once

#include <cstdint>
#include <span>

namespace livetet::igtl {

/// CRC-64 of ECMA-182 as OpenIGTLink uses it: polynomial 0x42F0E1EBA9EA3693, most significant bit
/// first, initial value 0, no final exclusive or. `crc` continues from preceding bytes.
std::uint64_t crc64(std::span<const std::uint8_t> bytes, std::uint64_t crc = 0);

}  // namespace livetet::igtl
