#include "apps/live/target_responses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/live/response_nodes.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "base/sliced_task.hpp"
#include "mesh/hex_hierarchy.hpp"
#include "mesh/surface_patch.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

namespace {

/// See with_neighbours.
constexpr std::size_t samples_of_place = 7;

/// On a larger mesh, the effect of ten-node elements in place of four-node ones is found on the
/// next coarser level, where it is larger. It is taken to be of first order in the edges' length,
/// as beside a patch's edge, where strains are singular; inside it falls faster.
constexpr std::size_t max_tets_for_p2 = 15000;

/// The scene's body with small strain, at rest.
Scene linear_static(Scene scene) {
    scene.strain = "linear";
    for (Material& m : scene.materials) m.model = {};
    scene.time.scheme = TimeScheme::static_equilibrium;
    scene.solver.max_iterations = SolverOptions{}.max_iterations;  // not a frame's
    return scene;
}

bool has_ten_nodes(const Scene& scene) { return scene.elements == Elements::p2; }

bool is_grid(const MeshHierarchy& hierarchy) { return !hierarchy.levels.front().hexahedra.empty(); }

/// The coarser levels as a hierarchy; empty where there are none. Of a grid: the next one.
MeshHierarchy without_finest(const MeshHierarchy& hierarchy) {
    MeshHierarchy coarse;
    if (is_grid(hierarchy)) {
        const TetMesh& mesh = hierarchy.levels.front();
        std::vector<TetMesh> levels = grid_hierarchy(mesh, mesh.hexahedra.size() - 1).meshes.levels;
        if (levels.size() > 1) coarse.levels.push_back(std::move(levels[1]));
        return coarse;
    }
    // Below ten-node tets that a cut has opened is the same mesh with four nodes.
    const std::ptrdiff_t finest = hierarchy.levels.front().edge_nodes.empty() ? 1 : 2;
    if (std::ssize(hierarchy.levels) <= finest) return coarse;
    coarse = hierarchy;
    coarse.levels.erase(coarse.levels.begin(), coarse.levels.begin() + finest);
    coarse.transfers.erase(coarse.transfers.begin(), coarse.transfers.begin() + finest);
    const std::ptrdiff_t has_parents = std::min(finest, std::ssize(coarse.parents));
    coarse.parents.erase(coarse.parents.begin(), coarse.parents.begin() + has_parents);
    return coarse;
}

/// Edge of a regular tet of the mesh's mean volume, m.
double edge_of(const TetMesh& mesh) {
    return std::cbrt(6 * std::sqrt(2.0) * volume(mesh) / static_cast<double>(mesh.tets.size()));
}

/// Each place, then the places `step` before and behind it along each axis.
std::vector<Vector3> with_neighbours(std::span<const Vector3> places, double step) {
    std::vector<Vector3> all;
    for (const Vector3& place : places) {
        all.push_back(place);
        for (int axis = 0; axis < 3; ++axis)
            for (const double way : {step, -step}) all.push_back(place + way * Vector3::Unit(axis));
    }
    return all;
}

}  // namespace

ResponsePatch response_patch(const SensorPatch& patch) {
    return {.nodes = patch.nodes(),
            .wider_nodes = patch.wider_nodes(),
            .wider_by = patch.wider_by(),
            .radius_spread = patch.options().radius_spread,
            .centre = patch.drive().base()->translation,
            .place = patch.rest_place(),
            .radius = patch.options().radius,
            .stiffness = patch.options().stiffness,
            .turns = patch.options().drive.motion == DriveMotion::rigid,
            .ring = patch.ring()};
}

