#include "apps/study/study_store.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/scene/scene_files.hpp"
#include "apps/study/study_file.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/yaml.hpp"
#include "io/text.hpp"
#include "io/vector_table.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* row_format = "livetet study row";
constexpr int row_version = 2;
constexpr const char* moved = ".moved";  ///< end of a row's file on its way to another number
constexpr const char* fingerprint_file = "study.yaml";

/// The study and the present contents of the files that its solves read.
std::string whole_fingerprint(const Study& study) {
    return study.fingerprint() + "---\n" + stamps_of(study.files);
}

std::multimap<Sample, std::size_t> places_of(const std::vector<Sample>& samples) {
    std::multimap<Sample, std::size_t> places;
    for (std::size_t k = 0; k < samples.size(); ++k) places.emplace(samples[k], k);
    return places;
}

/// The parts of a fingerprint: options, scene, perhaps PETSc's options, files.
std::vector<std::string> parts_of(const std::string& fingerprint) {
    std::vector<std::string> parts(1);
    for (const std::string_view line : split_lines(fingerprint)) {
        if (line == "---")
            parts.emplace_back();
        else
            parts.back() += fmt::format("{}\n", line);
    }
    return parts;
}

[[noreturn]] void refuse_other(const Study& study, const fs::path& where, const std::string& was,
                               const std::string& is) {
    fail(
        "{}: the study, its scene or one of their files changed since the run in {} ({}); restore "
        "it, remove the result, or name another output",
        study.file, where.string(), first_difference(was, is));
}

}  // namespace

StudyStore::Lock::Lock(const fs::path& file)
    : descriptor_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
    if (descriptor_ < 0) fail("{}: cannot be written", file.string());
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
        const int reason = errno;
        ::close(std::exchange(descriptor_, -1));
        if (reason != EWOULDBLOCK)
            fail(
                "{}: cannot be locked ({}); a study needs a file system with flock; mount Lustre "
                "with it",
                file.string(), std::generic_category().message(reason));
        fail("{}: another run of this study is active there, expected one at a time",
             file.parent_path().string());
    }
}

StudyStore::Lock::~Lock() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

StudyStore::StudyStore(const Study& study)
    : study_(study),
      folder_(study.options.output.string() + ".parts"),
      fingerprint_(whole_fingerprint(study)) {}

std::string StudyStore::checked_fingerprint() const {
    if (const std::string now = whole_fingerprint(study_); now != fingerprint_)
        fail(
            "{}: an input changed during the run ({}), so its solves do not belong together; "
            "remove {} and start again",
            study_.file, first_difference(fingerprint_, now), folder_.string());
    return fingerprint_;
}

bool StudyStore::extends(const std::string& earlier) const {
    const std::vector<std::string> was = parts_of(earlier), is = parts_of(fingerprint_);
    if (was.size() != is.size() || !std::equal(was.begin() + 1, was.end() - 1, is.begin() + 1))
        return false;
    const auto options = read_yaml<StudyOptions>(was.front(), "fingerprint");
    const auto keys = [](StudyOptions o) {
        o.design = {};
        o.samples = o.seed = 0;
        for (VaryOptions& v : o.vary) {
            VaryOptions named;
            named.key = v.key;
            v = named;
        }
        return to_yaml(o);
    };
    if (keys(options) != keys(read_yaml<StudyOptions>(is.front(), "fingerprint"))) return false;
    const auto files = split_lines(is.back());
    for (const std::string_view file : split_lines(was.back()))
        if (std::find(files.begin(), files.end(), file) == files.end()) return false;
    std::vector<Sample> before = samples_of(options, "fingerprint"), now = study_.samples;
    std::sort(before.begin(), before.end());
    std::sort(now.begin(), now.end());
    return std::includes(now.begin(), now.end(), before.begin(), before.end());
}

bool StudyStore::is_complete() const {
    const fs::path& output = study_.options.output;
    if (!fs::exists(output)) return false;
    const std::string was = StudyFile(output).fingerprint();
    if (was != fingerprint_ && !extends(was)) refuse_other(study_, output, was, fingerprint_);
    return was == fingerprint_;
}

