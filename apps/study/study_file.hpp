#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/study/study.hpp"
#include "apps/study/study_solve.hpp"
#include "base/progress.hpp"
#include "io/hdf5.hpp"

namespace livetet {

/// The file's name of a solve: "000123".
std::string number_of(std::size_t solve);

/// Writes the result of a study: an HDF5 file, its XDMF and its CSV. `row` gives a solve's result.
/// `/inputs` and `/outputs` have a row for each solve and a column for each name in the texts
/// "input_names" and "output_names" (JSON). Inputs that are no numbers are NaN there; the text
/// "inputs" has all values as given. Further: `/converged`, `/work` (iterations, linearisations,
/// steps), `/histories/000123`, `/displacement/000123`, `/meshes/0`, and the texts "failures",
/// "study", "scene", "versions", "fingerprint". What differs between two runs is in `/times` alone:
/// `/times/solves` (mesh, set-up, solve) and `/times/steps/000123`, s. Each file is written
/// completely or not at all. Throws Error if that fails.
void write_study(const Study& study, const std::string& fingerprint,
                 const std::function<StudyRow(std::size_t)>& row, const ProgressCallback& progress);

/// The table of a study, for summary and pictures.
struct StudyTable {
    std::vector<std::string> inputs, outputs;
    std::vector<std::vector<std::string>> values;  ///< of the inputs, for each solve
    std::vector<std::vector<double>> results;      ///< of the outputs, for each solve; NaN: none
    std::vector<std::string> failures;             ///< empty: converged
    std::vector<double> seconds;
};

/// Reads what `write_study` wrote.
class StudyFile {
  public:
    /// Throws Error if it cannot be read.
    explicit StudyFile(const std::filesystem::path& path);
    std::string fingerprint() const;
    /// Throws Error if it is damaged.
    StudyTable table() const;
    /// The result of solve k, of this file's table. Throws Error likewise.
    StudyRow row(const StudyTable& table, std::size_t k) const;

  private:
    hdf5::File file_;
};

}  // namespace livetet