TargetResponses::TargetResponses(const Scene& scene, MeshHierarchy hierarchy,
                                 std::vector<Vector3> places)
    : scene_(linear_static(scene)), hierarchy_(std::move(hierarchy)), places_(std::move(places)) {
    const TetMesh& mesh = hierarchy_.levels.front();
    std::vector<FixOptions> fix = std::exchange(scene_.fix, {});  // listed in the work
    list_selected_nodes(scene_, mesh);
    scene_.fix = std::move(fix);
    pause_point();
    const bool needs_coarse = extrapolates() || mesh.tets.size() > max_tets_for_p2;
    if (!places_.empty() && needs_coarse) coarse_ = without_finest(hierarchy_);
    if (!coarse_.levels.empty()) {
        const double ratio = edge_of(mesh) / edge_of(coarse_.levels.front());
        constexpr double largest_ratio = 0.8;  // nearer sizes tell nothing of their error's order
        if (extrapolates() && ratio > largest_ratio) coarse_ = {};
        // Richardson: with an error c h^p, G_h - G_H = c (h^p - H^p), so that G - G_h is
        // -h^p / (H^p - h^p) of G_H - G_h. The orders p are those of even meshes at the rim of a
        // patch (docs/theory/elements.md).
        constexpr double order_of_ten_nodes = 1.3, order_of_hexahedra = 1;
        const double power =
            std::pow(ratio, is_grid(hierarchy_) ? order_of_hexahedra : order_of_ten_nodes);
        coarse_share_ = extrapolates() ? -power / (1 - power) : ratio;
    }
    edge_ = edge_of(mesh);
    for (std::size_t i = 0; i < scene_.materials.size(); ++i)
        for (Uncertain Material::*value : {&Material::young_Pa, &Material::poisson})
            if ((scene_.materials[i].*value).spread > 0) uncertain_materials_.push_back({i, value});
}

TargetResponses TargetResponses::on_mesh(const Scene& scene, MeshHierarchy hierarchy) const {
    TargetResponses responses(scene, std::move(hierarchy), places_);
    responses.has_warned_ = has_warned_;
    return responses;
}

bool TargetResponses::extrapolates() const { return has_ten_nodes(scene_) || is_grid(hierarchy_); }

bool TargetResponses::knows_elements() const {
    if (lacking_.elements) return false;
    if (!extrapolates() && hierarchy_.levels.front().tets.size() <= max_tets_for_p2) return true;
    return !coarse_.levels.empty() && std::ranges::none_of(scene_.fix, [](const FixOptions& fix) {
        return fix.stiffness_N_per_m.has_value();
    });
}

void TargetResponses::warn_of_large_mesh() {
    if (has_warned_ || knows_elements()) return;
    has_warned_ = true;
    const std::string compared =
        extrapolates()
            ? fmt::format("{} are compared with those on",
                          is_grid(hierarchy_) ? "hexahedra" : "those of ten nodes")
            : fmt::format("on a mesh of more than {} tets they are compared on", max_tets_for_p2);
    log_warning(fmt::format("error statement lacks elements: {} the next coarser level, and {}",
                            compared,
                            coarse_.levels.empty() ? "there is none" : "fix has springs"));
}

void TargetResponses::add_units(Variation variation, std::size_t value) {
    units_.push_back({variation, value});
    for (std::size_t p = 0; p < patches_.size(); ++p) {
        const bool turns = patches_[p].turns && !places_.empty();
        for (int motion = 0; motion < (turns ? 6 : 3); ++motion)
            units_.push_back({variation, value, p, motion});
    }
}

void TargetResponses::start(std::vector<ResponsePatch> patches,
                            const std::vector<FixOptions>& fix) {
    patches_ = std::move(patches);
    scene_.fix = fix;
    const auto count = static_cast<int>(hierarchy_.levels.front().nodes.size());
    for (FixOptions& f : scene_.fix)
        if (f.nodes) std::erase_if(*f.nodes, [&](int n) { return n >= count; });
    units_.clear();
    next_ = 0;
    failure_.clear();
    lacking_ = {};
    body_.reset();
    if (!places_.empty()) warn_of_large_mesh();
    find_uncertain_fixes();
    rings_.assign(patches_.size(), Eigen::Matrix3d::Zero());
    responses_.assign(places_.size() * patches_.size(), {});
    for (PatchResponse& r : responses_) {
        r.materials.assign(uncertain_materials_.size(), Eigen::Matrix<double, 3, 6>::Zero());
        r.fixed.assign(uncertain_fixes_.size(), Eigen::Matrix<double, 3, 6>::Zero());
    }
    fields_.assign(6 * patches_.size(), {});
    coarse_fields_.assign(6 * patches_.size(), {});
    model_units_ = 0;
    if (patches_.empty()) return;
    add_units(Variation::none);
    model_units_ = units_.size();
    if (places_.empty()) return;
    add_units(Variation::wider);
    if (knows_elements()) {
        if (!coarse_.levels.empty() && !extrapolates()) add_units(Variation::coarse);
        add_units(Variation::elements);
    }
    for (std::size_t i = 0; i < uncertain_materials_.size(); ++i) add_units(Variation::material, i);
    for (std::size_t i = 0; i < uncertain_fixes_.size(); ++i) add_units(Variation::fixed, i);
}