void StudyStore::open() {
    const fs::path parent = folder_.has_parent_path() ? folder_.parent_path() : fs::path(".");
    if (!fs::is_directory(parent))
        fail("{}: cannot be written, there is no folder {}", study_.options.output.string(),
             parent.string());
    std::error_code error;
    fs::create_directory(folder_, error);
    if (error) fail("{}: cannot be created: {}", folder_.string(), error.message());
    lock_ = Lock(folder_ / "lock");
    remove_left_parts(study_.options.output);
    const fs::path fingerprint = folder_ / fingerprint_file;
    const std::string was = fs::exists(fingerprint) ? read_text_file(fingerprint) : "";
    const bool is_other = was != fingerprint_;
    if (is_other && count_done() > 0) {
        if (was.empty())
            fail(
                "{}: holds solves, but not the {} that describes them; remove it, or name another "
                "output",
                folder_.string(), fingerprint_file);
        if (!extends(was)) refuse_other(study_, folder_, was, fingerprint_);
    }
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
        const fs::path& path = entry.path();
        const bool is_of_the_other = is_other && path.extension() == ".failed";
        if (path.extension() == ".claim" || is_of_the_other ||
            path.filename().string().starts_with("."))
            fs::remove(path);
    }
    place_rows();
    if (is_other) write_text_file(fingerprint, fingerprint_);
    if (fs::exists(study_.options.output)) take_over(StudyFile(study_.options.output));
}

std::vector<StudyStore::KeptRow> StudyStore::sound_rows() const {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
        if (const auto end = entry.path().extension(); end == ".h5" || end == moved)
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    hdf5::Validation validation = hdf5::Validation::done;
    try {
        hdf5::File::check(files);
    } catch (const Error&) {
        validation = hdf5::Validation::now;
    }
    std::vector<KeptRow> rows;
    for (const fs::path& file : files) {
        try {
            rows.push_back({file, read_row(file, validation).second});
        } catch (const Error&) {  // incomplete after a crash of the machine
            fs::remove(file);
        }
    }
    return rows;
}

void StudyStore::place_rows() const {
    std::multimap<Sample, std::size_t> places = places_of(study_.samples);
    std::vector<KeptRow> misplaced;
    for (const KeptRow& kept : sound_rows()) {
        const auto [first, last] = places.equal_range(kept.inputs);
        const auto own = std::find_if(first, last, [&](const auto& place) {
            return kept.file.filename() == row_file(place.second).filename();
        });
        if (own != last)
            places.erase(own);
        else
            misplaced.push_back(kept);
    }
    // All are moved out of the way before the first takes a number that may be another's.
    for (KeptRow& kept : misplaced) {
        const fs::path to = fs::path(kept.file).replace_extension(moved);
        fs::rename(kept.file, to);
        kept.file = to;
    }
    for (const KeptRow& kept : misplaced) {
        const auto place = places.find(kept.inputs);
        if (place == places.end()) {
            fs::remove(kept.file);
            continue;
        }
        fs::rename(kept.file, row_file(place->second));
        places.erase(place);
    }
}

void StudyStore::take_over(const StudyFile& earlier) const {
    const StudyTable table = earlier.table();
    const std::vector<bool> there = done();
    std::multimap<Sample, std::size_t> places = places_of(study_.samples);
    std::erase_if(places, [&](const auto& place) { return there[place.second]; });
    for (std::size_t j = 0; j < table.values.size(); ++j) {
        const auto place = places.find(table.values[j]);
        if (place == places.end()) continue;
        keep(place->second, earlier.row(table, j));
        places.erase(place);
    }
}

fs::path StudyStore::row_file(std::size_t k) const { return folder_ / (number_of(k) + ".h5"); }

std::vector<bool> StudyStore::done() const {
    std::vector<bool> done(study_.samples.size());
    for (std::size_t k = 0; k < done.size(); ++k) done[k] = fs::exists(row_file(k));
    return done;
}

std::size_t StudyStore::count_done() const {
    std::error_code error;
    std::size_t count = 0;
    for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
         entry.increment(error)) {
        const fs::path& path = entry->path();
        count += path.extension() == ".h5" && !path.filename().string().starts_with(".");
    }
    return count;
}

bool StudyStore::claim(std::size_t k) const {
    const fs::path file = folder_ / (number_of(k) + ".claim");
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (descriptor < 0 && errno != EEXIST)
        fail("{}: cannot be written ({}); run the study again to continue from here", file.string(),
             std::generic_category().message(errno));
    if (descriptor >= 0) ::close(descriptor);
    return descriptor >= 0;
}

