// The same mesh, elements, loads and material in CalculiX and here: the difference of
// displacements, relative to the largest. benchmarks/calculix.sh runs it.
//     linear: C3D4 and C3D10 against `linear` P1 and P2; Green's strain: *STEP, NLGEOM with
//     *ELASTIC is St Venant- Kirchhoff in CalculiX, against `green`.

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet::verification {
namespace {

const Isotropic rubber{1e6, 0.3, 1000};
const Vector3 size(0.2, 0.05, 0.05);

/// Force on each node of the far end, N: sideways and along.
Vector3 nodal_force(bool finite, std::size_t nodes) {
    return (finite ? 1.0 : 0.01) * Vector3(2, 3, -12) / static_cast<double>(nodes);
}

/// CalculiX reads at most 20 characters of a number.
std::string input_text(const TetMesh& mesh, bool finite) {
    std::string text = "*NODE, NSET=ALL\n";
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        text += fmt::format("{}, {:.12e}, {:.12e}, {:.12e}\n", n + 1, mesh.nodes[n].x(),
                            mesh.nodes[n].y(), mesh.nodes[n].z());
    text +=
        fmt::format("*ELEMENT, TYPE={}, ELSET=BODY\n", mesh.edge_nodes.empty() ? "C3D4" : "C3D10");
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        text += fmt::format("{}", e + 1);
        for (const std::int32_t n : mesh.tets[e]) text += fmt::format(", {}", n + 1);
        if (!mesh.edge_nodes.empty())
            for (const std::int32_t n : mesh.edge_nodes[e]) text += fmt::format(", {}", n + 1);
        text += "\n";
    }
    text += fmt::format(
        "*MATERIAL, NAME=RUBBER\n*ELASTIC\n{:.12e}, {}\n*SOLID SECTION, ELSET=BODY, "
        "MATERIAL=RUBBER\n*BOUNDARY\n",
        rubber.E, rubber.nu);
    for (const std::int32_t n : mesh.node_sets.at("x0")) text += fmt::format("{}, 1, 3\n", n + 1);
    text +=
        finite
            ? "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1.\n*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-9\n"
            : "*STEP\n*STATIC\n";
    text += "*CLOAD\n";
    const auto& end = mesh.node_sets.at("x1");
    const Vector3 force = nodal_force(finite, end.size());
    for (const std::int32_t n : end)
        for (int c = 0; c < 3; ++c)
            text += fmt::format("{}, {}, {:.12e}\n", n + 1, c + 1, force[c]);
    return text + "*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n*END STEP\n";
}

/// The displacements of the last increment in CalculiX's .dat file.
std::vector<Vector3> read_displacements(const std::filesystem::path& path, std::size_t nodes) {
    std::ifstream in(path);
    std::vector<Vector3> u(nodes, Vector3::Zero());
    std::size_t found = 0;
    for (std::string line; std::getline(in, line);) {
        std::istringstream numbers(line);
        std::size_t n = 0;
        Vector3 value;
        if (numbers >> n >> value.x() >> value.y() >> value.z() && n >= 1 && n <= nodes) {
            u[n - 1] = value;
            ++found;
        }
    }
    if (found < nodes)
        throw std::runtime_error(
            fmt::format("{} holds {} displacements, expected {}", path.string(), found, nodes));
    return u;
}

int compare(const std::filesystem::path& folder) {
    int failed = 0;
    fmt::print("{:<14} {:<10} {:>7} {:>7} {:>14} {:>12} {:>10}\n", "strain", "elements", "tets",
               "nodes", "largest u / mm", "difference", "allowed");
    for (const bool finite : {false, true})
        for (const bool quadratic : {false, true}) {
            Problem problem({box(size, {16, 4, 4})}, rubber,
                            {finite ? "green" : "linear", quadratic});
            problem.hold("x0", "xyz");
            const auto& end = problem.mesh().node_sets.at("x1");
            for (const std::int32_t n : end) problem.force(n, nodal_force(finite, end.size()));
            problem.solve(finite ? 4 : 1, 1e-11);
            const std::string name =
                fmt::format("{}_{}", finite ? "green" : "linear", quadratic ? "C3D10" : "C3D4");
            std::ofstream(folder / (name + ".inp")) << input_text(problem.mesh(), finite);
            const std::string command =
                fmt::format("cd '{}' && ccx {} >{}.log 2>&1", folder.string(), name, name);
            if (std::system(command.c_str()) != 0)
                throw std::runtime_error(
                    fmt::format("CalculiX failed, see {}/{}.log", folder.string(), name));
            const auto theirs = read_displacements(folder / (name + ".dat"), problem.node_count());
            double largest = 0, difference = 0;
            for (std::size_t n = 0; n < theirs.size(); ++n) {
                largest = std::max(largest, theirs[n].norm());
                difference = std::max(difference, (theirs[n] - problem.displacement()[n]).norm());
            }
            const double allowed = 1e-5, relative = difference / largest;
            failed += !(relative <= allowed);
            fmt::print("{:<14} {:<10} {:>7} {:>7} {:>14.4f} {:>12.1e} {:>10.0e}{}\n",
                       finite ? "green" : "linear", quadratic ? "P2, C3D10" : "P1, C3D4",
                       problem.mesh().tets.size(), problem.node_count(), 1e3 * largest, relative,
                       allowed, relative <= allowed ? "" : "  <-- NOT the same");
        }
    return failed ? 1 : 0;
}

}  // namespace
}  // namespace livetet::verification

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "usage: bench_calculix FOLDER (for CalculiX's files)\n");
        return 2;
    }
    try {
        livetet::PetscSession session("bench_calculix", {});
        return livetet::verification::compare(argv[1]);
    } catch (const std::exception& e) {
        fmt::print(stderr, "bench_calculix: {}\n", e.what());
        return 1;
    }
}
