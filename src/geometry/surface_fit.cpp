#include "geometry/surface_fit.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/nearest_triangle.hpp"
#include "geometry/triangle_area.hpp"

namespace livetet {

namespace {

using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Motion = RigidTransform<ImageFrame, ImageFrame>;

constexpr std::size_t min_points = 10;
constexpr int max_halvings = 10;

void check(std::span<const Vector3d> points, const TriangleMesh& surface,
           const SurfaceFitOptions& options) {
    if (points.size() < min_points)
        fail("surface registration: {} points, expected at least {}", points.size(), min_points);
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!points[i].allFinite())
            fail("surface registration: point {} of {} has a coordinate that is not finite", i + 1,
                 points.size());
    if (surface.triangles.empty())
        fail("surface registration: the surface has no triangle, expected at least one");
    if (!(options.trimmed_share >= 0 && options.trimmed_share < 0.5))
        fail(
            "surface registration: the share of points left out is {}, expected at least 0 and "
            "below 0.5",
            options.trimmed_share);
}

/// The points used in the fit, matched with their nearest points on the surface.
struct Pairs {
    std::vector<Vector3d> place;   // on the surface
    std::vector<Vector3d> normal;  // from there to the point; the triangle's if they coincide
    std::vector<double> distance;
    double squares = 0;         // mean squared distance of the points used
    double squares_of_all = 0;  // the same of all points
};

class Fit {
  public:
    Fit(std::span<const Vector3d> points, const TriangleMesh& surface,
        const SurfaceFitOptions& options)
        : points_(points),
          surface_(surface),
          options_(options),
          tree_(surface.nodes, surface.triangles),
          count_(points.size() - static_cast<std::size_t>(options.trimmed_share *
                                                          static_cast<double>(points.size()))) {
        const Vector3d sum =
            std::accumulate(points.begin(), points.end(), Vector3d(Vector3d::Zero()));
        const Vector3d mean = sum / static_cast<double>(points.size());
        double squares = 0;
        for (const Vector3d& p : points) squares += (p - mean).squaredNorm();
        size_ = std::max(1e-9, std::sqrt(squares / static_cast<double>(points.size())));
    }

    SurfaceFit run() {
        SurfaceFit fit;
        Motion motion;
        Pairs pairs = pairs_at(motion);
        fit.rms_before = std::sqrt(pairs.squares);
        for (; fit.iterations < options_.max_iterations && !fit.converged; ++fit.iterations) {
            const Motion before = motion;
            if (!step(motion, pairs)) fit.converged = true;
            double farthest = 0;
            for (const Vector3d& p : points_)
                farthest = std::max(farthest, (motion * p - before * p).norm());
            fit.converged |= farthest <= options_.tolerance;
        }
        fit.image_from_start = {nearest_rotation(motion.rotation), motion.translation};
        fit.rms_after = std::sqrt(pairs.squares);
        fit.rms_of_all = std::sqrt(pairs.squares_of_all);
        fit.points = points_.size();
        fit.used = count_;
        const Normal normal = normal_equations(pairs);
        for (int k = 0; k < 6; ++k) {
            const Vector6d v = normal.eigen.eigenvectors().col(k);
            fit.motions.push_back(
                {v.head<3>(), v.tail<3>(), std::max(0.0, normal.eigen.eigenvalues()[k])});
            fit.free_motions += fit.motions.back().constraint < options_.min_constraint;
        }
        return fit;
    }

  private:
    struct Normal {
        Vector3d centre = Vector3d::Zero();
        Vector6d gradient = Vector6d::Zero();
        Eigen::SelfAdjointEigenSolver<Matrix6d> eigen;
    };

    /// Matches the moved points with the surface and drops the farthest.
    Pairs pairs_at(const Motion& motion) const {
        struct Pair {
            Vector3d place, normal;
            double distance;
        };
        std::vector<Pair> all;
        for (const Vector3d& p : points_) {
            const Vector3d moved = motion * p;
            const auto hit = tree_.find(moved);
            const Vector3d flat =
                area_vector(surface_.nodes, surface_.triangles[hit.triangle]).normalized();
            const bool off = hit.distance > 1e-9;
            all.push_back({hit.place, off ? Vector3d((moved - hit.place) / hit.distance) : flat,
                           hit.distance});
        }
        const auto end = all.begin() + static_cast<std::ptrdiff_t>(count_);
        const auto nearer = [](const Pair& a, const Pair& b) { return a.distance < b.distance; };
        if (end != all.end()) std::nth_element(all.begin(), end, all.end(), nearer);
        Pairs pairs;
        for (auto pair = all.begin(); pair != all.end(); ++pair) {
            const double square = pair->distance * pair->distance;
            pairs.squares_of_all += square / static_cast<double>(all.size());
            if (pair >= end) continue;
            pairs.squares += square / static_cast<double>(count_);
            pairs.place.push_back(pair->place);
            pairs.normal.push_back(pair->normal);
            pairs.distance.push_back(pair->distance);
        }
        return pairs;
    }

    // Gauss-Newton system of the distances. A motion v = (turn about the centre times size, slide)
    // changes distance i by c_i . v, c_i = (lever_i x n_i, n_i).
    Normal normal_equations(const Pairs& pairs) const {
        Normal normal;
        const auto count = static_cast<double>(count_);
        for (const Vector3d& y : pairs.place) normal.centre += y / count;
        Matrix6d sum = Matrix6d::Zero();
        for (std::size_t i = 0; i < count_; ++i) {
            const Vector3d& n = pairs.normal[i];
            const Vector3d lever = (pairs.place[i] + pairs.distance[i] * n - normal.centre) / size_;
            Vector6d c;
            c.head<3>() = lever.cross(n);
            c.tail<3>() = n;
            sum += c * c.transpose() / count;
            normal.gradient += c * pairs.distance[i] / count;
        }
        normal.eigen.compute(sum);
        return normal;
    }

    // One Gauss-Newton step in the constrained directions, halved until the sum of squares
    // decreases. Returns false if it never does.
    bool step(Motion& motion, Pairs& pairs) const {
        const Normal normal = normal_equations(pairs);
        Vector6d move = Vector6d::Zero();
        for (int k = 0; k < 6; ++k) {
            if (normal.eigen.eigenvalues()[k] < options_.min_constraint) continue;
            const Vector6d v = normal.eigen.eigenvectors().col(k);
            move -= v * (v.dot(normal.gradient) / normal.eigen.eigenvalues()[k]);
        }
        for (int halving = 0; halving < max_halvings; ++halving, move /= 2) {
            const Eigen::Matrix3d turn = rotation_of_vector(move.head<3>() / size_);
            const Motion tried =
                Motion{turn, normal.centre - turn * normal.centre + move.tail<3>()} * motion;
            Pairs there = pairs_at(tried);
            if (there.squares > pairs.squares) continue;
            motion = tried;
            pairs = std::move(there);
            return true;
        }
        return false;
    }

    std::span<const Vector3d> points_;
    const TriangleMesh& surface_;
    SurfaceFitOptions options_;
    NearestTriangle tree_;
    std::size_t count_;
    double size_ = 0;  // RMS distance of the points from their mean; scales rotations to lengths
};

}  // namespace

SurfaceFit fit_to_surface(std::span<const Vector3d> points, const TriangleMesh& surface,
                          const SurfaceFitOptions& options) {
    check(points, surface, options);
    return Fit(points, surface, options).run();
}

}  // namespace livetet
