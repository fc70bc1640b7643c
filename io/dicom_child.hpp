#pragma once

#include <filesystem>
#include <functional>
#include <vector>

namespace livetet {

/// Calls `use`, which reads the DICOM input at `place` by GDCM, in a child process, and returns
/// what it returns. Damaged files can do no harm beyond that process, whose memory and time are
/// limited by the sizes of the files there. GDCM's own messages, which may quote the file, are not
/// passed on. Throws the Error that `use` throws.
std::vector<char> through_gdcm(const std::filesystem::path& place,
                               const std::function<std::vector<char>()>& use);

/// The largest number of bytes that the limits grow with: beyond it they (35 minutes, 102 GiB) are
/// enough for any series.
inline constexpr std::uintmax_t max_counted_bytes = std::uintmax_t(1) << 30;

}  // namespace livetet
