#include "apps/study/study_store.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/scene/scene_files.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/yaml.hpp"
#include "io/hdf5.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"
#include "io/vector_table.hpp"
#include "io/xdmf.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* row_format = "livetet study row";
constexpr const char* study_format = "livetet study";
constexpr int study_version = 1;
constexpr const char* fingerprint_file = "study.yaml";

std::string number_of(std::size_t k) { return fmt::format("{:06}", k); }

/// The study and the present contents of the files that its solves read.
std::string whole_fingerprint(const Study& study) {
    return study.fingerprint() + "---\n" + stamps_of(study.files);
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

bool StudyStore::is_complete() const {
    const fs::path& output = study_.options.output;
    if (!fs::exists(output)) return false;
    const hdf5::File file = hdf5::File::open(output);
    hdf5::check_format(file, study_format, study_version);
    if (const std::string was = file.read_text("fingerprint"); was != fingerprint_)
        refuse_other(study_, output, was, fingerprint_);
    return true;
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
    const fs::path fingerprint = folder_ / fingerprint_file;
    const std::string was = fs::exists(fingerprint) ? read_text_file(fingerprint) : "";
    const bool is_other = was != fingerprint_;
    if (is_other && count_done() > 0) {
        if (was.empty())
            fail(
                "{}: holds solves, but not the {} that describes them; remove it, or name another "
                "output",
                folder_.string(), fingerprint_file);
        refuse_other(study_, folder_, was, fingerprint_);
    }
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
        const fs::path& path = entry.path();
        const bool is_of_the_other = is_other && path.extension() == ".failed";
        if (path.extension() == ".claim" || is_of_the_other ||
            path.filename().string().starts_with("."))
            fs::remove(path);
    }
    if (is_other) write_text_file(fingerprint, fingerprint_);
    const std::vector<bool> there = done();
    std::vector<fs::path> kept;
    for (std::size_t k = 0; k < there.size(); ++k)
        if (there[k]) kept.push_back(row_file(k));
    bool are_sound = true;
    try {
        hdf5::File::check(kept);
    } catch (const Error&) {
        are_sound = false;
    }
    for (std::size_t k = 0; k < there.size(); ++k) {
        if (!there[k]) continue;
        try {
            if (!are_sound) (void)hdf5::File::open(row_file(k));
            (void)row(k);
        } catch (const Error&) {  // incomplete after a crash of the machine
            fs::remove(row_file(k));
        }
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
        const std::size_t bytes = history_columns.size() * row.steps.size() * sizeof(double) +
                                  row.displacement.size() * sizeof(Vector3);
        hdf5::write_whole(row_file(k), row_format, study_version, bytes, [&](hdf5::File& file) {
            json about{{"solve", k},
                       {"converged", row.converged},
                       {"failure", row.failure},
                       {"mesh_s", row.mesh_s},
                       {"setup_s", row.setup_s},
                       {"solve_s", row.solve_s},
                       {"iterations", row.iterations},
                       {"linearisations", row.newton_iterations}};
            for (const auto& [name, value] : row.outputs) about["names"].push_back(name);
            file.write_text("row", about.dump());
            std::vector<double> outputs;
            for (const auto& [name, value] : row.outputs) outputs.push_back(value);
            file.write<double>("outputs", outputs, 1);
            file.write<double>("history", history_values(row), history_columns.size());
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

int StudyStore::ended_runs(std::size_t k) const {
    int count = 0;
    while (fs::exists(failure_file(k, count + 1))) ++count;
    return count;
}

void StudyStore::note_failure(std::size_t k, int number, const std::string& reason) const {
    std::ofstream(failure_file(k, number)) << reason << '\n';
}

std::optional<std::string> StudyStore::given_up(std::size_t k) const {
    constexpr int max_tries = 2;
    const int count = ended_runs(k);
    if (count < max_tries) return std::nullopt;
    return fmt::format("ended the study twice: {}", trim(read_text_file(failure_file(k, count))));
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
    const hdf5::File file = hdf5::File::open(row_file(k), hdf5::Validation::done);
    hdf5::check_format(file, row_format, study_version);
    StudyRow row;
    try {
        const json about = json::parse(file.read_text("row"));
        if (about.at("solve") != k)
            fail("{}: is of solve {}", file.shown(), about.at("solve").dump());
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
        const auto history = file.read<double>("history", history_columns.size());
        for (std::size_t i = 0; i < history.rows; ++i) {
            const double* x = history.values.data() + i * history_columns.size();
            StepRecord& step = row.steps.emplace_back(StepRecord{x[0], x[1], {}});
            step.report.converged = x[2] != 0;
            step.report.newton_iterations = static_cast<int>(x[3]);
            step.report.iterations = static_cast<int>(x[4]);
            step.report.imbalance = x[5];
            step.report.solve_s = x[6];
        }
        if (!study_.options.keep_displacements) return row;
        row.displacement = read_vectors(file, "displacement");
    } catch (const json::exception&) {
        fail("{}: invalid contents", file.shown());
    }
    return row;
}

void StudyStore::remove() {
    lock_ = {};
    fs::remove_all(folder_);
}

namespace {

/// Throws Error unless the disk has room for `bytes`, and for the tables and texts at the end.
void need_room(hdf5::File& file, std::size_t bytes) {
    constexpr std::size_t room_beside = 1 << 20;
    if (!file.reserve(bytes + room_beside))
        fail("{}: cannot be written (is the disk full?)", file.shown());
}

/// Writes the meshes of a study's solves, each once.
class StoredMeshes {
  public:
    explicit StoredMeshes(hdf5::File& file) : file_(file) {}

    /// A frame without fields on the mesh of a scene; writes the mesh the first time.
    XdmfFrame frame(const Scene& scene) {
        const std::string key =
            to_yaml(scene.mesh) + (scene.elements == Elements::p2 ? "P2" : "P1");
        const auto found = frames_.find(key);
        if (found != frames_.end()) return found->second;
        MeshHierarchy hierarchy = load_mesh(scene.mesh, {});
        if (scene.elements == Elements::p2) hierarchy = with_quadratic_level(std::move(hierarchy));
        const TetMesh& mesh = hierarchy.levels.front();
        const std::string group = fmt::format("meshes/{}", frames_.size());
        need_room(file_, bytes_written(mesh));
        write_mesh(file_, group, mesh);
        return frames_[key] = {0,
                               group,
                               mesh.nodes.size(),
                               mesh.tets.size(),
                               !mesh.edge_nodes.empty(),
                               !mesh.regions.empty(),
                               {}};
    }

  private:
    hdf5::File& file_;
    std::map<std::string, XdmfFrame> frames_;
};

std::string versions() {
    char library[MPI_MAX_LIBRARY_VERSION_STRING];
    int length = 0;
    MPI_Get_library_version(library, &length);
    return json{{"livetet", LIVETET_VERSION},
                {"petsc", fmt::format("{}.{}.{}", PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR,
                                      PETSC_VERSION_SUBMINOR)},
                {"mpi", std::string(library, static_cast<std::size_t>(length))}}
        .dump();
}

std::string csv_of(const StudyTable& table) {
    std::string text = "solve";
    for (const std::string& name : table.inputs) text += "," + csv_cell(name);
    text += ",converged";
    for (const std::string& name : table.outputs) text += "," + csv_cell(name);
    text += ",seconds,failure\n";
    for (std::size_t k = 0; k < table.values.size(); ++k) {
        text += fmt::format("{}", k);
        for (const std::string& value : table.values[k]) text += "," + csv_cell(value);
        text += table.failures[k].empty() ? ",yes" : ",no";
        for (const double x : table.results[k])
            text += std::isnan(x) ? "," : fmt::format(",{:.9g}", x);
        text += fmt::format(",{:.3f},{}\n", table.seconds[k], csv_cell(table.failures[k]));
    }
    return text;
}

/// All that a study's file holds but displacements and histories, a row for each solve.
struct StudyColumns {
    std::vector<double> inputs, converged, seconds, work;
    std::vector<std::vector<std::pair<std::string, double>>> outputs;
    StudyTable table;

    void add(const std::vector<std::string>& sample, const StudyRow& row) {
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        for (const std::string& value : sample)
            inputs.push_back(parse_number(value).value_or(none));
        converged.push_back(row.converged ? 1 : 0);
        for (const double s : {row.mesh_s, row.setup_s, row.solve_s}) seconds.push_back(s);
        for (const std::size_t n :
             {static_cast<std::size_t>(row.iterations),
              static_cast<std::size_t>(row.newton_iterations), row.steps.size()})
            work.push_back(static_cast<double>(n));
        outputs.push_back(row.outputs);
        table.values.push_back(sample);
        table.failures.push_back(row.converged ? "" : row.failure);
        table.seconds.push_back(row.mesh_s + row.setup_s + row.solve_s);
        for (const auto& [name, value] : row.outputs)
            if (std::find(table.outputs.begin(), table.outputs.end(), name) == table.outputs.end())
                table.outputs.push_back(name);
    }

    /// Fills table.results: the outputs of each solve in the order of table.outputs, NaN where a
    /// solve has none. Returns the same, row after row.
    std::vector<double> finish() {
        std::vector<double> results;
        for (const auto& row : outputs) {
            std::vector<double>& columns = table.results.emplace_back();
            for (const std::string& name : table.outputs) {
                const auto found = std::find_if(row.begin(), row.end(),
                                                [&](const auto& o) { return o.first == name; });
                columns.push_back(found != row.end() ? found->second
                                                     : std::numeric_limits<double>::quiet_NaN());
            }
            results.insert(results.end(), columns.begin(), columns.end());
        }
        return results;
    }
};

/// Copies histories and displacements, row by row. Returns the frames of the displacements.
std::vector<XdmfFrame> write_rows(hdf5::File& file, const Study& study, const StudyStore& store,
                                  StudyColumns& columns, const ProgressCallback& progress) {
    std::vector<XdmfFrame> frames;
    StoredMeshes meshes(file);
    const std::size_t count = study.samples.size();
    for (std::size_t k = 0; k < count; ++k) {
        if (progress)
            progress(static_cast<double>(k) / static_cast<double>(count),
                     "writing " + study.options.output.filename().string());
        const StudyRow row = store.row(k);
        columns.add(study.samples[k], row);
        need_room(file, history_values(row).size() * sizeof(double) +
                            row.displacement.size() * sizeof(Vector3));
        file.write<double>("histories/" + number_of(k), history_values(row),
                           history_columns.size());
        if (row.displacement.empty()) continue;
        const std::string name = "displacement/" + number_of(k);
        file.write<double>(name, flat(row.displacement), 3);
        XdmfFrame& frame = frames.emplace_back(meshes.frame(study.scene(k)));
        frame.time = static_cast<double>(k);
        frame.fields.push_back({"displacement", name, FieldPlace::node, 3});
    }
    return frames;
}

void write_columns(hdf5::File& file, const Study& study, StudyColumns& columns) {
    const StudyTable& table = columns.table;
    need_room(file, (columns.inputs.size() + study.samples.size() * (table.outputs.size() + 20)) *
                        2 * sizeof(double));
    const std::vector<double> results = columns.finish();
    file.write<double>("inputs", columns.inputs, table.inputs.size());
    if (!table.outputs.empty()) file.write<double>("outputs", results, table.outputs.size());
    file.write<double>("converged", columns.converged, 1);
    file.write<double>("seconds", columns.seconds, 3);
    file.write<double>("work", columns.work, 3);
    file.write_text("texts/input_names", json(table.inputs).dump());
    file.write_text("texts/output_names", json(table.outputs).dump());
    file.write_text("texts/inputs", json(table.values).dump());
    file.write_text("texts/failures", json(table.failures).dump());
    file.write_text("texts/history_names", json(history_columns).dump());
    file.write_text("texts/study", study.text);
    file.write_text("texts/scene", study.scene_text);
    file.write_text("texts/versions", versions());
}

}  // namespace

void write_study(const Study& study, const StudyStore& store, const ProgressCallback& progress) {
    const fs::path& output = study.options.output;
    const std::string fingerprint = store.checked_fingerprint();
    store.check_rows();
    const std::size_t text_bytes = study.text.size() + study.scene_text.size() + fingerprint.size();
    hdf5::write_whole(output, study_format, study_version, text_bytes, [&](hdf5::File& file) {
        StudyColumns columns;
        for (const VaryOptions& v : study.options.vary) columns.table.inputs.push_back(v.key);
        const std::vector<XdmfFrame> frames = write_rows(file, study, store, columns, progress);
        write_columns(file, study, columns);
        file.write_text("fingerprint", fingerprint);
        // Before the study's own file: once that exists, the study is complete.
        fs::path beside = output;
        write_text_file(beside.replace_extension(".csv"), csv_of(columns.table));
        write_text_file(beside.replace_extension(".xdmf"),
                        xdmf_text(output.filename().string(), frames));
    });
}

StudyTable read_study(const fs::path& path) {
    const hdf5::File file = hdf5::File::open(path);
    hdf5::check_format(file, study_format, study_version);
    StudyTable table;
    try {
        const auto text = [&](const char* name) {
            return json::parse(file.read_text(fmt::format("texts/{}", name)));
        };
        table.inputs = text("input_names").get<std::vector<std::string>>();
        table.outputs = text("output_names").get<std::vector<std::string>>();
        table.values = text("inputs").get<std::vector<std::vector<std::string>>>();
        table.failures = text("failures").get<std::vector<std::string>>();
    } catch (const json::exception&) {
        fail("{}: invalid column names", path.string());
    }
    const std::size_t count = table.values.size(), columns = table.outputs.size();
    const auto results =
        columns > 0 ? file.read<double>("outputs", columns) : hdf5::Table<double>{count, {}};
    const auto seconds = file.read<double>("seconds", 3);
    if (results.rows != count || seconds.rows != count || table.failures.size() != count)
        fail("{}: holds {} inputs, {} outputs and {} times, expected equal numbers", path.string(),
             count, results.rows, seconds.rows);
    for (std::size_t k = 0; k < count; ++k) {
        table.results.emplace_back(
            results.values.begin() + static_cast<std::ptrdiff_t>(k * columns),
            results.values.begin() + static_cast<std::ptrdiff_t>((k + 1) * columns));
        table.seconds.push_back(seconds.values[3 * k] + seconds.values[3 * k + 1] +
                                seconds.values[3 * k + 2]);
        if (table.values[k].size() != table.inputs.size())
            fail("{}: solve {} has {} inputs, expected {}", path.string(), k,
                 table.values[k].size(), table.inputs.size());
    }
    return table;
}

}  // namespace livetet
