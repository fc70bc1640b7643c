#include "apps/warp/warp_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "apps/scene/outputs.hpp"
#include "apps/warp/output_name.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/pending_folder.hpp"
#include "io/result_file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// What can be checked of the numbers before anything is read.
void check_numbers(const WarpArguments& a) {
    if (a.empty && !std::isfinite(*a.empty)) fail("--empty {}: expected a finite number", *a.empty);
    if (a.rind_mm && !(*a.rind_mm >= 0 && *a.rind_mm <= max_rind_mm))
        fail("--rind-mm {}: expected 0 to {:g} mm", *a.rind_mm, max_rind_mm);
}

/// The endings of outputs, before anything is read.
void check_endings(const WarpArguments& a) {
    if (a.output.empty() && a.inverse_field.empty() && a.forward_field.empty() &&
        a.registration.empty())
        fail(
            "warp: nothing to write, expected -o, --inverse-field, --forward-field or "
            "--registration");
    const auto is_nifti = [](const fs::path& path) {
        return ending(path) == ".nii" || ending(path) == ".nii.gz";
    };
    if (!a.output.empty() && !is_nifti(a.output) && !is_series_folder(a.output))
        fail(
            "--output {}: the name ends in '{}', expected .nii, .nii.gz, or a folder (a '/' at its "
            "end) for a DICOM series",
            a.output.string(), ending(a.output));
    for (const auto& [option, path] :
         {std::pair{"--inverse-field", &a.inverse_field}, {"--forward-field", &a.forward_field}})
        if (!path->empty() && !is_nifti(*path))
            fail("{} {}: the name ends in '{}', expected .nii or .nii.gz", option, path->string(),
                 ending(*path));
    expect_ending("--registration", a.registration, ".dcm");
    if (is_series_folder(a.output) && !a.grid.empty())
        fail(
            "--grid {}: found with a DICOM series as output, which has the slices of its source; "
            "expected no --grid, or .nii.gz",
            a.grid.string());
}

/// The requested frames, or the last.
std::vector<std::size_t> frames_of(const fs::path& file, const std::vector<double>& times,
                                   const WarpArguments& a) {
    const std::string where = file.string();
    if (times.empty()) fail("{}: holds no frame, expected at least one", where);
    if (!a.frames.empty()) return chosen_frames(a.frames, times.size(), where);
    if (a.frame) {
        if (*a.frame < 1 || *a.frame > static_cast<std::int64_t>(times.size()))
            fail("{}: holds {}, found --frame {}, expected 1 to {}", where,
                 counted(times.size(), "frame"), *a.frame, times.size());
        return {static_cast<std::size_t>(*a.frame - 1)};
    }
    if (!a.time_s) return {times.size() - 1};
    if (!(*a.time_s >= times.front() && *a.time_s <= times.back()))
        fail("{}: found --time {}, expected {} to {} s", where, *a.time_s, times.front(),
             times.back());
    const auto after = std::lower_bound(times.begin(), times.end(), *a.time_s) - times.begin();
    return {static_cast<std::size_t>(
        after > 0 && *a.time_s - times[after - 1] <= times[after] - *a.time_s ? after - 1 : after)};
}

struct NamedOutput {
    const char* option;
    const fs::path* path;
};

std::vector<NamedOutput> outputs_of(const WarpFiles& files) {
    return {{"--output", &files.image},
            {"--inverse-field", &files.inverse_field},
            {"--forward-field", &files.forward_field},
            {"--registration", &files.registration}};
}

/// Each output has a name of its own, which is not read, and can be written.
void check_warp_outputs(const WarpArguments& a, const std::vector<WarpJob>& jobs) {
    std::map<std::string, const char*> options;  ///< by the name that each has written
    std::set<fs::path> read(a.results.begin(), a.results.end());
    read.insert({a.image, a.grid});
    const auto check = [&](const char* option, const fs::path& path) {
        if (path.empty()) return;
        refuse_to_overwrite(option, path, read);
        std::error_code ignored;
        const std::string name = fs::weakly_canonical(path, ignored).string();
        if (const auto [other, is_new] = options.emplace(name, option); !is_new) {
            if (std::string_view(other->second) == option)
                fail(
                    "{} {}: found one name for {}, expected {{frame}}, {{result}} or {{folder}} in "
                    "it",
                    option, path.string(), counted(jobs.size(), "frame"));
            fail("{} and {}: both name {}, expected two files", other->second, option,
                 path.string());
        }
        if (&path != &a.json && is_series_folder(path))
            (void)PendingFolder(path);
        else
            expect_writable(path);
        remove_left_parts(path);
    };
    for (const WarpJob& job : jobs)
        for (const auto& [option, path] : outputs_of(job.files)) check(option, *path);
    check("--json", a.json);
}

}  // namespace

bool is_series_folder(const fs::path& output) {
    std::error_code ignored;
    return !output.empty() &&
           (!output.has_filename() || !output.has_extension() || fs::is_directory(output, ignored));
}

std::vector<WarpJob> plan_warp(const WarpArguments& a) {
    check_numbers(a);
    check_endings(a);
    std::vector<WarpJob> jobs;
    for (std::size_t n = 0; n < a.results.size(); ++n) {
        const fs::path& result = a.results[n];
        refuse_to_overwrite("--json", a.json, {result});
        const std::vector<double> times = ResultReader(result).times_s();
        for (const std::size_t frame : frames_of(result, times, a)) {
            const auto name = [&](const char* option, const fs::path& pattern) {
                return output_name(option, pattern, result, frame, times.size());
            };
            jobs.push_back({n,
                            frame,
                            {name("--output", a.output), name("--inverse-field", a.inverse_field),
                             name("--forward-field", a.forward_field),
                             name("--registration", a.registration)}});
        }
    }
    check_warp_outputs(a, jobs);
    return jobs;
}

}  // namespace livetet
