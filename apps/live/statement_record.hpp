#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/error_statement.hpp"
#include "io/result_file.hpp"

namespace livetet {

// Statements in a result file: for each frame the values
//   target_position_mm        3 numbers a target
//   target_radius_95_mm       1
//   target_covariance_mm2     6: xx, xy, xz, yy, yz, zz
//   target_by_source_mm2      one for each ErrorSource
//   statement                 the missing sources as bits, the share of responses that is known
// and the text `targets`, a list of names. A scene without targets writes none of them.

/// Names of targets as the text `targets`.
std::string text_of_targets(const std::vector<std::string>& names);

/// Adds a statement to the frame last appended.
void append_statement(ResultWriter& result, const FrameStatement& statement);

/// Whether frame k of a result holds this statement to the bit; also if neither has targets.
bool holds_statement(const ResultReader& result, std::size_t k, const FrameStatement& statement);

/// Reads the statements of a result.
class StatementReader {
  public:
    /// Throws Error, naming `source`, if the names are not a list of texts.
    StatementReader(const ResultReader& reader, std::string source);

    const std::vector<std::string>& names() const { return names_; }
    /// The statement of frame k; without targets if there are none. Throws Error if a number is
    /// not finite or not possible.
    FrameStatement read(std::size_t k) const;

  private:
    const ResultReader& reader_;
    std::string source_;
    std::vector<std::string> names_;
};

/// A statement for OpenIGTLink's `LivetetFrame` and other programs: position, covariance, radius
/// and sources of each target, in mm, and what is missing.
nlohmann::json json_of(const FrameStatement& statement, const std::vector<std::string>& names);

/// "error within 3.1 mm (Tumour), without elements": the target with the largest radius, and the
/// sources that are not in it; empty without targets.
std::string statement_text(const FrameStatement& statement, const std::vector<std::string>& names);

}  // namespace livetet
