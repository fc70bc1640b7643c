#include "apps/study/study_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/scene/cuts.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/yaml.hpp"
#include "io/hdf5.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"
#include "io/vector_table.hpp"
#include "io/xdmf.hpp"
#include "mesh/mesh_pieces.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* study_format = "livetet study";
constexpr int study_version = 2;

std::string history_name(std::size_t k) { return "histories/" + number_of(k); }
std::string step_times_name(std::size_t k) { return "times/steps/" + number_of(k); }
std::string displacement_name(std::size_t k) { return "displacement/" + number_of(k); }

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
            mesh_identity(scene) + (scene.elements == Elements::p2 ? "P2" : "P1");
        const auto found = frames_.find(key);
        if (found != frames_.end()) return found->second;
        const MeshHierarchy hierarchy = in_elements(load_mesh(scene, {}), scene.elements);
        const TetMesh& mesh = hierarchy.levels.front();
        const std::string group = fmt::format("meshes/{}", frames_.size());
        need_room(file_, bytes_written(mesh));
        write_mesh(file_, group, mesh);
        return frames_[key] = {0,
                               group,
                               mesh.nodes.size(),
                               cell_count(mesh),
                               !mesh.edge_nodes.empty(),
                               !mesh.regions.empty(),
                               {},
                               !mesh.hexahedra.empty()};
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
    std::vector<double> inputs, converged, work;
    std::vector<double> seconds;  ///< of mesh, set-up and solve
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
std::vector<XdmfFrame> write_rows(hdf5::File& file, const Study& study,
                                  const std::function<StudyRow(std::size_t)>& row_of,
                                  StudyColumns& columns, const ProgressCallback& progress) {
    std::vector<XdmfFrame> frames;
    StoredMeshes meshes(file);
    const std::size_t count = study.samples.size();
    for (std::size_t k = 0; k < count; ++k) {
        if (progress)
            progress(static_cast<double>(k) / static_cast<double>(count),
                     "writing " + study.options.output.filename().string());
        const StudyRow row = row_of(k);
        columns.add(study.samples[k], row);
        need_room(file, row.steps.size() * (history_columns.size() + 1) * sizeof(double) +
                            row.displacement.size() * sizeof(Vector3));
        file.write<double>(history_name(k), history_values(row.steps), history_columns.size());
        file.write<double>(step_times_name(k), step_seconds(row.steps), 1);
        if (row.displacement.empty()) continue;
        file.write<double>(displacement_name(k), flat(row.displacement), 3);
        XdmfFrame& frame = frames.emplace_back(meshes.frame(study.scene(k)));
        frame.time = static_cast<double>(k);
        frame.fields.push_back({"displacement", displacement_name(k), FieldPlace::node, 3});
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
    file.write<double>("work", columns.work, 3);
    file.write<double>("times/solves", columns.seconds, 3);
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

std::string number_of(std::size_t solve) { return fmt::format("{:06}", solve); }

void write_study(const Study& study, const std::string& fingerprint,
                 const std::function<StudyRow(std::size_t)>& row,
                 const ProgressCallback& progress) {
    const fs::path& output = study.options.output;
    const std::size_t text_bytes = study.text.size() + study.scene_text.size() + fingerprint.size();
    hdf5::write_whole(output, study_format, study_version, text_bytes, [&](hdf5::File& file) {
        StudyColumns columns;
        for (const VaryOptions& v : study.options.vary) columns.table.inputs.push_back(v.key);
        const std::vector<XdmfFrame> frames = write_rows(file, study, row, columns, progress);
        write_columns(file, study, columns);
        file.write_text("texts/fingerprint", fingerprint);
        // Before the study's own file: once that exists, the study is complete.
        fs::path beside = output;
        write_text_file(beside.replace_extension(".csv"), csv_of(columns.table));
        write_text_file(beside.replace_extension(".xdmf"),
                        xdmf_text(output.filename().string(), frames));
    });
}

StudyFile::StudyFile(const fs::path& path) : file_(hdf5::File::open(path)) {
    hdf5::check_format(file_, study_format, study_version);
}

std::string StudyFile::fingerprint() const { return file_.read_text("texts/fingerprint"); }

StudyTable StudyFile::table() const {
    StudyTable table;
    try {
        const auto text = [&](const char* name) {
            return json::parse(file_.read_text(fmt::format("texts/{}", name)));
        };
        table.inputs = text("input_names").get<std::vector<std::string>>();
        table.outputs = text("output_names").get<std::vector<std::string>>();
        table.values = text("inputs").get<std::vector<std::vector<std::string>>>();
        table.failures = text("failures").get<std::vector<std::string>>();
    } catch (const json::exception&) {
        fail("{}: invalid column names", file_.shown());
    }
    const std::size_t count = table.values.size(), columns = table.outputs.size();
    const auto results =
        columns > 0 ? file_.read<double>("outputs", columns) : hdf5::Table<double>{count, {}};
    const auto seconds = file_.read<double>("times/solves", 3);
    if (results.rows != count || seconds.rows != count || table.failures.size() != count)
        fail("{}: holds {} inputs, {} outputs and {} times, expected equal numbers", file_.shown(),
             count, results.rows, seconds.rows);
    for (std::size_t k = 0; k < count; ++k) {
        table.results.emplace_back(
            results.values.begin() + static_cast<std::ptrdiff_t>(k * columns),
            results.values.begin() + static_cast<std::ptrdiff_t>((k + 1) * columns));
        table.seconds.push_back(seconds.values[3 * k] + seconds.values[3 * k + 1] +
                                seconds.values[3 * k + 2]);
        if (table.values[k].size() != table.inputs.size())
            fail("{}: solve {} has {} inputs, expected {}", file_.shown(), k,
                 table.values[k].size(), table.inputs.size());
    }
    return table;
}

StudyRow StudyFile::row(const StudyTable& table, std::size_t k) const {
    const std::vector<double> seconds = file_.read_row<double>("times/solves", k, 3);
    const std::vector<double> work = file_.read_row<double>("work", k, 3);
    StudyRow row;
    row.converged = file_.read_row<double>("converged", k, 1).front() != 0;
    row.failure = table.failures.at(k);
    row.mesh_s = seconds[0];
    row.setup_s = seconds[1];
    row.solve_s = seconds[2];
    row.iterations = static_cast<int>(work[0]);
    row.newton_iterations = static_cast<int>(work[1]);
    row.steps = read_steps(file_, history_name(k), step_times_name(k));
    for (std::size_t i = 0; i < table.outputs.size(); ++i)
        if (!std::isnan(table.results[k][i]))
            row.outputs.emplace_back(table.outputs[i], table.results[k][i]);
    if (file_.has(displacement_name(k)))
        row.displacement = read_vectors(file_, displacement_name(k));
    return row;
}

}  // namespace livetet