void TargetResponses::find_uncertain_fixes() {
    uncertain_fixes_.clear();
    for (std::size_t i = 0; i < scene_.fix.size(); ++i) {
        const FixOptions& fix = scene_.fix[i];
        if (fix.spread_mm > 0) uncertain_fixes_.push_back({i, FixValue::border});
        if (fix.stiffness_N_per_m && fix.stiffness_N_per_m->spread > 0)
            uncertain_fixes_.push_back({i, FixValue::stiffness});
    }
}

double TargetResponses::share_done() const {
    return units_.empty() ? 1 : static_cast<double>(next_) / static_cast<double>(units_.size());
}

bool TargetResponses::work() {
    if (is_done()) return false;
    const Unit unit = units_[next_++];
    try {
        if (unit.motion < 0)
            set_up(unit);
        else
            solve(unit);
    } catch (const Error& error) {
        give_up(unit, error.what());
    }
    if (is_done()) {
        body_.reset();
        fields_.clear();
        coarse_fields_.clear();
    }
    return !is_done();
}

void TargetResponses::give_up(const Unit& unit, const std::string& why) {
    // what was computed of it so far is not known to hold
    const auto lose = [&](const std::string& sources, bool& is_lacking, auto change) {
        log_warning(fmt::format("error statement lacks {}: {}", sources, why));
        is_lacking = true;
        for (PatchResponse& r : responses_) change(r).setZero();
    };
    switch (unit.variation) {
        case Variation::none:
            log_warning(fmt::format(
                "{}: {}",
                places_.empty()
                    ? "slips of sensors are judged without the response of the tissue around"
                    : "error statement lacks sensors, patches, materials, fixed, elements, law",
                why));
            failure_ = why;
            next_ = units_.size();
            return;
        case Variation::wider:
            lose(
                "patches", lacking_.wider, [](PatchResponse & r) -> auto& { return r.wider; });
            break;
        case Variation::coarse:
        case Variation::elements:
            lose(
                "elements", lacking_.elements,
                [](PatchResponse & r) -> auto& { return r.elements; });
            break;
        case Variation::material:
            lose(
                fmt::format("materials, of materials[{}]",
                            uncertain_materials_[unit.value].material),
                lacking_.materials, [&](PatchResponse & r) -> auto& {
                    return r.materials[unit.value];
                });
            break;
        case Variation::fixed:
            lose(
                fmt::format("fixed, of fix[{}]", uncertain_fixes_[unit.value].fix),
                lacking_.fixed, [&](PatchResponse & r) -> auto& { return r.fixed[unit.value]; });
            break;
    }
    const auto is_lost = [&](const Unit& other) {
        if (unit.variation == Variation::coarse && other.variation == Variation::elements)
            return true;  // it needs those on the coarse level
        return other.variation == unit.variation && other.value == unit.value;
    };
    while (next_ < units_.size() && is_lost(units_[next_])) ++next_;
}

bool TargetResponses::is_on_coarse(Variation variation) const {
    return !coarse_.levels.empty() && has_other_mesh(variation);
}

bool TargetResponses::has_other_mesh(Variation variation) {
    return variation == Variation::coarse || variation == Variation::elements;
}

void TargetResponses::set_up(const Unit& unit) {
    variation_share_ = 1;
    const TetMesh& mesh = hierarchy_.levels.front();
    if (unit.variation == Variation::none) list_selected_nodes(scene_, mesh);
    if (unit.variation == Variation::wider) return;  // the same body
    body_.reset();
    Scene scene = scene_;
    Use use = Use::track;
    const bool on_coarse = is_on_coarse(unit.variation);
    if (on_coarse && fine_of_coarse_.empty())
        fine_of_coarse_ = nearest_on_surface(coarse_.levels.front(), mesh);
    if (unit.variation == Variation::elements) {
        scene.solver.kind = SolverKind::automatic;
        if (!is_grid(hierarchy_)) {
            scene.elements = Elements::p2;
            use = Use::solve;
        }
        variation_share_ = coarse_share_;
    }
    if (unit.variation == Variation::material) {
        const UncertainMaterial& u = uncertain_materials_[unit.value];
        Uncertain& value = scene.materials[u.material].*u.value;
        value = value.highest();
    }
    if (unit.variation == Variation::fixed) {
        const UncertainFix& u = uncertain_fixes_[unit.value];
        variation_share_ = vary_fix(scene.fix[u.fix], u.value);
    }
    Holding held = scene_holding(scene, mesh);
    if (on_coarse) held = on_other_nodes(held, fine_of_coarse_);
    body_ = std::make_unique<ResponseBody>(scene, on_coarse ? coarse_ : hierarchy_, use, held,
                                           with_neighbours(places_, edge_ / 2));
    if (has_other_mesh(unit.variation)) find_patches_on(body_->mesh());
}

