#pragma once

#include <filesystem>

namespace livetet {

/// Reads a result of `livetet track`; writes report.txt, report.json and the pictures to the folder
/// RESULT.report beside it, and the JSON to `json` if that is not empty; prints the text. Throws
/// Error if that fails.
void report_result(const std::filesystem::path& result, const std::filesystem::path& json);

}  // namespace livetet
