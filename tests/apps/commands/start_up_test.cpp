#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "io/hierarchy_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet::test {
namespace {

/// What images, surfaces and pictures need: VTK, ITK, GDCM, CGAL (MPFR); and Gmsh with
/// OpenCASCADE.
constexpr const char* of_images = "lib(vtk|ITK|gdcm|mpfr|gmsh|TK)";

/// The shared libraries that the program loads in a run, those that it opens by itself included.
std::set<std::string> loaded(const Folder& folder, const std::string& arguments) {
    const std::string log = (folder / "loaded").string();
    const Outcome outcome =
        livetet(folder, arguments, "LD_DEBUG=files LD_DEBUG_OUTPUT='" + log + "'");
    EXPECT_EQ(outcome.status, 0) << arguments << ": " << outcome.err;
    std::set<std::string> libraries;
    static const std::regex line(R"(calling init: \S*/([^/\s]+))");
    for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
        if (!file.path().filename().string().starts_with("loaded.")) continue;
        const std::string text = text_of(file.path());
        for (std::sregex_iterator match(text.begin(), text.end(), line), end; match != end; ++match)
            libraries.insert((*match)[1]);
        std::filesystem::remove(file.path());
    }
    return libraries;
}

std::set<std::string> named(const std::set<std::string>& libraries, const char* pattern) {
    std::set<std::string> found;
    for (const std::string& name : libraries)
        if (std::regex_search(name, std::regex(std::string("^") + pattern))) found.insert(name);
    return found;
}

const std::set<std::string> none;

void write_block_scene(const Folder& folder, const std::string& name, const std::string& fix) {
    write_hierarchy(folder / "block.h5",
                    make_hierarchy({block({2, 1, 1}, {0.2, 0.1, 0.1})}, "a block"));
    write_text(folder / name,
               "mesh: {file: block.h5}\nmaterials: [{young_Pa: 5000, poisson: 0}]\n"
               "gravity_m_per_s2: [0, 0, -1]\nfix: [" +
                   fix + "]\n");
}

TEST(StartUp, TheVersionNeedsNoLibraryOfTheSolversOrImages) {
    const Folder folder;
    const auto libraries = loaded(folder, "--version");
    EXPECT_EQ(named(libraries, "libstdc").size(), 1u);
    EXPECT_EQ(named(libraries, of_images), none);
    EXPECT_EQ(named(libraries, "lib(petsc|mpi|hdf5|HYPRE)"), none);
}

TEST(StartUp, SolvesDoNotLoadTheLibrariesOfImages) {
    const Folder folder;
    write_block_scene(folder, "scene.yaml", "{half_space_mm: [1, 0, 0, 1, 0, 0]}");
    const auto libraries = loaded(folder, "solve scene.yaml");
    EXPECT_EQ(named(libraries, "libpetsc").size(), 1u);
    EXPECT_EQ(named(libraries, of_images), none);
}

#ifdef LIVETET_IMAGES
TEST(StartUp, SolvesThatReadImagesLoadTheirLibraries) {
    const Folder folder;
    std::string voxels(2 * 12 * 12, 1);  // around the end of the block at x = 0
    write_text(folder / "end.nrrd",
               "NRRD0004\ntype: uint8\ndimension: 3\nspace: RAS\nsizes: 2 12 12\n"
               "space directions: (60,0,0) (0,10,0) (0,0,10)\nspace origin: (-30,-5,-5)\n"
               "encoding: raw\nkinds: domain domain domain\n\n" +
                   voxels);
    write_block_scene(folder, "scene.yaml", "{mask: end.nrrd}");
    const auto libraries = loaded(folder, "solve scene.yaml");
    EXPECT_NE(named(libraries, "libITK"), none);
    EXPECT_EQ(named(libraries, "libgmsh"), none);
    EXPECT_NE(named(loaded(folder, "view --help"), "libvtk"), none);
}

/// The folder of the tests is not where the other program is looked for.
TEST(StartUp, AMissingProgramIsNamed) {
    const Folder folder;
    std::filesystem::copy(LIVETET_PROGRAM, folder / "livetet");
    expect_refused(run(folder, "./livetet view --help"), {"livetet-full", "No such file"});
}
#endif

}  // namespace
}  // namespace livetet::test
