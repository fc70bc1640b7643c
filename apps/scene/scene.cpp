#include "apps/scene/scene.hpp"

#include <string_view>

#include "apps/scene/scene_files.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/key_places.hpp"
#include "config/yaml.hpp"

namespace livetet {

namespace {

/// Throws Error if the scene writes a file that it reads, or a file twice.
void refuse_overwritten_inputs(const Scene& scene, const KeyPlaces& places) {
    std::set<std::filesystem::path> read = read_files(scene);
    read.insert(places.file());
    const auto written = written_files(scene);
    for (const auto& [key, path] : written)
        for (const std::filesystem::path& input : read)
            if (same_file(path, input))
                fail("{} = {}: is read, expected another file to write ({})", key, path.string(),
                     places(key));
    for (std::size_t i = 0; i < written.size(); ++i)
        for (std::size_t j = i + 1; j < written.size(); ++j)
            if (same_file(written[i].second, written[j].second))
                fail("{} and {}: both name {}, expected two files ({})", written[i].first,
                     written[j].first, written[i].second.string(), places(written[j].first));
}

void check_selections(const Scene& scene, const KeyPlaces& places) {
    const auto check_soft = [&](auto& list, std::string_view name) {
        for (std::size_t i = 0; i < list.size(); ++i)
            if (list[i].stiffness_N_per_m && list[i].components.size() != 3)
                fail(
                    "{}[{}].components = {} with a stiffness: springs pull along x, y and z, "
                    "expected xyz ({})",
                    name, i, list[i].components, places(fmt::format("{}[{}].components", name, i)));
    };
    const auto check_all = [&](auto& list, std::string_view name) {
        for (std::size_t i = 0; i < list.size(); ++i)
            check_selection(list[i], fmt::format("{}[{}]", name, i), places);
    };
    check_soft(scene.fix, "fix");
    check_soft(scene.drive, "drive");
    check_all(scene.fix, "fix");
    check_all(scene.drive, "drive");
    check_all(scene.loads, "loads");
}

/// Refuses lists of nodes of a mesh that is no hierarchy: its nodes are numbered anew as it is
/// read, or made, so that other nodes than those of its file would be selected.
void refuse_node_numbers(const Scene& scene, const KeyPlaces& places) {
    if (ending(scene.mesh.file) == ".h5") return;
    const auto refuse = [&](const auto& list, std::string_view name) {
        for (std::size_t i = 0; i < list.size(); ++i) {
            if (!list[i].nodes) continue;
            const std::string key = fmt::format("{}[{}].nodes", name, i);
            fail(
                "{}: the nodes of {} are numbered anew as it is read, expected group, box_mm or "
                "the like, or the numbers of a hierarchy (.h5 of `livetet mesh`) as mesh.file ({})",
                key, scene.mesh.file.string(), places(key));
        }
    };
    refuse(scene.fix, "fix");
    refuse(scene.drive, "drive");
    refuse(scene.loads, "loads");
    if (scene.track) refuse(scene.track->targets, "track.targets");
    if (!scene.deform) return;
    refuse(scene.deform->forces, "deform.forces");
    refuse(scene.deform->targets, "deform.targets");
}

/// Makes the scene's relative paths relative to `folder`.
void resolve_paths(Scene& scene, const std::filesystem::path& folder) {
    const auto resolve = [&](std::filesystem::path& p) {
        if (!p.empty() && p.is_relative()) p = folder / p;
    };
    const auto resolve_source = [&](std::string& source) {  // a file or a stream
        if (source.find("://") != std::string::npos) return;
        std::filesystem::path path = source;
        resolve(path);
        source = path.string();
    };
    resolve(scene.mesh.file);
    resolve(scene.image);
    for (auto& f : scene.fix)
        if (f.mask) resolve(*f.mask);
    for (auto& d : scene.drive)
        if (d.mask) resolve(*d.mask);
    for (auto& l : scene.loads)
        if (l.mask) resolve(*l.mask);
    for (CutOptions& cut : scene.cuts) resolve(cut.file);
    const auto resolve_targets = [&](std::vector<TargetOptions>& targets) {
        for (TargetOptions& target : targets) {
            resolve(target.points);
            if (target.mask) resolve(*target.mask);
        }
    };
    if (scene.deform) {
        for (ForceZoneOptions& zone : scene.deform->forces)
            if (zone.mask) resolve(*zone.mask);
        resolve_targets(scene.deform->targets);
        resolve_source(scene.deform->surface_points);
        for (std::string& points : scene.deform->later_points) resolve_source(points);
        resolve(scene.deform->landmarks);
        resolve(scene.deform->landmarks_at_rest);
    }
    if (scene.track) {
        resolve_source(scene.track->source);
        resolve(scene.track->registration);
        resolve(scene.track->start);
        for (ToolOptions& tool : scene.track->tools) resolve(tool.tip);
        resolve_targets(scene.track->targets);
    }
    if (scene.probes) {
        resolve(scene.probes->points);
        resolve(scene.probes->displacements);
    }
    resolve(scene.output.file);
}

}  // namespace

void finish_scene(Scene& scene, const KeyPlaces& places, const std::filesystem::path& folder) {
    if (scene.mesh.file.empty())
        fail("mesh.file is missing, expected the body's mesh ({})", places("mesh"));
    if (scene.materials.empty())
        fail("materials is empty, expected at least one ({})", places("materials"));
    if (scene.time.scheme == TimeScheme::newmark && 2 * scene.time.beta < scene.time.gamma)
        fail(
            "time.beta = {} is below gamma / 2 = {}: not stable at every step, expected at least "
            "that ({})",
            scene.time.beta, scene.time.gamma / 2, places("time.beta"));
    check_selections(scene, places);
    refuse_node_numbers(scene, places);
    for (std::size_t i = 0; i < scene.cuts.size(); ++i)
        check_cut(scene.cuts[i], fmt::format("cuts[{}]", i), places);
    const bool has_blade = scene.track && has_blades(*scene.track);
    if (scene.free_pieces != FreePieces::refuse && scene.cuts.empty() && !has_blade)
        fail("free_pieces: applies to what cuts free, expected cuts ({})", places("free_pieces"));
    if (scene.free_pieces == FreePieces::leave_out && has_blade)
        fail(
            "free_pieces: leave_out with blade_mm in track.tools or track.cut_by_hand_mm: a mesh "
            "loses no cells while it is tracked, expected keep, or refuse for the cuts made at the "
            "start ({})",
            places("free_pieces"));
    if (scene.track) check_track(*scene.track, places);
    if (scene.deform) check_deform(*scene.deform, places);
    if (scene.probes && scene.probes->points.empty())
        fail("probes.points is missing, expected a CSV of points ({})", places("probes"));
    resolve_paths(scene, folder);
    refuse_overwritten_inputs(scene, places);
}

Scene load_scene(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    Scene scene = read_yaml<Scene>(text, path.string());
    finish_scene(scene, KeyPlaces(path.string(), text), path.parent_path());
    return scene;
}

}  // namespace livetet
