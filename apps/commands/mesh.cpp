#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/commands/commands.hpp"
#include "apps/commands/mesh_source_options.hpp"
#include "apps/report/mesh_report.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/outputs.hpp"
#include "base/counted.hpp"
#include "base/file.hpp"
#include "image/mask_selection.hpp"
#include "io/dicom_name.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "io/text.hpp"
#include "mesh/hex_grid.hpp"
#include "meshing/body_mask.hpp"
#include "meshing/options.hpp"
#ifdef LIVETET_IMAGES
#include "apps/scene/mesh_input.hpp"
#include "config/yaml.hpp"
#include "meshing/label_volume.hpp"
#endif

namespace livetet {

namespace {

struct MeshArguments {
    MeshSource source;
    std::filesystem::path fixed_mask, grade_scene, output, json;
    bool again = false;
    MeshingOptions options;
    std::optional<double> budget_ms, inside_growth, fix_edge_ratio;
    std::vector<double> spheres;  ///< five numbers for each sphere
    SceneGrading grading;         ///< of the input scene or of grade_scene
};

bool is_scene(const std::filesystem::path& path) {
    return ending(path) == ".yaml" || ending(path) == ".yml";
}

/// Replaces invalid UTF-8, which file names and Gmsh's messages may contain.
std::string text_of(const nlohmann::json& json, int indent) {
    return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

#ifdef LIVETET_IMAGES
/// The mesh block and the options that it lacks, as given or by default.
nlohmann::json requested(const MeshArguments& a) {
    MeshSource source = a.source;
    source.file = image_filename(source.file);
    nlohmann::json json{{"mesh", to_yaml(source)},
                        {"min_dihedral_deg", a.options.min_dihedral_deg},
                        {"time_limit_s", a.options.gmsh_time_limit_s},
                        {"refine_spheres_mm", a.spheres}};
    if (a.inside_growth) json["inside_growth"] = *a.inside_growth;
    for (const auto& [key, patch] : a.grading.patches)
        json["graded_patches"].push_back(
            {{"key", key},
             {"centre_mm",
              {1e3 * patch.centre.x(), 1e3 * patch.centre.y(), 1e3 * patch.centre.z()}},
             {"radius_mm", 1e3 * patch.radius_m}});
    return json;
}

/// To be increased when the same input and options give another mesh than before.
constexpr int meshing_rules = 5;

/// A hash of everything that the result depends on: the bytes of input and mask, the options and
/// the versions. 64 bits of FNV-1a (G. Fowler, L. Noll, K. Vo). Empty if not all of it can be read.
std::optional<std::string> fingerprint(const MeshArguments& a) {
    MeshSource source = a.source;
    source.file.clear();  // hashed by its contents, not its name
    std::string text = fmt::format("{} {} {} {}\n{}", meshing_rules, LIVETET_VERSION,
                                   gmsh_version(), cgal_version(), to_yaml(source));
    text += fmt::format("{} {} {} {} {}", a.options.min_dihedral_deg, a.options.gmsh_time_limit_s,
                        a.inside_growth.value_or(0), a.fix_edge_ratio.value_or(1),
                        fmt::join(a.spheres, ","));
    text += '\n' + a.grading.text();
    for (const std::filesystem::path& file : {a.source.file, a.fixed_mask}) {
        if (file.empty()) continue;
        const auto contents = content_digest(file);
        if (!contents) return {};
        text += '\n' + *contents;
    }
    return digest(text);
}

/// The report stored in a hierarchy file of ours, or null if `solve` could not read the file.
nlohmann::json stored_report(const std::filesystem::path& path) {
    if (!std::filesystem::exists(path)) return nullptr;
    try {
        return nlohmann::json::parse(read_hierarchy(path).provenance, nullptr, false);
    } catch (const Error&) {
        return nullptr;  // not ours, or damaged: to be written again
    }
}

/// Meshes an image or surface. If that fails, writes the surface that it failed on beside the
/// output.
MeshHierarchy mesh_and_report(const MeshArguments& a, const std::string& key, nlohmann::json& json,
                              std::optional<ImageGrid>& image) {
    ProgressLine progress("mesh");
    std::filesystem::path look = a.output;
    look.replace_extension(".failed.stl");
    try {
        MeshedInput meshed = mesh_input(a.source, progress.callback(), a.options, a.grading);
        progress.update(1, "done");
        MeshReport report = report_of(meshed);
        fmt::print("{}", report.text);
        json = std::move(report.json);
        image = meshed.grid;
        json.update({{"made_by", meshed.result.hierarchy.provenance},
                     {"asked", requested(a)},
                     {"fingerprint", key}});
        if (!same_file(look, a.source.file))
            std::filesystem::remove(look);  // left by an earlier failure
        return std::move(meshed.result.hierarchy);
    } catch (const MeshingFailure& failure) {
        fail_with_surface(failure, look, a.source.file);
    }
}
#endif

#ifdef LIVETET_IMAGES
/// Makes a grid of hexahedra from an image.
MeshHierarchy grid_and_report(const MeshArguments& a, const std::string& key, nlohmann::json& json,
                              std::optional<ImageGrid>& image) {
    GridInput input = grid_input(a.source);
    image = input.image;
    const TetMesh& mesh = input.hierarchy.levels.front();
    const auto whole = std::count(mesh.shares.begin(), mesh.shares.end(), 1.0);
    const auto cells = mesh.hexahedra.size();
    const auto& voxels = input.grid.voxels_a_cell;
    Vector3 cell_mm = 1e3 * input.image.spacing();
    for (int d = 0; d < 3; ++d) cell_mm[d] *= voxels[d];
    fmt::print("grid         {} of {:.3g} x {:.3g} x {:.3g} mm ({} voxels), {} nodes\n",
               elements_text(mesh), cell_mm.x(), cell_mm.y(), cell_mm.z(), fmt::join(voxels, " x "),
               mesh.nodes.size());
    fmt::print("body         {:.4g} ml; {} partly outside\n", 1e6 * input.grid.body_m3,
               counted(cells - static_cast<std::size_t>(whole), "hexahedron is", "hexahedra are"));
    json = {{"hexahedra", cells},
            {"nodes", mesh.nodes.size()},
            {"partly_outside", cells - static_cast<std::size_t>(whole)},
            {"voxels_a_cell", voxels},
            {"cell_mm", {cell_mm.x(), cell_mm.y(), cell_mm.z()}},
            {"body_ml", 1e6 * input.grid.body_m3},
            {"levels", nlohmann::json::array()},
            {"notes", input.notes},
            {"made_by", input.hierarchy.provenance},
            {"asked", requested(a)},
            {"fingerprint", key}};
    for (const HexLevel& level : hex_levels(mesh, 1)) {
        fmt::print("level {}      {}, {} nodes\n", json["levels"].size(),
                   counted(level.cells.size(), "hexahedron", "hexahedra"), level.nodes);
        json["levels"].push_back({{"hexahedra", level.cells.size()}, {"nodes", level.nodes}});
    }
    for (const std::string& note : input.notes) fmt::print("note         {}\n", note);
    return std::move(input.hierarchy);
}
#endif

/// Makes the nodes under the mask the set "fixed" of every level; adds their numbers to `json`.
void fix_nodes(MeshHierarchy& hierarchy, const LabelImage& image, const MeshArguments& a,
               nlohmann::json& json) {
    const std::string name = a.fixed_mask.filename().string();
    json["fixed"] = {{"mask", name},
                     {"edge_ratio", a.fix_edge_ratio.value_or(1)},
                     {"nodes", nlohmann::json::array()}};
    for (std::size_t l = 0; l < hierarchy.levels.size(); ++l) {
        TetMesh& mesh = hierarchy.levels[l];
        auto nodes = nodes_in_mask(mesh, image);
        if (nodes.empty() && l == 0)
            fail("{}: the mask covers no node of the mesh; are both in the same world?",
                 a.fixed_mask.string());
        fmt::print("level {}      {} of {} nodes lie under {}: set \"fixed\"\n", l, nodes.size(),
                   mesh.nodes.size(), name);
        json["fixed"]["nodes"].push_back(nodes.size());
        mesh.node_sets["fixed"] = std::move(nodes);
        mesh.triangle_sets.erase("fixed");  // of a group of this name, which the set replaces
    }
}

/// Throws Error unless a hierarchy file is written and no input is overwritten. `given`: the scene,
/// or the input itself.
void check_outputs(const MeshArguments& a, const std::filesystem::path& given) {
    if (ending(a.output) != ".h5")
        fail("--output {}: the name ends in '{}', expected a hierarchy file: .h5",
             a.output.string(), ending(a.output));
    refuse_to_overwrite("--json", a.json, {given, a.source.file, a.fixed_mask, a.grade_scene});
    if (same_file(a.json, a.output))
        fail("--json {}: is the same file as --output, expected another", a.json.string());
    expect_writable(a.output);
    remove_left_parts(a.output);
}

/// Throws Error if an option does not apply to the input.
void check_options_for(const MeshArguments& a, const CLI::App& command) {
    const auto count = [&](const MeshKey& key) {
        return key.option && command.count(key.option) > 0;
    };
    const auto option = [](const MeshKey& key) { return std::string(key.option); };
    if (!is_scene(a.source.file)) {
        refuse_idle_keys(a.source.file, count, option);
        return refuse_keys_of_tets(a.source, count, option);
    }
    for (const MeshKey& key : mesh_keys())
        if ((key.key || key.option == std::string("--budget-ms")) && count(key))
            fail("{}: is a scene, whose mesh block says what {} would: write it there",
                 a.source.file.string(), key.option);
    refuse_idle_keys(load_scene(a.source.file).mesh.file, count, option);
}

/// The provenance of a mesh that was read. Without the fingerprint, which would claim that `mesh`
/// made what is written now: that may differ in its fixed nodes.
nlohmann::json read_provenance(const MeshHierarchy& hierarchy, const std::string& name) {
    nlohmann::json json = nlohmann::json::parse(hierarchy.provenance, nullptr, false);
    if (!json.is_object()) json = {{"made_by", hierarchy.provenance}};
    json.erase("fingerprint");
    json["read_by"] = fmt::format("livetet {} from {}", LIVETET_VERSION, name);
    return json;
}

/// Takes the mesh block of the input, if that is a scene, and what the mesh is graded by.
void take_scenes(MeshArguments& a) {
    if (is_scene(a.source.file)) {
        const Scene scene = load_scene(a.source.file);
        if (a.grade_scene.empty()) a.grading = grading_of(scene);
        a.source = scene.mesh;
    }
    if (a.grade_scene.empty()) return;
    a.grading = grading_by(load_scene(a.grade_scene));
    if (a.grading.patches.empty())
        fail(
            "--grade-scene {}: the scene states no place, expected track.sensors: place_mm or "
            "drive: sphere_mm",
            a.grade_scene.string());
}

#ifdef LIVETET_IMAGES
/// Says where the mesh is graded.
void print_grading(const SceneGrading& grading) {
    for (const auto& [key, patch] : grading.patches)
        fmt::print("graded       at ({:.1f}, {:.1f}, {:.1f}) mm, radius {:.1f} mm: {}\n",
                   1e3 * patch.centre.x(), 1e3 * patch.centre.y(), 1e3 * patch.centre.z(),
                   1e3 * patch.radius_m, key);
    if (grading.patches.empty()) return;
    for (const std::string& key : grading.without_place)
        fmt::print("not graded   {}: its place is not stated\n", key);
}
#endif

void run(MeshArguments& a) {
    const std::filesystem::path given = a.source.file;
    take_scenes(a);
    check_outputs(a, given);
    if (a.budget_ms) a.source.tets = static_cast<int>(tets_for_budget(1e-3 * *a.budget_ms));
    a.options.inside_growth = a.inside_growth;
    if (a.spheres.size() % 5 != 0)
        fail("--refine-sphere: {} numbers, expected x,y,z,radius,edge of each sphere",
             a.spheres.size());
    for (std::size_t i = 0; i < a.spheres.size(); i += 5)
        a.options.finer.push_back({Vector3(a.spheres[i], a.spheres[i + 1], a.spheres[i + 2]) / 1e3,
                                   a.spheres[i + 3] / 1e3, a.spheres[i + 4] / 1e3});

    std::optional<LabelImage> mask;  // read before minutes of meshing
    if (!a.fixed_mask.empty()) mask = read_mask(a.fixed_mask);
    nlohmann::json json;
    MeshHierarchy hierarchy;
    std::optional<ImageGrid> image;  // of the input
#ifdef LIVETET_IMAGES
    if (!is_tet_mesh_name(a.source.file)) {
        const std::optional<std::string> key = fingerprint(a);
        json = stored_report(a.output);
        if (!a.again && key && json.is_object() && json.contains("fingerprint") &&
            json["fingerprint"] == *key) {
            fmt::print(
                "unchanged    {} kept: made from the same input by the same options and version\n",
                a.output.string());
            if (!a.json.empty()) write_text_file(a.json, text_of(json, 2) + "\n");
            return;
        }
        print_grading(a.grading);
        if (mask && a.fix_edge_ratio) {
            a.options.finer_at_ratio = *a.fix_edge_ratio;
            a.options.finer_at =
                with_context(a.fixed_mask.string(), [&] { return mask_faces(*mask); });
        }
        if (mask)
            a.options.check_surface = [&](const TriangleMesh& surface) {
                with_context(a.fixed_mask.string(),
                             [&] { check_mask_reaches(*mask, surface.nodes); });
            };
        hierarchy = a.source.cells == MeshCells::hexahedra
                        ? grid_and_report(a, key.value_or(""), json, image)
                        : mesh_and_report(a, key.value_or(""), json, image);
    }
#endif
    if (hierarchy.levels.empty()) {
        ProgressLine progress("mesh");
        hierarchy = load_mesh(a.source, progress.callback(), {});
        if (kind_of(a.source.file) == MeshKind::hierarchy) image = read_image_grid(a.source.file);
        MeshReport report = report_of(hierarchy);
        fmt::print("{}", report.text);
        json = read_provenance(hierarchy, a.source.file.filename().string());
        json.update(report.json);
    }
    if (mask) fix_nodes(hierarchy, *mask, a, json);
    hierarchy.provenance = text_of(json, -1);
    write_hierarchy(a.output, hierarchy, image);
    fmt::print("written      {}\n", a.output.string());
    if (!a.json.empty()) write_text_file(a.json, text_of(json, 2) + "\n");
}

/// Options that only this command has: where the mesh is finer, and what a level must satisfy.
void add_meshing_options(CLI::App* command, MeshArguments* a) {
    command
        ->add_option("--budget-ms", a->budget_ms,
                     "instead of --tets: as many as a frame of this time can solve (0.1 us a tet)")
        ->check(CLI::Range(1e3 * live_seconds_per_tet * min_tets,
                           1e3 * live_seconds_per_tet * max_tets))
        ->excludes("--tets");
    command
        ->add_option("--refine-sphere", a->spheres,
                     "finer in a sphere: x,y,z,radius,edge in mm, RAS; several in one list")
        ->delimiter(',');
    command->add_option("--grade-scene", a->grade_scene,
                        "finer at the places of this scene (.yaml), with --tets as asked: "
                        "track.sensors: place_mm, drive: sphere_mm; in a scene mesh.grading");
    command
        ->add_option("--inside-growth", a->inside_growth,
                     "ratio of edge lengths deep inside to those on the surface, 1 to 10")
        ->check(CLI::Range(1.0, 10.0));
    command
        ->add_option("--min-dihedral-deg", a->options.min_dihedral_deg,
                     "smallest dihedral angle of an accepted level; 0: any")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 15.0));
    command
        ->add_option("--time-limit-s", a->options.gmsh_time_limit_s,
                     "time limit of each level, for remeshing and for filling")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
}

}  // namespace

