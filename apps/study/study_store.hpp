#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/study/study.hpp"
#include "apps/study/study_solve.hpp"

namespace livetet {

/// Where a study's rows are kept while it runs: the folder `OUTPUT.parts`, a file for each solve
/// that is done, moved to its place whole. Killed at any moment, a study loses what was being
/// solved, and nothing else. Who solves what is told by files, too: the first group to make a
/// solve's claim has it.
class StudyStore {
  public:
    explicit StudyStore(const Study& study);

    /// Whether the output is there and whole, of this very study. Throws Error where it holds
    /// something else.
    bool is_complete() const;
    /// The first rank, before the others begin: makes the folder, or takes up the one that an
    /// earlier run left. Throws Error where that run's study was another of which solves are kept,
    /// or still runs. Its claims are gone; rows that cannot be read, too.
    void open();

    /// Which rows are there.
    std::vector<bool> done() const;
    std::size_t count_done() const;
    bool claim(std::size_t k) const;
    /// Throws Error where the row cannot be written.
    void keep(std::size_t k, const StudyRow& row) const;
    /// A row that was kept; by `check_rows` it is known to be sound.
    StudyRow row(std::size_t k) const;
    /// Throws Error, naming the first, where files of rows are damaged or gone.
    void check_rows() const;
    /// A solve that ended the whole run, by a failure that its ranks could not agree on; told to
    /// the run that goes on.
    void note_failure(std::size_t k, const std::string& reason) const;
    /// The reason, where that happened twice: then the solve is not tried again.
    std::optional<std::string> given_up(std::size_t k) const;
    /// Study and input files as they were when this was made. Throws Error where they are not the
    /// same any more.
    std::string checked_fingerprint() const;

    /// The first rank, at the end: the folder is not needed any more.
    void remove();

  private:
    /// The folder's, as long as this lives: a second run on the same output is refused.
    class Lock {
      public:
        Lock() = default;
        explicit Lock(const std::filesystem::path& file);
        ~Lock();
        Lock(Lock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
        Lock& operator=(Lock&& other) noexcept {
            std::swap(descriptor_, other.descriptor_);
            return *this;
        }

      private:
        int descriptor_ = -1;
    };
    std::filesystem::path row_file(std::size_t k) const;

    const Study& study_;
    std::filesystem::path folder_;
    std::string fingerprint_;
    Lock lock_;
};

/// One HDF5 file of all rows, its XDMF and its CSV. `/inputs` and `/outputs` have a row for each
/// solve and a column for each name in the texts "input_names" and "output_names" (JSON); what is
/// no number is NaN there, the values as they were given are in the text "inputs". `/converged`,
/// `/seconds` (mesh, set-up, solve), `/work` (iterations, linearisations, steps),
/// `/histories/000123`, `/displacement/000123`, `/meshes/0`, and the texts "failures", "study",
/// "scene", "versions". Each file is written whole or not at all. Throws Error where one cannot be.
void write_study(const Study& study, const StudyStore& store, const ProgressCallback& progress);

/// A study's table, for the summary and the pictures.
struct StudyTable {
    std::vector<std::string> inputs, outputs;
    std::vector<std::vector<std::string>> values;  ///< of the inputs, for each solve
    std::vector<std::vector<double>>
        results;                        ///< of the outputs, for each solve; NaN where there is none
    std::vector<std::string> failures;  ///< empty: converged
    std::vector<double> seconds;
};

/// Reads what `write_study` wrote. Throws Error.
StudyTable read_study(const std::filesystem::path& path);

}  // namespace livetet
