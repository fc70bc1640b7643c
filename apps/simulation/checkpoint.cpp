#include "apps/simulation/checkpoint.hpp"

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "io/text.hpp"
#include "io/vector_table.hpp"
#include "solvers/parallel/first_rank.hpp"
#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* state_format = "livetet checkpoint";
constexpr const char* frame_format = "livetet frame";
constexpr int checkpoint_version = 2;  // 1: other numbers in refined and P2 meshes
constexpr const char* state_file = "checkpoint.h5";

/// The communicator for files. One rank writes and reads as a process without MPI does.
MPI_Comm world() {
    int has_mpi = 0, ranks = 1;
    MPI_Initialized(&has_mpi);
    if (has_mpi) MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    return ranks > 1 ? PETSC_COMM_WORLD : MPI_COMM_SELF;
}

/// This rank's rows of a table.
RowRange my_range(std::size_t rows) {
    MPI_Comm comm = world();
    return comm == MPI_COMM_SELF ? RowRange{0, rows} : row_range(comm, rows);
}

std::vector<double> read_my_rows(const hdf5::File& file, const std::string& name,
                                 std::size_t columns) {
    return file.read_range<double>(name, my_range(file.rows(name, columns)), columns);
}

/// hdf5::write_whole, with a hint on restarting in its errors.
void write_part(const fs::path& path, const char* format, std::size_t bytes,
                const std::function<void(hdf5::File&)>& fill) {
    try {
        hdf5::write_whole(path, format, checkpoint_version, bytes, fill, world());
    } catch (const Error& e) {
        std::error_code unknown;
        const bool can_go_on = fs::exists(path.parent_path() / state_file, unknown);
        fail("{}{}", e.what(),
             can_go_on ? "; --restart continues the run from its last checkpoint" : "");
    }
}

/// Reads a JSON text of a file. Throws Error if it is invalid.
template <class Read>
auto read_about(const hdf5::File& file, Read&& read) {
    try {
        return read(json::parse(file.read_text("about")));
    } catch (const json::exception&) {
        fail("{}: invalid contents", file.shown());
    }
}

}  // namespace

void append_frame(ResultWriter& writer, const ResultFrame& frame) {
    writer.append(frame.time_s, frame.displacement);
    for (const ResultFrame::Field& f : frame.fields)
        writer.append_field(f.name, f.place, f.components, f.values);
}

CheckpointStore::CheckpointStore(const fs::path& result, std::string about, std::size_t nodes,
                                 std::size_t tets)
    : result_(result),
      folder_(result.string() + ".parts"),
      about_(std::move(about)),
      nodes_(nodes),
      tets_(tets) {}

fs::path CheckpointStore::frame_file(std::size_t number) const {
    return folder_ / fmt::format("frame_{:06}.h5", number);
}

void CheckpointStore::begin() const {
    if (fs::exists(folder_ / state_file))
        fail("{}: holds an earlier run, expected --restart, or that folder removed",
             folder_.string());
    if (const fs::path parent = folder_.parent_path(); !parent.empty() && !fs::is_directory(parent))
        fail("{}: cannot be written, there is no folder {}", result_.string(), parent.string());
    std::error_code error;
    fs::remove_all(folder_, error);
    fs::create_directory(folder_, error);
    if (error) fail("{}: cannot be created: {}", folder_.string(), error.message());
}

