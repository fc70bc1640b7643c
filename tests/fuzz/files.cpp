// Every reader of files, each fed with changed good files.
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

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

#include <gtest/gtest.h>

#include "io/meshes.hpp"

namespace livetet::fuzz {
namespace {

namespace fs = std::filesystem;
using Reader = std::function<void(const fs::path&)>;
using Writer = std::function<void(const fs::path&)>;

/// A folder of this process's own.
const fs::path& folder() {
    static const struct Folder {
        fs::path path = fs::temp_directory_path() / ("livetet_fuzz_" + std::to_string(::getpid()));
        Folder() { fs::create_directories(path); }
        ~Folder() { fs::remove_all(path); }
    } own;
    return own.path;
}

Bytes bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

Bytes bytes_of_text(std::string_view text) { return {text.begin(), text.end()}; }

/// A target for files named `in<ending>`.
Target target(std::string name, const std::string& ending, Reader read, std::function<std::vector<Bytes>()> seeds) {
    const auto run = [ending, read = std::move(read)](ByteView bytes) {
        const fs::path path = folder() / ("in" + ending);
        std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
        read(path);
    };
    return {std::move(name), run, std::move(seeds)};
}

/// Good files, as our own writers write them.
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
    return registration;
}

std::string with_voxels(const std::string& header) { return header + std::string(24, '\1'); }

const std::string nrrd =
    "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\nspace: left-posterior-superior\n"
    "space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (-10,-20,30)\n\n";
const std::string meta_image =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = 1 0 0 0 1 0 0 "
    "0 "
    "1\nOffset = -10 -20 30\nElementSpacing = 1 2 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = "
    "LOCAL\n";
const std::string vtu =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
    "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n<Points><DataArray type=\"Float64\" "
    "NumberOfComponents=\"3\" format=\"ascii\">0 0 0  10 0 0  0 10 0  0 0 10</DataArray></Points>\n"
    "<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>\n"
    "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells>\n"
    "<CellData><DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">7</DataArray></CellData>\n"
    "</Piece></UnstructuredGrid></VTKFile>\n";
const std::string vtp =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
    "byte_order=\"LittleEndian\">\n<PolyData><Piece "
    "NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"1\" "
    "NumberOfPolys=\"1\">\n<Points><DataArray "
    "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 10 0 0 0 10 0 0 0 "
    "10</DataArray></Points>\n<Strips>"
    "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray type=\"Int32\" "
    "Name=\"offsets\" format=\"ascii\">4</DataArray></Strips>\n<Polys><DataArray type=\"Int32\" Name=\"connectivity\" "
    "format=\"ascii\">0 2 1</DataArray><DataArray type=\"Int32\" Name=\"offsets\" "
    "format=\"ascii\">3</DataArray></Polys>\n"
    "</Piece></PolyData></VTKFile>\n";
const std::string fcsv =
    "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = "
    "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n1,10,20,30,0,0,0,1,1,1,0,F-1,,\n";
const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
const std::string off = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

Reader surface_reader() {
    return [](const fs::path& path) { read_surface(path, Space::ras); };
}

Target surface(const std::string& ending) {
    return target("surface_" + ending.substr(1), ending, surface_reader(),
                  written(ending, [](const fs::path& path) { write_surface(path, cube_surface(), Space::ras); }));
}

}  // namespace

std::vector<Target> targets() {
    // A reader that believes a size before it has seen the bytes shall fail here, not on somebody's machine.
    const rlimit memory{rlim_t(6) << 30, rlim_t(6) << 30};
    setrlimit(RLIMIT_AS, &memory);
    return {
        target(
            "sequence", ".mha", [](const fs::path& p) { read_sequence(p); },
            written(".mha", [](const fs::path& p) { write_sequence(p, small_recording()); })),
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
            written(".json", [](const fs::path& p) { write_registration(p, small_registration()); })),
        target(
            "tip", ".json", [](const fs::path& p) { read_tip(p); },
            written(".json",
                    [](const fs::path& p) {
                        write_tip(p, {"Stylus", {}, {}});
                    })),
        target(
            "nifti", ".nii", [](const fs::path& p) { read_label_image(p); },
            written(".nii", [](const fs::path& p) { write_image(p, small_image()); })),
        target(
            "nifti_gz", ".nii.gz", [](const fs::path& p) { read_label_image(p); },
            written(".nii.gz", [](const fs::path& p) { write_image(p, small_image()); })),
        target(
            "nrrd", ".nrrd", [](const fs::path& p) { read_grey_image(p); }, texts({with_voxels(nrrd)})),
        target(
            "meta_image", ".mha", [](const fs::path& p) { read_grey_image(p); }, texts({with_voxels(meta_image)})),
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

}  // namespace livetet::fuzz