void StudyStore::keep(std::size_t k, const StudyRow& row) const {
    try {
        const std::size_t bytes = (history_columns.size() + 1) * row.steps.size() * sizeof(double) +
                                  row.displacement.size() * sizeof(Vector3);
        hdf5::write_whole(row_file(k), row_format, row_version, bytes, [&](hdf5::File& file) {
            json about{{"inputs", study_.samples[k]},  {"converged", row.converged},
                       {"failure", row.failure},       {"mesh_s", row.mesh_s},
                       {"setup_s", row.setup_s},       {"solve_s", row.solve_s},
                       {"iterations", row.iterations}, {"linearisations", row.newton_iterations}};
            for (const auto& [name, value] : row.outputs) about["names"].push_back(name);
            file.write_text("row", about.dump());
            std::vector<double> outputs;
            for (const auto& [name, value] : row.outputs) outputs.push_back(value);
            file.write<double>("outputs", outputs, 1);
            file.write<double>("history", history_values(row.steps), history_columns.size());
            file.write<double>("seconds", step_seconds(row.steps), 1);
            if (study_.options.keep_displacements)
                file.write<double>("displacement", flat(row.displacement), 3);
        });
    } catch (const Error& e) {
        fail("{}; run the study again to continue from here", e.what());
    }
}

fs::path StudyStore::failure_file(std::size_t k, int number) const {
    return folder_ / fmt::format("{}.{}.failed", number_of(k), number);
}

StudyStore::Failures StudyStore::failures(std::size_t k) const {
    constexpr int max_tries = 2;
    Failures failures;
    while (fs::exists(failure_file(k, failures.count + 1))) ++failures.count;
    if (failures.count >= max_tries)
        failures.given_up = fmt::format("ended the study twice: {}",
                                        trim(read_text_file(failure_file(k, failures.count))));
    return failures;
}

void StudyStore::note_failure(std::size_t k, int number, const std::string& reason) const {
    std::ofstream(failure_file(k, number)) << reason << '\n';
}

std::pair<StudyRow, Sample> StudyStore::read_row(const fs::path& path,
                                                 hdf5::Validation validation) const {
    const hdf5::File file = hdf5::File::open(path, validation);
    hdf5::check_format(file, row_format, row_version);
    std::pair<StudyRow, Sample> found;
    auto& [row, inputs] = found;
    try {
        const json about = json::parse(file.read_text("row"));
        inputs = about.at("inputs").get<Sample>();
        row.converged = about.at("converged");
        row.failure = about.at("failure");
        row.mesh_s = about.at("mesh_s");
        row.setup_s = about.at("setup_s");
        row.solve_s = about.at("solve_s");
        row.iterations = about.at("iterations");
        row.newton_iterations = about.at("linearisations");
        const auto outputs = file.read<double>("outputs", 1).values;
        const auto names = about.value("names", std::vector<std::string>{});
        if (names.size() != outputs.size())
            fail("{}: {} outputs for {} names", file.shown(), outputs.size(), names.size());
        for (std::size_t i = 0; i < names.size(); ++i)
            row.outputs.emplace_back(names[i], outputs[i]);
        row.steps = read_steps(file, "history", "seconds");
        if (study_.options.keep_displacements)
            row.displacement = read_vectors(file, "displacement");
    } catch (const json::exception&) {
        fail("{}: invalid contents", file.shown());
    }
    return found;
}

void StudyStore::check_rows() const {
    std::vector<fs::path> files;
    for (std::size_t k = 0; k < study_.samples.size(); ++k) files.push_back(row_file(k));
    try {
        hdf5::File::check(files);
    } catch (const Error& e) {
        fail("{}; remove it, and the study solves that one again", e.what());
    }
}

StudyRow StudyStore::row(std::size_t k) const {
    auto [row, inputs] = read_row(row_file(k), hdf5::Validation::done);
    if (inputs != study_.samples[k])
        fail("{}: is of {}, expected {}", row_file(k).string(), fmt::join(inputs, ", "),
             fmt::join(study_.samples[k], ", "));
    return row;
}

void StudyStore::write_result(const ProgressCallback& progress) const {
    const std::string fingerprint = checked_fingerprint();
    check_rows();
    write_study(
        study_, fingerprint, [&](std::size_t k) { return row(k); }, progress);
}

void StudyStore::remove() {
    lock_ = {};
    // The solves first: what a kill leaves of the folder is then still described by its study.yaml.
    std::error_code none;  // a study that was complete has no folder
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none))
        if (entry.path().extension() == ".h5") fs::remove(entry.path());
    fs::remove_all(folder_);
}

}  // namespace livetet