std::pair<RunPlace, BodySnapshot> CheckpointStore::read() const {
    const auto check = [&] {
        if (!fs::exists(folder_ / state_file))
            fail(
                "{}: no checkpoint to restart from, expected a run with output.checkpoint_every "
                "that was interrupted after its first",
                (folder_ / state_file).string());
        hdf5::File::check({folder_ / state_file});
    };
    if (world() == MPI_COMM_SELF)
        check();
    else
        on_first_rank(check);
    const hdf5::File file = hdf5::File::open(folder_ / state_file, hdf5::Validation::done);
    hdf5::check_format(file, state_format, checkpoint_version);
    if (const std::string was = file.read_text("run"); was != about_)
        fail("{}: belongs to another scene or mesh ({}), expected the one that wrote it",
             file.shown(), first_difference(was, about_));
    BodySnapshot state;
    const RunPlace place = read_about(file, [&](const json& about) {
        state.started = about.at("started");
        return RunPlace{about.at("time_s"), about.at("step_s"), about.at("steps"),
                        about.at("frames"), about.at("failure")};
    });
    for (const std::string& name : file.names("state")) {
        const std::size_t rows = file.rows("state/" + name, 3);
        if (!state.nodal.empty() && rows != state.node_count)
            fail("{}: table state/{} has {} rows, expected {}", file.shown(), name, rows,
                 state.node_count);
        state.node_count = rows;
        state.nodal.push_back(read_my_rows(file, "state/" + name, 3));
    }
    if (file.has("pressure")) {
        state.pressure_count = file.rows("pressure", 1);
        state.pressure = read_my_rows(file, "pressure", 1);
    }
    return {place, state};
}

void CheckpointStore::keep(std::size_t number, const ResultFrame& frame) const {
    const auto rows_of = [&](const ResultFrame::Field& f) {
        return f.place == FieldPlace::node ? nodes_ : tets_;
    };
    std::size_t bytes = nodes_ * sizeof(Vector3);
    for (const ResultFrame::Field& f : frame.fields)
        bytes += rows_of(f) * static_cast<std::size_t>(f.components) * sizeof(double);
    write_part(frame_file(number), frame_format, bytes, [&](hdf5::File& file) {
        json fields = json::array();
        for (const ResultFrame::Field& f : frame.fields)
            fields.push_back({{"name", f.name},
                              {"node", f.place == FieldPlace::node},
                              {"components", f.components}});
        file.write_text(
            "about", json{{"number", number}, {"time_s", frame.time_s}, {"fields", fields}}.dump());
        file.write_share<double>("displacement", nodes_, flat(frame.displacement), 3);
        for (const ResultFrame::Field& f : frame.fields)
            file.write_share<double>("fields/" + f.name, rows_of(f), f.values,
                                     static_cast<std::size_t>(f.components));
    });
}

void CheckpointStore::check_frames(std::size_t count) const {
    std::vector<fs::path> files;
    for (std::size_t k = 0; k < count; ++k) files.push_back(frame_file(k));
    hdf5::File::check(files);
}

ResultFrame CheckpointStore::frame(std::size_t number) const {
    const hdf5::File file = hdf5::File::open(frame_file(number), hdf5::Validation::done);
    hdf5::check_format(file, frame_format, checkpoint_version);
    return read_about(file, [&](const json& about) {
        if (about.at("number") != number)
            fail("{}: is frame {}, expected {}", file.shown(), about.at("number").dump(), number);
        ResultFrame frame{about.at("time_s"), vectors_of(read_my_rows(file, "displacement", 3))};
        for (const json& f : about.at("fields")) {
            const auto name = f.at("name").get<std::string>();
            const int components = f.at("components");
            frame.fields.push_back(
                {name, f.at("node").get<bool>() ? FieldPlace::node : FieldPlace::tet, components,
                 read_my_rows(file, "fields/" + name, static_cast<std::size_t>(components))});
        }
        return frame;
    });
}

void CheckpointStore::write(const RunPlace& place, const BodySnapshot& state) const {
    const std::size_t bytes = about_.size() + state.pressure_count * sizeof(double) +
                              state.nodal.size() * state.node_count * sizeof(Vector3);
    write_part(folder_ / state_file, state_format, bytes, [&](hdf5::File& file) {
        file.write_text("run", about_);
        file.write_text("about", json{{"time_s", place.time_s},
                                      {"step_s", place.step_s},
                                      {"steps", place.steps},
                                      {"frames", place.frames},
                                      {"failure", place.failure},
                                      {"started", state.started}}
                                     .dump());
        for (std::size_t i = 0; i < state.nodal.size(); ++i)
            file.write_share<double>(fmt::format("state/{}", i), state.node_count, state.nodal[i],
                                     3);
        if (state.pressure_count > 0)
            file.write_share<double>("pressure", state.pressure_count, state.pressure, 1);
    });
}

void CheckpointStore::remove() const {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

}  // namespace livetet
