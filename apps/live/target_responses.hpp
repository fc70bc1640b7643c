#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/response_body.hpp"
#include "apps/scene/body_factory.hpp"
#include "tracking/sensor_patch.hpp"

namespace livetet {

/// How a place of the body at rest answers to the motion of one patch, to first order.
struct PatchResponse {
    /// Displacement for a translation of the patch, m/m, and its turn about
    /// `ResponsePatch::centre`, m/rad.
    Eigen::Matrix<double, 3, 6> motion = Eigen::Matrix<double, 3, 6>::Zero();
    /// Change of `motion`'s first three columns where the place moves by 1 m along an axis.
    std::array<Eigen::Matrix3d, 3> gradient{};
    /// Change of `motion` where the radii of all patches are greater by one standard deviation of
    /// this patch's, and by better elements: of ten nodes in place of four, or finer ones of ten.
    Eigen::Matrix<double, 3, 6> wider = Eigen::Matrix<double, 3, 6>::Zero();
    Eigen::Matrix<double, 3, 6> elements = Eigen::Matrix<double, 3, 6>::Zero();
    /// Change by one standard deviation of each uncertain material value, and of each uncertain
    /// border or stiffness of what is fixed.
    std::vector<Eigen::Matrix<double, 3, 6>> materials, fixed;
};

/// A patch as the responses take it, once it is placed.
ResponsePatch response_patch(const SensorPatch& patch);

/// Linear responses of places in a body to the motion of patches on its surface, by static solves
/// of the body with small strain: as it is, with wider patches, with other elements (ten nodes for
/// four, or ten on the next coarser level), and with each uncertain value of materials and fixed
/// nodes off by its spread. The differences are what the displacement may be off by. The solves of
/// the model as it is also give the responses of the tissue around the patches, which slips are
/// judged by; without places, these are all. A solve takes some frames' time: `work` makes one.
///
/// Use: `start` when patches were placed or released; then `work` until `is_done`.
class TargetResponses {
  public:
    /// `hierarchy`: as the scene's mesh was loaded, without ten-node tets. `places`: at rest, m.
    TargetResponses(const Scene& scene, MeshHierarchy hierarchy, std::vector<Vector3> places);

    /// Those of a mesh that was cut, at the same places; of ten-node tets all levels.
    TargetResponses on_mesh(const Scene& scene, MeshHierarchy hierarchy) const;

    /// `fix`: what holds the body now. With lists of nodes (list_selected_nodes) the work opens no
    /// file; midpoints in them that the hierarchy does not have are left out. Logs a warning, once,
    /// if the mesh is too large for the effect of the elements to be known.
    void start(std::vector<ResponsePatch> patches, const std::vector<FixOptions>& fix);
    /// Makes the next solve, or sets up a body for the next ones. Returns false if all is done. If
    /// the model's solves fail, the work ends, and `failure` tells why. If those of a variation
    /// fail, a warning is logged, and `lacking` tells it; other values of materials or fixed nodes
    /// keep their responses.
    bool work();
    bool is_done() const { return next_ == units_.size(); }
    /// All is done, and nothing failed.
    bool are_known() const { return is_done() && failure_.empty(); }
    double share_done() const;
    /// Why the responses could not be computed; empty if they could.
    const std::string& failure() const { return failure_; }

    /// What could not be computed, or not of each value; the changes that lack are 0.
    struct Lacking {
        bool wider = false, elements = false, materials = false, fixed = false;
    };
    const Lacking& lacking() const { return lacking_; }
    /// Whether the effect of the elements is known: not without a coarser level or on springs if
    /// the scene's have ten nodes or are hexahedra, or if the mesh is large and its solves would
    /// take too long.
    bool knows_elements() const;
    /// Valid once they are_known().
    const PatchResponse& at(std::size_t place, std::size_t patch) const {
        return responses_[place * patches_.size() + patch];
    }
    const std::vector<Vector3>& places() const { return places_; }

    /// Those of the model as it is are known; they are the first.
    bool knows_rings() const { return failure_.empty() && next_ >= model_units_; }
    /// Displacement of the tissue around a patch, as SurfaceRing::interpolate, for a translation of
    /// the patch while the others rest, m/m. Valid once knows_rings().
    const Eigen::Matrix3d& ring_response(std::size_t patch) const { return rings_[patch]; }

  private:
    /// What differs from the model.
    enum class Variation { none, wider, coarse, elements, material, fixed };
    struct Unit {
        Variation variation;
        std::size_t value = 0;  ///< index in uncertain_materials_ or uncertain_fixes_
        std::size_t patch = 0;
        int motion = -1;  ///< 0 to 5: along or about an axis; -1: sets up the body
    };
    /// A material value with a spread.
    struct UncertainMaterial {
        std::size_t material;
        Uncertain Material::*value;
    };
    enum class FixValue { border, stiffness };
    struct UncertainFix {
        std::size_t fix;
        FixValue value;
    };

    /// Whether the elements' effect is taken from the next coarser level of the same elements (ten
    /// nodes, hexahedra), by Richardson's extrapolation, not from tets of ten nodes.
    bool extrapolates() const;
    bool is_on_coarse(Variation variation) const;
    void warn_of_large_mesh();
    void add_units(Variation variation, std::size_t value = 0);
    void find_uncertain_fixes();
    void set_up(const Unit& unit);
    double vary_fix(FixOptions& fix, FixValue value) const;
    void give_up(const Unit& unit, const std::string& why);
    void find_patches_on(const TetMesh& mesh);
    static bool has_other_mesh(Variation variation);
    void solve(const Unit& unit);
    void store(const Unit& unit, std::span<const Vector3> at_places);

    Scene scene_;  ///< its selections are lists of nodes once the work has begun
    MeshHierarchy hierarchy_;
    std::vector<Vector3> places_;
    MeshHierarchy coarse_;     ///< without the finest level, to compare elements on; or empty
    double coarse_share_ = 1;  ///< effect of the elements, of the difference found on coarse_
    /// Of coarse_'s surface nodes: the nearest of the finest mesh; -1 inside.
    std::vector<std::int32_t> fine_of_coarse_;
    std::vector<ResponsePatch> other_patches_;
    double edge_ = 0;  ///< of the finest mesh, m
    std::vector<UncertainMaterial> uncertain_materials_;
    std::vector<UncertainFix> uncertain_fixes_;
    double variation_share_ = 1;  ///< one standard deviation, of the present variation
    Lacking lacking_;
    std::vector<ResponsePatch> patches_;
    std::vector<Unit> units_;
    std::size_t next_ = 0;
    std::unique_ptr<ResponseBody> body_;
    /// The model's, and those on coarse_, while work goes on.
    std::vector<std::vector<Vector3>> fields_, coarse_fields_;
    std::vector<PatchResponse> responses_;
    std::vector<Eigen::Matrix3d> rings_;  ///< see ring_response
    std::size_t model_units_ = 0;         ///< the first units: of the model as it is
    std::string failure_;
    bool has_warned_ = false;  ///< see start
};

}  // namespace livetet
