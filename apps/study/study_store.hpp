#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/study/study.hpp"
#include "apps/study/study_file.hpp"

namespace livetet {

/// Keeps the rows of a running study in the folder `OUTPUT.parts`, a file for each finished solve,
/// moved into place when complete: a killed study loses only the solves in progress. Groups of
/// ranks share the work by files, too: the first to create the claim of a solve does it.
class StudyStore {
  public:
    explicit StudyStore(const Study& study);

    /// Whether the output is complete; not if this study extends it: the same scene, keys and
    /// files, with more solves. Throws Error if it is of another study.
    bool is_complete() const;
    /// By rank 0, before the others start: creates the folder, or opens that of an earlier run.
    /// Removes claims and unreadable rows. Takes over the rows of a folder or an output that this
    /// study extends. Throws Error if that run still goes on, or kept solves of another study.
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
    /// `given_up`: why, if that happened twice: it is not tried again.
    struct Failures {
        int count = 0;
        std::optional<std::string> given_up{};
    };
    Failures failures(std::size_t k) const;
    /// Records that it does so for the `number`th time (from 1). All ranks of a group may: they
    /// count once.
    void note_failure(std::size_t k, int number, const std::string& reason) const;
    /// The fingerprint of study and input files at construction. Throws Error if they have changed.
    std::string checked_fingerprint() const;

    /// By rank 0, at the end: writes the study's result (see write_study), and removes the folder.
    /// Throw Error if inputs changed during the run, or rows are damaged.
    void write_result(const ProgressCallback& progress) const;
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
        int descriptor_ = -1;
    };
    struct KeptRow {
        std::filesystem::path file;
        Sample inputs;
    };
    std::filesystem::path row_file(std::size_t k) const;
    std::pair<StudyRow, Sample> read_row(const std::filesystem::path& file,
                                         hdf5::Validation validation) const;
    /// Removes those that cannot be read.
    std::vector<KeptRow> sound_rows() const;
    /// Gives each row the number of the solve with its inputs; removes those that have none.
    void place_rows() const;
    /// Keeps what the result of an earlier study has of solves that are not done.
    void take_over(const StudyFile& earlier) const;
    /// Whether this study is that of an earlier fingerprint with solves added.
    bool extends(const std::string& earlier) const;

    const Study& study_;
    std::filesystem::path folder_;
    std::string fingerprint_;
    Lock lock_;
};

}  // namespace livetet
