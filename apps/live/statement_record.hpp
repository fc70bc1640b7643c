#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
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
//   surface_radius_95_mm      1 number a place of the surface
//   surface_missing           the sources that these lack, as bits
// the text `targets`, a list of names, and the rows `surface_places_mm`, 3 numbers a place. A scene
// without targets writes none of them. Older results hold nothing of the surface.

/// Names of targets as the text `targets`.
std::string text_of_targets(const std::vector<std::string>& names);

/// Writes the places of the statements' surface, at rest, m.
void write_surface_places(ResultWriter& result, std::span<const Vector3> places);

/// Adds a statement to the frame last appended.
void append_statement(ResultWriter& result, const FrameStatement& statement);

/// Whether frame k of a result holds this statement to the bit; also if neither has targets.
bool holds_statement(const ResultReader& result, std::size_t k, const FrameStatement& statement);

/// Reads the statements of a result.
class StatementReader {
  public:
    /// Throws Error, naming `source`, if the names are not a list of texts, or if the places of the
    /// surface are none, too many or not finite.
    StatementReader(const ResultReader& reader, std::string source);

    const std::vector<std::string>& names() const { return names_; }
    /// Of the surface, at rest, m; none without targets.
    const std::vector<Vector3>& surface_places() const { return surface_places_; }
    /// The statement of frame k; without targets if there are none. Throws Error if a number is
    /// not finite or not possible.
    FrameStatement read(std::size_t k) const;

  private:
    std::vector<double> values(const char* name, std::size_t k, std::size_t count) const;
    double at_least_0(const char* name, std::size_t k, double value) const;
    std::vector<double> radii(const char* name, std::size_t k, std::size_t count) const;
    ErrorSources sources_of(double bits, std::size_t k) const;

    const ResultReader& reader_;
    std::string source_;
    std::vector<std::string> names_;
    std::vector<Vector3> surface_places_;
};

/// A statement for OpenIGTLink's `LivetetFrame` and other programs: position, covariance, radius
/// and sources of each target, in mm, and what is missing.
nlohmann::json json_of(const FrameStatement& statement, const std::vector<std::string>& names);

/// "error within 3.1 mm (Tumour), without elements": the target with the largest radius, and the
/// sources that are not in it; empty without targets.
std::string statement_text(const FrameStatement& statement, const std::vector<std::string>& names);

}  // namespace livetet
