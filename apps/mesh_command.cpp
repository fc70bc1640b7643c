#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "apps/scene_body.hpp"
#include "base/file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"
#include "mesh/node_selection.hpp"
#include "meshing/quality.hpp"
#ifdef LIVETET_IMAGES
#include "apps/mesh_input.hpp"
#endif

namespace livetet {

namespace {

struct MeshArguments {
    MeshSource source;
    std::filesystem::path fixed_mask, output, json;
    bool metres = false;
};

/// The mesh of an image, surface, .msh, .h5 or scene; says what happened on the way.
MeshHierarchy make_mesh(MeshArguments& a) {
    const std::string end = ending(a.source.file);
    if (end == ".yaml" || end == ".yml") a.source = load_scene(a.source.file).mesh;
    ProgressLine progress("mesh");
#ifdef LIVETET_IMAGES
    if (!is_tet_mesh_name(a.source.file)) {
        MeshedInput meshed = mesh_input(a.source, progress.callback());
        progress.update(1, "done");
        if (meshed.image)
            fmt::print("picked       {:.1f} ml; largest part without holes {:.1f} ml; its surface encloses {:.1f} ml\n",
                       1e6 * meshed.image->label_volume_m3, 1e6 * meshed.image->body_volume_m3,
                       1e6 * meshed.image->surface_volume_m3);
        for (const std::string& note : meshed.result.notes) fmt::print("note         {}\n", note);
        return std::move(meshed.result.hierarchy);
    }
#endif
    return load_mesh(a.source, progress.callback());
}

void fix_nodes(MeshHierarchy& hierarchy, const std::filesystem::path& mask) {
    if (mask.empty()) return;
    const LabelImage image = read_label_image(mask);
    for (std::size_t l = 0; l < hierarchy.levels.size(); ++l) {
        TetMesh& mesh = hierarchy.levels[l];
        auto nodes = nodes_in_mask(mesh, image);
        if (nodes.empty() && l == 0)
            fail("{}: the mask covers no node of the mesh; are both in the same world?", mask.string());
        fmt::print("level {}      {} of {} nodes lie under {}: set \"fixed\"\n", l, nodes.size(), mesh.nodes.size(),
                   mask.filename().string());
        mesh.node_sets["fixed"] = std::move(nodes);
    }
}

void run(MeshArguments& a) {
    if (a.metres) a.source.unit = LengthUnit::metre;
    MeshHierarchy hierarchy = make_mesh(a);
    std::vector<MeshQuality> qualities;
    for (const TetMesh& level : hierarchy.levels) qualities.push_back(measure_quality(level));
    fmt::print("{}", quality_table(qualities));
    fix_nodes(hierarchy, a.fixed_mask);
    write_hierarchy(a.output, hierarchy);
    fmt::print("written      {}\n", a.output.string());
    if (a.json.empty()) return;
    nlohmann::json levels = nlohmann::json::array();
    for (const MeshQuality& q : qualities)
        levels.push_back({{"tets", q.tets},
                          {"nodes", q.nodes},
                          {"volume_ml", 1e6 * q.volume_m3},
                          {"mean_edge_mm", 1e3 * q.mean_edge_m},
                          {"min_dihedral_deg", q.min_dihedral_deg},
                          {"max_dihedral_deg", q.max_dihedral_deg},
                          {"min_radius_ratio", q.min_radius_ratio}});
    write_text_file(a.json, nlohmann::json{{"levels", levels}}.dump(2) + "\n");
}

}  // namespace

void add_mesh_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "mesh", "Meshes an image or surface: a hierarchy of tetrahedral meshes, with its quality");
    auto a = std::make_shared<MeshArguments>();
    command
        ->add_option("input", a->source.file,
                     "image (.nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd), surface (.stl, .obj, .ply, .vtk, .vtp, .off), mesh "
                     "(.msh, .vtu, .h5), or a scene (.yaml)")
        ->required();
    command->add_option("-o,--output", a->output, "hierarchy file to write (.h5)")->required();
    command->add_option("--labels", a->source.labels, "labels of the body, together (default: all but 0)")
        ->delimiter(',');
    command
        ->add_option("--threshold", a->source.threshold,
                     "of a grey image: the body is the voxels with values from LOW to HIGH, in its units; either may be "
                     "left out")
        ->type_name("LOW:HIGH")
        ->check([](const std::string& text) {
            return range_of(text) ? std::string() : "found '" + text + "', expected LOW:HIGH, such as 100:300, 100: or :300";
        });
    command->add_option("--tets", a->source.tets, "about how many tetrahedra the finest level gets")
        ->capture_default_str()
        ->check(CLI::Range(100, 20'000'000));
    command
        ->add_option("--levels", a->source.levels,
                     "how many levels; 0: as many as bring the coarsest to about 150 tets")
        ->capture_default_str()
        ->check(CLI::Range(0, 8));
    command
        ->add_option("--edge-lengths-mm", a->source.edge_lengths_mm,
                     "edge length of each level, finest first; instead of --tets and --levels")
        ->delimiter(',')
        ->check(CLI::PositiveNumber);
    command->add_flag("--metres", a->metres, "a .msh or .vtu is in metres, not millimetres");
    command
        ->add_option("--space", a->source.space,
                     "which way the axes of a surface, .msh or .vtu point: ras, or lps as Slicer's models since 2020")
        ->transform(CLI::CheckedTransformer(std::map<std::string, Space>{{"ras", Space::ras}, {"lps", Space::lps}}))
        ->default_str("ras");
    command->add_option("--fix", a->fixed_mask, "mask image, of any of the formats: nodes under it become the set \"fixed\"");
    command->add_option("--json", a->json, "write counts and quality to this file too");
    command->callback([a] { run(*a); });
}

}  // namespace livetet
