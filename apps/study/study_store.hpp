#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/study/study.hpp"
#include "apps/study/study_solve.hpp"

namespace livetet {

/// Keeps the rows of a running study in the folder `OUTPUT.parts`, a file for each finished solve,
/// moved into place when complete: a killed study loses only the solves in progress. Groups of
/// ranks share the work by files, too: the first to create the claim of a solve does it.
class StudyStore {
  public:
    explicit StudyStore(const Study& study);

    /// Whether the output is complete. Throws Error if it is of another study.
    bool is_complete() const;
    /// By rank 0, before the others start: creates the folder, or opens that of an earlier run.
    /// Removes claims and unreadable rows. Throws Error if that run still goes on, or kept solves
    /// of another study.
    void open();

    /// Which rows exist.
    std::vector<bool> done() const;
    std::size_t count_done() const;
    bool claim(std::size_t k) const;
    /// Writes a row. Throws Error if it cannot be written.
    void keep(std::size_t k, const StudyRow& row) const;
    /// Reads a row, sound if `check_rows` has passed.
    StudyRow row(std::size_t k) const;
    /// Throws Error, naming the first file, if rows are damaged or missing.
    void check_rows() const;
    /// How often a solve has ended the whole run, because its ranks could not agree on its failure.
    int ended_runs(std::size_t k) const;
    /// Records that it does so for the `number`th time (from 1). All ranks of a group may: they
    /// count once.
    void note_failure(std::size_t k, int number, const std::string& reason) const;
    /// The reason, if that happened twice: the solve is not tried again.
    std::optional<std::string> given_up(std::size_t k) const;
    /// The fingerprint of study and input files at construction. Throws Error if they have changed.
    std::string checked_fingerprint() const;

    /// By rank 0, at the end: removes the folder.
    void remove();

  private:
    std::filesystem::path failure_file(std::size_t k, int number) const;
    /// Locks the folder: a second run with the same output is refused.
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
        std::filesystem::path failure_file(std::size_t k, int number) const;
        int descriptor_ = -1;
    };
    std::filesystem::path row_file(std::size_t k) const;

    const Study& study_;
    std::filesystem::path folder_;
    std::string fingerprint_;
    Lock lock_;
};

/// Writes an HDF5 file of all rows, its XDMF and its CSV. `/inputs` and `/outputs` have a row for
/// each solve and a column for each name in the texts "input_names" and "output_names" (JSON).
/// Inputs that are no numbers are NaN there; the text "inputs" has all values as given. Further:
/// `/converged`, `/seconds` (mesh, set-up, solve), `/work` (iterations, linearisations, steps),
/// `/histories/000123`, `/displacement/000123`,
/// `/meshes/0`, and the texts "failures", "study", "scene", "versions". Each file is written
/// completely or not at all. Throws Error if that fails.
void write_study(const Study& study, const StudyStore& store, const ProgressCallback& progress);

/// The table of a study, for summary and pictures.
struct StudyTable {
    std::vector<std::string> inputs, outputs;
    std::vector<std::vector<std::string>> values;  ///< of the inputs, for each solve
    std::vector<std::vector<double>> results;      ///< of the outputs, for each solve; NaN: none
    std::vector<std::string> failures;             ///< empty: converged
    std::vector<double> seconds;
};

/// Reads the result of `write_study`. Throws Error.
StudyTable read_study(const std::filesystem::path& path);

}  // namespace livetet