void add_mesh_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("mesh",
                                           "Meshes an image or surface: a hierarchy of tetrahedral "
                                           "meshes and its quality, or a grid of "
                                           "hexahedra");
    auto a = std::make_shared<MeshArguments>();
    command
        ->add_option("input", a->source.file,
                     "image (.nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd; DICOM: a file or a folder), "
                     "surface (.stl, .obj, .ply, .vtk, .vtp, .off), mesh "
                     "(.msh, .vtu, .vtk, .h5), or a scene (.yaml)")
        ->required();
    command->add_option("-o,--output", a->output, "hierarchy file to write (.h5)")->required();
    add_source_options(*command, a->source);
    add_meshing_options(command, a.get());
    command->add_flag("--again", a->again,
                      "mesh even if the output was made from the same input and options");
    command->add_option(
        "--fix", a->fixed_mask,
        "mask image in any of the formats: nodes under it become the set \"fixed\"");
    command
        ->add_option("--fix-edge-ratio", a->fix_edge_ratio,
                     "finer at the border of the --fix mask: ratio of edge lengths there to those "
                     "elsewhere, 0.1 to 1, such as 0.5")
        ->check(CLI::Range(0.1, 1.0))
        ->needs("--fix");
    command->add_option("--json", a->json, "also write the report to this file");
    command->callback([a, command] {
        check_options_for(*a, *command);
        run(*a);
    });
}

}  // namespace livetet