/// Makes a fixed set stiffer by its spread, or wider by its border's, and at least by an edge of
/// the mesh. Returns one standard deviation as a share of the change.
double TargetResponses::vary_fix(FixOptions& fix, FixValue value) const {
    if (value == FixValue::stiffness) {
        fix.stiffness_N_per_m = fix.stiffness_N_per_m->highest();
        return 1;
    }
    const double spread = fix.spread_mm / 1e3, distance = std::max(spread, edge_);
    const std::vector<int> before = *fix.nodes;
    *fix.nodes = widened(hierarchy_.levels.front(), before, fix.where, distance);
    for (const ResponsePatch& patch : patches_)
        for (const std::int32_t n : patch.nodes)
            if (std::ranges::binary_search(*fix.nodes, n) && !std::ranges::binary_search(before, n))
                fail("a border of fix, off by {:.1f} mm, reaches a sensor's patch, expected less",
                     1e3 * distance);
    return spread / distance;
}

/// The patches as they are chosen on another mesh than the model's.
void TargetResponses::find_patches_on(const TetMesh& mesh) {
    other_patches_ = patches_;
    for (ResponsePatch& patch : other_patches_)
        patch.nodes = surface_patch(mesh, patch.place, patch.radius).nodes;
}

void TargetResponses::solve(const Unit& unit) {
    const bool on_coarse = is_on_coarse(unit.variation);
    auto& fields = on_coarse ? coarse_fields_ : fields_;
    std::vector<Vector3>& first = fields[6 * unit.patch + unit.motion];
    std::vector<Vector3> field =
        body_->solve(has_other_mesh(unit.variation) ? other_patches_ : patches_, unit.patch,
                     unit.motion, unit.variation == Variation::wider, first);
    store(unit, body_->sample(field));
    if (unit.variation == Variation::none && unit.motion < 3)
        rings_[unit.patch].col(unit.motion) = patches_[unit.patch].ring.interpolate(field);
    if (unit.variation == Variation::none || unit.variation == Variation::coarse)
        first = std::move(field);
}

void TargetResponses::store(const Unit& unit, std::span<const Vector3> at_samples) {
    // The elements' effect is taken from the coarse level's own response, or from the model's.
    const bool from_coarse =
        unit.variation == Variation::elements && is_on_coarse(unit.variation) && !extrapolates();
    for (std::size_t i = 0; i < places_.size(); ++i) {
        PatchResponse& r = responses_[i * patches_.size() + unit.patch];
        const auto here = at_samples.subspan(i * samples_of_place, samples_of_place);
        if (unit.variation == Variation::none) {
            r.motion.col(unit.motion) = here[0];
            if (unit.motion >= 3) continue;
            for (int axis = 0; axis < 3; ++axis)
                r.gradient[axis].col(unit.motion) =
                    (here[1 + 2 * axis] - here[2 + 2 * axis]) / edge_;
            continue;
        }
        const ResponsePatch& patch = patches_[unit.patch];
        double share = variation_share_;
        if (unit.variation == Variation::wider)
            share = patch.wider_by > 0 ? patch.radius_spread / patch.wider_by : 0;
        const Vector3 change =
            share * (here[0] - (from_coarse ? r.elements : r.motion).col(unit.motion));
        switch (unit.variation) {
            case Variation::none:
                break;
            case Variation::wider:
                r.wider.col(unit.motion) = change;
                break;
            case Variation::coarse:  // from which the elements' are to be taken
                r.elements.col(unit.motion) = here[0];
                break;
            case Variation::elements:
                r.elements.col(unit.motion) = change;
                break;
            case Variation::material:
                r.materials[unit.value].col(unit.motion) = change;
                break;
            case Variation::fixed:
                r.fixed[unit.value].col(unit.motion) = change;
                break;
        }
    }
}

}  // namespace livetet
