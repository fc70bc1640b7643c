#include "mesh/point_locator.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/error.hpp"
#include "base/sliced_task.hpp"
#include "geometry/nearest_triangle.hpp"
#include "mesh/tet_frame.hpp"
#include "mesh/tet_weights.hpp"

namespace livetet {

namespace {

/// Weights down to this still count as inside, so that rounding cannot push a point on an inner
/// face out of both tets. Clamping them to zero moves the point by less than 1e-8 of an edge.
constexpr double inside_tolerance = 1e-8;

using Weights = std::array<double, 4>;

}  // namespace

/// Uniform grid with about as many cells as tets. Each cell lists the tets whose bounding boxes
/// touch it: tets_[first_[c]] to tets_[first_[c + 1] - 1].
class TetGrid {
  public:
    explicit TetGrid(const TetMesh& mesh) {
        for (const Vector3& x : mesh.nodes) box_.extend(x);
        const double margin = 1e-9 * box_.diagonal().norm();
        box_ = {box_.min() - Vector3::Constant(margin), box_.max() + Vector3::Constant(margin)};
        const Vector3 extent = box_.sizes();
        const double cell = std::cbrt(extent.prod() / static_cast<double>(mesh.tets.size()));
        for (int d = 0; d < 3; ++d)
            cells_[d] = std::clamp(static_cast<int>(extent[d] / cell), 1, 1024);
        per_metre_ = cells_.cast<double>().cwiseQuotient(extent);
        build_frames(mesh);
        fill(mesh);
    }

    /// The tet that contains x, and x's weights in it; -1 if there is none.
    std::int32_t find(const Vector3& x, Weights& weights) const {
        if (!box_.contains(x)) return -1;
        const std::size_t c = index(cell_of(x));
        std::int32_t best = -1;
        double best_weight = -inside_tolerance;
        for (std::int32_t i = first_[c]; i < first_[c + 1]; ++i) {
            const Weights w = frames_[tets_[i]].weights(x);
            const double min_weight = std::min(std::min(w[0], w[1]), std::min(w[2], w[3]));
            if (!(min_weight >= best_weight)) continue;
            best = tets_[i];
            weights = w;
            if (min_weight >= 0) break;
            best_weight = min_weight;
        }
        return best;
    }

  private:
    Eigen::Vector3i cell_of(const Vector3& x) const {
        const Eigen::Vector3i c = (x - box_.min()).cwiseProduct(per_metre_).cast<int>();
        return c.cwiseMax(0).cwiseMin(cells_ - Eigen::Vector3i::Ones());
    }

    std::size_t index(const Eigen::Vector3i& c) const {
        return c.x() + static_cast<std::size_t>(cells_.x()) *
                           (c.y() + static_cast<std::size_t>(cells_.y()) * c.z());
    }

    void build_frames(const TetMesh& mesh) {
        frames_.reserve(mesh.tets.size());
        for (const Tet& t : mesh.tets) {
            pause_point_at(frames_.size());
            frames_.push_back(frame_of(mesh, t));
        }
    }

    template <class Visit>
    void for_each_cell(const TetMesh& mesh, const Tet& t, const Visit& visit) const {
        Eigen::AlignedBox3d box;
        for (const std::int32_t n : t) box.extend(mesh.nodes[n]);
        const Vector3 margin = Vector3::Constant(inside_tolerance * box.diagonal().norm());
        const Eigen::Vector3i low = cell_of(box.min() - margin);
        const Eigen::Vector3i high = cell_of(box.max() + margin);
        for (int k = low.z(); k <= high.z(); ++k)
            for (int j = low.y(); j <= high.y(); ++j)
                for (int i = low.x(); i <= high.x(); ++i) visit(index({i, j, k}));
    }

    void fill(const TetMesh& mesh) {
        first_.assign(static_cast<std::size_t>(cells_.x()) * cells_.y() * cells_.z() + 1, 0);
        for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
            pause_point_at(e);
            for_each_cell(mesh, mesh.tets[e], [&](std::size_t c) { ++first_[c + 1]; });
        }
        for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
        tets_.resize(first_.back());
        std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
        for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
            pause_point_at(e);
            for_each_cell(mesh, mesh.tets[e],
                          [&](std::size_t c) { tets_[next[c]++] = static_cast<std::int32_t>(e); });
        }
    }

    Eigen::AlignedBox3d box_;
    Eigen::Vector3i cells_;
    Vector3 per_metre_;
    std::vector<TetFrame> frames_;
    std::vector<std::int32_t> first_, tets_;
};

namespace {

/// The tet behind each boundary triangle. These are in the order of their tets and each belongs to
/// one, so one pass over both lists is enough.
std::vector<std::int32_t> tets_behind(std::span<const Tet> tets,
                                      std::span<const Triangle> boundary) {
    std::vector<std::int32_t> behind;
    behind.reserve(boundary.size());
    for (std::size_t e = 0; e < tets.size(); ++e)
        while (behind.size() < boundary.size()) {
            const Triangle& f = boundary[behind.size()];
            const auto is_corner = [&](std::int32_t n) {
                return std::ranges::find(tets[e], n) != tets[e].end();
            };
            if (!std::ranges::all_of(f, is_corner)) break;
            behind.push_back(static_cast<std::int32_t>(e));
        }
    return behind;
}

}  // namespace

struct PointLocator::Search {
    std::vector<Tet> tets;
    TetGrid grid;
    std::vector<Triangle> boundary;
    std::vector<std::int32_t> behind;  ///< the tet behind each triangle of the boundary
    NearestTriangle nearest;

    explicit Search(const TetMesh& mesh)
        : tets(mesh.tets),
          grid(mesh),
          boundary(boundary_triangles(mesh.tets)),
          behind(tets_behind(mesh.tets, boundary)),
          nearest(mesh.nodes, boundary) {}
};

PointLocator::PointLocator(const TetMesh& mesh) {
    if (mesh.tets.empty()) fail("point locator: the mesh has no tetrahedra, expected at least one");
    search_ = std::make_unique<const Search>(mesh);
}

PointLocator::~PointLocator() = default;

std::span<const Triangle> PointLocator::boundary() const { return search_->boundary; }

PointLocator::Hit PointLocator::find(const Vector3& x) const {
    Hit hit;
    Weights w{};
    hit.tet = search_->grid.find(x, w);
    if (hit.tet >= 0) {
        hit.corners = search_->tets[hit.tet];
        hit.weights = inside_weights(w);
        return hit;
    }
    const NearestTriangle::Hit near = search_->nearest.find(x);
    hit.tet = search_->behind[near.triangle];
    const Triangle& f = search_->boundary[near.triangle];
    const Tet& t = search_->tets[hit.tet];
    const auto fourth =
        std::ranges::find_if(t, [&](std::int32_t n) { return std::ranges::find(f, n) == f.end(); });
    hit.corners = {f[0], f[1], f[2], *fourth};
    hit.weights = {near.weights[0], near.weights[1], near.weights[2], 0};
    hit.distance = near.distance;
    return hit;
}

}  // namespace livetet
