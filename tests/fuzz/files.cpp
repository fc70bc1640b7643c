// Fuzz targets for all file readers, each with changed valid files.
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "apps/live/recorder.hpp"
#include "apps/live/run_result.hpp"
#include "apps/phantom/truth_file.hpp"
#include "apps/scene/scene.hpp"
#include "apps/simulation/checkpoint.hpp"
#include "apps/study/study.hpp"
#include "apps/study/study_store.hpp"
#include "apps/viewer/script.hpp"
#include "base/file.hpp"
#include "fuzz/fuzz.hpp"
#include "io/fiducial_file.hpp"
#include "io/gmsh_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/points_csv.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "io/sequence_file.hpp"
#include "io/surface_file.hpp"
#include "io/tip_file.hpp"
#include "io/vtu_file.hpp"
#include "tracking/motion_script.hpp"

#include <gtest/gtest.h>

#include "io/dicom_writer.hpp"
#include "io/meshes.hpp"

namespace livetet::fuzz {
namespace {

namespace fs = std::filesystem;
using Reader = std::function<void(const fs::path&)>;
using Writer = std::function<void(const fs::path&)>;

/// A folder of this process.
const fs::path& folder() {
    static const struct Folder {
        fs::path path = fs::temp_directory_path() / ("livetet_fuzz_" + std::to_string(::getpid()));
        Folder() { fs::create_directories(path); }
        ~Folder() { fs::remove_all(path); }
    } own;
    return own.path;
}

Bytes bytes_of_text(std::string_view text) { return {text.begin(), text.end()}; }

/// A target for files named `in<ending>`.
Target target(std::string name, const std::string& ending, Reader read,
              std::function<std::vector<Bytes>()> seeds) {
    const auto run = [ending, read = std::move(read)](ByteView bytes) {
        const fs::path path = folder() / ("in" + ending);
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
        read(path);
    };
    return {std::move(name), run, std::move(seeds)};
}

/// Valid files, written by the program's writers.
std::function<std::vector<Bytes>()> written(const std::string& ending, Writer write) {
    return [ending, write = std::move(write)] {
        const fs::path path = folder() / ("good" + ending);
        write(path);
        return std::vector<Bytes>{bytes_of(path)};
    };
}

std::function<std::vector<Bytes>()> texts(std::vector<std::string> good) {
    return [good = std::move(good)] {
        std::vector<Bytes> all;
        for (const std::string& text : good) all.push_back(bytes_of_text(text));
        return all;
    };
}

TriangleMesh cube_surface() {
    const TetMesh cube = testing_meshes::cube();
    return {cube.nodes, boundary_triangles(cube.tets)};
}

LabelImage small_image() {
    LabelImage image;
    image.size = {4, 3, 2};
    image.ras_from_voxel.diagonal() << 0.001, 0.002, 0.003, 1;
    for (int i = 0; i < 24; ++i) image.values.push_back(i % 3);
    return image;
}

Recording small_recording() {
    Recording recording{{"Stylus", "Reference"}, {}};
    for (int i = 0; i < 3; ++i) {
        TrackerSample& sample = recording.samples.emplace_back();
        sample.time_s = 0.1 * i;
        sample.poses.resize(2);
        sample.poses[0].status = PoseStatus::ok;
    }
    return recording;
}

FiducialRegistration small_registration() {
    FiducialRegistration registration;
    registration.fiducials.push_back({"F1", {0.1, 0, 0}, {0, 0.1, 0}, {}, 0.001, 0.002});
    registration.fiducials.push_back({"F2", {0, 0.2, 0}, {0, 0.1, 0.3}, {}, 0.001, 0.002});
    registration.expected_error = {1e-6 * Eigen::Matrix<double, 6, 6>::Identity(), true};
    return registration;
}

std::string with_voxels(const std::string& header) { return header + std::string(24, '\1'); }

const std::string nrrd =
    "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\nspace: "
    "left-posterior-superior\n"
    "space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (-10,-20,30)\n\n";
const std::string meta_image =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
    "False\nTransformMatrix = 1 0 0 0 1 0 0 "
    "0 "
    "1\nOffset = -10 -20 30\nElementSpacing = 1 2 3\nDimSize = 4 3 2\nElementType = "
    "MET_UCHAR\nElementDataFile = "
    "LOCAL\n";
const std::string vtu =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
    "byte_order=\"LittleEndian\">\n"
    "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n<Points><DataArray "
    "type=\"Float64\" "
    "NumberOfComponents=\"3\" format=\"ascii\">0 0 0  10 0 0  0 10 0  0 0 10</DataArray></Points>\n"
    "<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>\n"
    "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells>\n"
    "<CellData><DataArray type=\"Int32\" Name=\"region\" "
    "format=\"ascii\">7</DataArray></CellData>\n"
    "</Piece></UnstructuredGrid></VTKFile>\n";
const std::string vtp =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
    "byte_order=\"LittleEndian\">\n<PolyData><Piece "
    "NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"1\" "
    "NumberOfPolys=\"1\">\n<Points><DataArray "
    "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 10 0 0 0 10 0 0 0 "
    "10</DataArray></Points>\n<Strips>"
    "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 "
    "3</DataArray><DataArray type=\"Int32\" "
    "Name=\"offsets\" format=\"ascii\">4</DataArray></Strips>\n<Polys><DataArray type=\"Int32\" "
    "Name=\"connectivity\" "
    "format=\"ascii\">0 2 1</DataArray><DataArray type=\"Int32\" Name=\"offsets\" "
    "format=\"ascii\">3</DataArray></Polys>\n"
    "</Piece></PolyData></VTKFile>\n";
const std::string fcsv =
    "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = "
    "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n1,10,20,30,0,0,0,1,1,1,0,F-1,,"
    "\n";
const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
const std::string off = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

const std::string sequence_nrrd =
    "NRRD0005\n# Complete NRRD file format specification at:\ntype: unsigned char\ndimension: "
    "3\nsizes: 0 0 2\n"
    "kinds: domain domain list\nencoding: raw\n"
    "Seq_Frame0000_StylusToTrackerTransform:=1 0 0 10 0 1 0 20 0 0 1 30 0 0 0 1\n"
    "Seq_Frame0000_StylusToTrackerTransformStatus:=OK\nSeq_Frame0000_Timestamp:=0.5\n"
    "Seq_Frame0001_StylusToTrackerTransform:=0 -1 0 10 1 0 0 20 0 0 1 30 0 0 0 1\n"
    "Seq_Frame0001_StylusToTrackerTransformStatus:=OUT_OF_VOLUME\nSeq_Frame0001_Timestamp:=0.6\n\n";
const std::string scene =
    "mesh: {file: liver.nii.gz, labels: [1, 2], tets: 6000, threshold: \"100:\"}\n"
    "materials: [{young_Pa: 3000, poisson: 0.45, region: 1}]\nstrain: green\nelements: P2\n"
    "time: {scheme: newmark, rayleigh_alpha: 10}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}, "
    "{mask: m.nii}]\n"
    "drive:\n  - sphere_mm: [-30, 20, 40, 15]\n    where: surface\n    displacement_mm: [0, 0, "
    "-15]\n"
    "solver: {kind: live, petsc_options: \"-ksp_view\"}\n"
    "track: {source: \"openigtlink://a:1\", registration: r.json, budget: 10 ms, publish: {port: "
    "1},\n"
    "  sensors: [{tool: Sensor, stiffness_N_per_m: 10}], tools: [{tool: Stylus, tip: tip.json}]}\n"
    "probes: {points: p.csv}\noutput: {every: 2, fields: [stress]}\n";
const std::string script =
    "rate_Hz: 20\nduration_s: 12\nposition_noise_mm: 1.4\ndropout_rate: 0.02\nlatency_ms: 40\n"
    "organ: {at_mm: [300, 0, -100], moves: [{at_s: 12, by_mm: [40, 0, 0], turn_deg: [0, 20, 0]}]}\n"
    "tools:\n  - {tool: Reference, at_mm: [20, 100, 50]}\n"
    "  - tool: Sensor\n    at_mm: [100, 50, 100]\n    moves: [{at_s: 3}, {at_s: 4, by_mm: [0, 0, "
    "-15]}]\n    lost_s: [5, 5.4]\n"
    "  - {tool: Stylus, on: tracker, tip_mm: [4, -2, 150], moves: [{at_s: 6, turn_deg: [30, 20, "
    "0]}]}\n";

/// A header and the separate file with its voxels.
std::function<std::vector<Bytes>()> header_of_voxels(std::string header) {
    return [header = std::move(header)] {
        write_text_file(folder() / "voxels.raw", std::string(24, '\1'));
        return std::vector<Bytes>{bytes_of_text(header)};
    };
}

/// A valid DICOM file. It is not kept, as a reader looks for slices beside its input.
std::function<std::vector<Bytes>()> dicom_seeds(Writer write) {
    return [write = std::move(write)] {
        std::vector<Bytes> seeds = written(".dcm", write)();
        fs::remove(folder() / "good.dcm");
        return seeds;
    };
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

/// A tracked run of two frames, as the recorder writes it.
void write_run(const fs::path& path) {
    const TetMesh cube = testing_meshes::cube();
    ResultWriter writer(path, cube, scene, Precision::single);
    for (int k = 1; k <= 2; ++k) {
        std::vector<double> arrival{1.0 * k, 0.1 * k, 0.1 * k, 0, 0, 1, 0, 0, 0,
                                    0,       1,       0,       0, 0, 0, 1, 0};
        writer.append_row("arrivals", arrival);
        writer.append(0.1 * k, std::vector<Vector3>(cube.nodes.size(), Vector3(0, 0, 1e-3 * k)));
        writer.append_values("tracker_from_image", {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}});
        for (const char* name : {"frame_ms", "sensor_ms", "forces_ms", "operator_ms", "solve_ms",
                                 "finish_ms", "output_ms", "iterations", "residual", "cut_short",
                                 "press_mm", "registration_status", "converged", "checksum"})
            writer.append_values(name, {{1.0}});
        writer.append_values("sample", {{1.0 * k}});
        writer.append_values("solves", std::vector<double>(2 * max_recorded_solves, 1));
    }
    writer.write_text(
        "run",
        R"({"samples": 2, "frames": 2, "missed": 0, "budget_ms": 10.0, "fre_mm": 0.3, "fiducials": [],
                          "tets": 6, "nodes": 8, "levels": 1, "version": "1"})");
    writer.close();
}

Truth small_truth() {
    Truth truth;
    truth.depths = {0.005, 0.01};
    truth.targets.push_back({"T1", {0.1, 0, 0}, {{0, 0, 0.001}, {0, 0, 0.002}}});
    truth.samples.push_back({0, 0, {}});
    truth.samples.push_back({0.1, 0.005, {}});
    return truth;
}

const std::string study =
    "scene: beside.yaml\ndesign: grid\noutput: study.h5\nvary:\n  - {key: "
    "\"materials[0].young_Pa\", from: 2000, to: 8000, count: 3, spacing: log}\n"
    "  - {key: strain, values: [linear, corotated]}\nplots: [largest_displacement_mm]\n";
const std::string hypercube =
    "scene: beside.yaml\ndesign: latin-hypercube\nsamples: 3\nseed: 2\nvary: [{key: "
    "\"fix[0].half_space_mm[2]\", from: 0, to: 1}]\nkeep_displacements: false\n";

fs::path beside() {
    write_text_file(folder() / "beside.yaml",
                    "mesh: {file: cube.h5}\nmaterials: [{young_Pa: 3000}]\nfix: [{half_space_mm: "
                    "[0, 0, 1, 0, 0, 1]}]\n");
    return folder() / "beside.yaml";
}

StudyRow small_row() {
    StudyRow row;
    row.converged = true;
    row.outputs = {{"largest_displacement_mm", 1.5}, {"tip_x_mm", -2}};
    row.displacement = testing_meshes::cube().nodes;
    return row;
}

/// Calls `use` with a study of two solves in its own folder, which then only contains the files
/// that `use` leaves.
template <class Use>
void with_study(const Use& use) {
    beside();
    write_hierarchy(folder() / "cube.h5", make_hierarchy({testing_meshes::cube()}, ""));
    write_text_file(
        folder() / "kept.yaml",
        "scene: beside.yaml\noutput: kept.h5\nvary: [{key: strain, values: [linear, green]}]\n");
    const Study of = load_study(folder() / "kept.yaml");
    fs::remove_all(folder() / "kept.h5.parts");
    fs::remove(folder() / "kept.h5");
    StudyStore store(of);
    store.open();
    use(of, store);
}

/// A checkpoint and a frame of a run, in the folder of its result's parts.
const CheckpointStore& checkpoints() {
    static const CheckpointStore store(folder() / "run.h5", "a run",
                                       testing_meshes::cube().nodes.size(),
                                       testing_meshes::cube().tets.size());
    return store;
}

fs::path begun(const std::string& file) {
    const fs::path parts = folder() / "run.h5.parts";
    fs::create_directories(parts);
    return parts / file;
}

std::vector<Bytes> good_checkpoint() {
    begun("");
    const std::vector<Vector3> nodes = testing_meshes::cube().nodes;
    const std::vector<double> values(nodes.front().data(), nodes.front().data() + 3 * nodes.size());
    checkpoints().write({0.1, 0.01, 10, 2, ""},
                        {{values, values, values}, {1, 2, 3}, nodes.size(), 3, true});
    return {bytes_of(begun("checkpoint.h5"))};
}

std::vector<Bytes> good_frame() {
    begun("");
    checkpoints().keep(0, {0.1,
                           testing_meshes::cube().nodes,
                           {{"von_mises", FieldPlace::tet, 1, {1, 2, 3, 4, 5, 6}}}});
    return {bytes_of(begun("frame_000000.h5"))};
}

Reader surface_reader() {
    return [](const fs::path& path) { read_surface(path, Space::ras); };
}

Target surface(const std::string& ending) {
    return target("surface_" + ending.substr(1), ending, surface_reader(),
                  written(ending, [](const fs::path& path) {
                      write_surface(path, cube_surface(), Space::ras);
                  }));
}

/// Tracker recordings, points and registrations.
std::vector<Target> recording_targets() {
    return {
        target(
            "sequence", ".mha", [](const fs::path& p) { read_sequence(p); },
            written(".mha", [](const fs::path& p) { write_sequence(p, small_recording()); })),
        target(
            "sequence_nrrd", ".nrrd", [](const fs::path& p) { read_sequence(p); },
            texts({sequence_nrrd})),
        target(
            "fcsv", ".fcsv", [](const fs::path& p) { read_fiducials(p); }, texts({fcsv})),
        target(
            "mrk_json", ".mrk.json", [](const fs::path& p) { read_fiducials(p); },
            written(".mrk.json",
                    [](const fs::path& p) {
                        write_fiducials(p, {{"F1", {0.1, 0.2, 0.3}}, {"F2", {0, 0, 0}}});
                    })),
        target(
            "points_csv", ".csv", [](const fs::path& p) { read_points_csv(p); },
            texts({"name,x_mm,y_mm,z_mm\nA,1,2,3\n\"B, b\",4,5,6\n"})),
        target(
            "registration", ".json", [](const fs::path& p) { read_registration(p); },
            written(".json",
                    [](const fs::path& p) { write_registration(p, small_registration()); })),
        target(
            "tip", ".json", [](const fs::path& p) { read_tip(p); },
            written(".json",
                    [](const fs::path& p) {
                        write_tip(p, {"Stylus", {}, {}, 1e-8 * Eigen::Matrix3d::Identity()});
                    })),
    };
}

/// Scenes and studies.
std::vector<Target> study_targets() {
    return {
        target(
            "scene", ".yaml", [](const fs::path& p) { load_scene(p); }, texts({scene})),
        target(
            "study", ".yaml", [](const fs::path& p) { load_study(p); },
            [] {
                beside();
                return texts({study, hypercube})();
            }),
        target(
            "study_row", ".h5",
            [](const fs::path& p) {
                with_study([&](const Study&, StudyStore& store) {
                    fs::copy_file(p, folder() / "kept.h5.parts/000000.h5",
                                  fs::copy_options::overwrite_existing);
                    fs::copy_file(p, folder() / "kept.h5.parts/000001.h5",
                                  fs::copy_options::overwrite_existing);
                    store.check_rows();
                    store.row(0);
                });
            },
            [] {
                std::vector<Bytes> row;
                with_study([&](const Study&, StudyStore& store) {
                    store.keep(0, small_row());
                    row.push_back(bytes_of(folder() / "kept.h5.parts/000000.h5"));
                });
                return row;
            }),
        target(
            "study_table", ".h5", [](const fs::path& p) { StudyFile(p).table(); },
            [] {
                with_study([&](const Study&, StudyStore& store) {
                    for (std::size_t k = 0; k < 2; ++k) store.keep(k, small_row());
                    store.write_result({});
                });
                return std::vector<Bytes>{bytes_of(folder() / "kept.h5")};
            }),
    };
}

/// Checkpoints, scripts and results of runs.
std::vector<Target> run_targets() {
    return {
        target(
            "checkpoint", ".h5",
            [](const fs::path& p) {
                fs::copy_file(p, begun("checkpoint.h5"), fs::copy_options::overwrite_existing);
                checkpoints().read();
            },
            good_checkpoint),
        target(
            "checkpoint_frame", ".h5",
            [](const fs::path& p) {
                fs::copy_file(p, begun("frame_000000.h5"), fs::copy_options::overwrite_existing);
                checkpoints().check_frames(1);
                checkpoints().frame(0);
            },
            good_frame),
        target(
            "view_script", ".txt",
            [](const fs::path& p) { ViewScript(read_text_file(p), p.string()); },
            texts({"frame 2\ntime 0.5 # s\ncolour stress\nslices deformed\ncross 1 2 3\nvolume "
                   "on\nlook front\nscreenshot a.png\n"})),
        target(
            "motion_script", ".yaml",
            [](const fs::path& p) { parse_motion_script(read_text_file(p), p.string()); },
            texts({script})),
        target(
            "truth", ".json", [](const fs::path& p) { read_truth(p); },
            written(".json", [](const fs::path& p) { write_truth(p, small_truth()); })),
        target(
            "run", ".h5",
            [](const fs::path& p) {
                const RunResult run = read_run_result(std::make_shared<const ResultReader>(p), p);
                for (std::size_t k = 0; k < run.frames.size(); ++k) run.displacement(k);
                read_recorded_run(ResultReader(p), p.string());
            },
            written(".h5", write_run)),
    };
}

/// Images.
std::vector<Target> image_targets() {
    return {
        target(
            "nifti", ".nii", [](const fs::path& p) { read_label_image(p); },
            written(".nii", [](const fs::path& p) { write_image(p, small_image()); })),
        target(
            "nifti_gz", ".nii.gz", [](const fs::path& p) { read_label_image(p); },
            written(".nii.gz", [](const fs::path& p) { write_image(p, small_image()); })),
        target(
            "nrrd", ".nrrd", [](const fs::path& p) { read_grey_image(p); },
            texts({with_voxels(nrrd)})),
        target(
            "meta_image", ".mha", [](const fs::path& p) { read_grey_image(p); },
            texts({with_voxels(meta_image)})),
        target(
            "dicom", ".dcm", [](const fs::path& p) { read_grey_image(p); },
            dicom_seeds([](const fs::path& p) { testing_dicom::write_slice(p, {}); })),
        target(
            "dicom_segmentation", ".dcm", [](const fs::path& p) { read_label_image(p); },
            dicom_seeds([](const fs::path& p) {
                testing_dicom::write_segmentation(
                    p, {.frames = {{1, 30, std::string(12, '\1')}, {2, 36}}});
            })),
        target(
            "nrrd_header", ".nhdr", [](const fs::path& p) { read_grey_image(p); },
            header_of_voxels(
                replaced(nrrd, "encoding: raw\n", "encoding: raw\ndata file: voxels.raw\n"))),
        target(
            "meta_header", ".mhd", [](const fs::path& p) { read_grey_image(p); },
            header_of_voxels(replaced(meta_image, "LOCAL", "voxels.raw"))),
    };
}

/// Meshes, surfaces and hierarchies.
std::vector<Target> mesh_targets() {
    return {
        target(
            "msh", ".msh", [](const fs::path& p) { read_gmsh(p, 1); },
            written(".msh", [](const fs::path& p) { write_gmsh(p, testing_meshes::cube(), 1); })),
        target(
            "vtu", ".vtu", [](const fs::path& p) { read_vtu(p, 1e-3); }, texts({vtu})),
        surface(".stl"),
        surface(".ply"),
        surface(".vtk"),
        target("surface_vtp", ".vtp", surface_reader(), texts({vtp})),
        target("surface_obj", ".obj", surface_reader(), texts({obj})),
        target("surface_off", ".off", surface_reader(), texts({off})),
        target(
            "hierarchy", ".h5", [](const fs::path& p) { read_hierarchy(p); },
            written(".h5",
                    [](const fs::path& p) {
                        MeshHierarchy hierarchy;
                        hierarchy.levels.push_back(testing_meshes::cube());
                        write_hierarchy(p, hierarchy);
                    })),
    };
}

}  // namespace

std::vector<Target> targets() {
    // A reader that allocates what a wrong size asks for must fail here, not at a user's.
    const rlimit memory{rlim_t(6) << 30, rlim_t(6) << 30};
    setrlimit(RLIMIT_AS, &memory);
    std::vector<Target> all;
    for (auto part :
         {recording_targets(), study_targets(), run_targets(), image_targets(), mesh_targets()})
        std::move(part.begin(), part.end(), std::back_inserter(all));
    return all;
}

}  // namespace livetet::fuzz
