#include "geometry/point_order.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.hpp"
#include "geometry/point_moments.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::span<const Vector3d>;

// Sums over the pairs assigned so far. Adding a pair takes constant time.
struct PairSums {
    double count = 0, from_squares = 0, to_squares = 0;
    Vector3d from = Vector3d::Zero(), to = Vector3d::Zero();
    Matrix3d to_from = Matrix3d::Zero();

    PairSums with(const Vector3d& p, const Vector3d& x) const {
        return {count + 1, from_squares + p.squaredNorm(), to_squares + x.squaredNorm(), from + p,
                to + x,    to_from + x * p.transpose()};
    }
    // Residual sum of squares of the best rigid fit.
    double residual() const {
        const double squares =
            from_squares + to_squares - (from.squaredNorm() + to.squaredNorm()) / count;
        return std::max(0.0, squares - 2 * best_trace(to_from - to * from.transpose() / count));
    }
};

// Orders the points so that each is the farthest from all before it. Wrong partial assignments are
// then discarded early.
std::vector<std::size_t> far_apart_first(Points points) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());
    for (std::size_t k = 0; k + 1 < order.size(); ++k) {
        for (std::size_t l = k + 1; l < order.size(); ++l)
            distance[order[l]] =
                std::min(distance[order[l]], (points[order[l]] - points[order[k]]).norm());
        const auto next = std::max_element(
            order.begin() + static_cast<std::ptrdiff_t>(k) + 1, order.end(),
            [&](std::size_t a, std::size_t b) { return distance[a] < distance[b]; });
        std::swap(order[k + 1], *next);
    }
    return order;
}

class Search {
  public:
    Search(Points from, Points to)
        : sequence_(far_apart_first(to)), assigned_(to.size()), taken_(from.size()) {
        const auto about_mean = [](Points points) {
            const Vector3d mean =
                std::accumulate(points.begin(), points.end(), Vector3d(Vector3d::Zero())) /
                static_cast<double>(points.size());
            std::vector<Vector3d> moved;
            for (const Vector3d& p : points) moved.push_back(p - mean);
            return moved;
        };
        from_ = about_mean(from);
        to_ = about_mean(to);
        visit(0, {});
    }
    OrderSearch result() const { return {best_, rival_}; }

  private:
    struct Child {
        double bound;
        std::size_t from;
        PairSums sums;
    };

    // Lower bound of the residual: the best fit of two pairs leaves half the squared difference of
    // their distances.
    double pair_bound(std::size_t depth, std::size_t candidate) const {
        double worst = 0;
        for (std::size_t k = 0; k < depth; ++k) {
            const double to = (to_[sequence_[depth]] - to_[sequence_[k]]).norm();
            const double from = (from_[candidate] - from_[assigned_[sequence_[k]]]).norm();
            worst = std::max(worst, 0.5 * (to - from) * (to - from));
        }
        return worst;
    }

    void visit(std::size_t depth, const PairSums& sums) {
        std::vector<Child> children;
        for (std::size_t i = 0; i < from_.size(); ++i) {
            if (taken_[i]) continue;
            Child child{pair_bound(depth, i), i, {}};
            if (child.bound >= limit_) continue;
            child.sums = sums.with(from_[i], to_[sequence_[depth]]);
            if (depth >= 2) child.bound = std::max(child.bound, child.sums.residual());
            if (child.bound < limit_) children.push_back(child);
        }
        std::stable_sort(children.begin(), children.end(),
                         [](const Child& a, const Child& b) { return a.bound < b.bound; });
        for (const Child& child : children) {
            if (child.bound >= limit_) break;
            assigned_[sequence_[depth]] = child.from;
            taken_[child.from] = true;
            if (depth + 1 < to_.size())
                visit(depth + 1, child.sums);
            else
                keep(child.sums.residual());
            taken_[child.from] = false;
        }
    }

    void keep(double squares) {
        PointOrder found{assigned_, std::sqrt(squares / static_cast<double>(to_.size()))};
        if (best_.order.empty() || found.fre < best_.fre)
            rival_ = std::exchange(best_, std::move(found));
        else
            rival_ = std::move(found);
        if (!rival_.order.empty())
            limit_ = rival_.fre * rival_.fre * static_cast<double>(to_.size());
    }

    std::vector<Vector3d> from_, to_;
    std::vector<std::size_t> sequence_, assigned_;
    std::vector<bool> taken_;
    PointOrder best_, rival_;
    double limit_ = std::numeric_limits<double>::infinity();
};

}  // namespace

OrderSearch find_order(Points from, Points to) {
    checked_moments(from, to, {});
    if (from.size() > max_ordered_points)
        fail("order of the points: {} of them, expected at most {}", from.size(),
             max_ordered_points);
    return Search(from, to).result();
}

bool is_ambiguous(const OrderSearch& search, double noise) {
    return search.rival.fre < std::max(2 * search.best.fre, noise);
}

std::optional<BetterOrder> better_order(Points from, Points to, double bad_fre) {
    const PointMoments m = checked_moments(from, to, {});
    const double given = std::sqrt(
        std::max(0.0, m.variance_from + m.variance_to - 2 * best_trace(m.to_from_covariance)));
    if (from.size() > max_ordered_points || given <= bad_fre) return std::nullopt;
    const PointOrder best = find_order(from, to).best;
    if (best.fre >= given / 2) return std::nullopt;
    return BetterOrder{best, given};
}

PointOrder nearest_symmetry(Points points) {
    const OrderSearch search = find_order(points, points);
    const bool own = std::is_sorted(search.best.order.begin(), search.best.order.end());
    return own ? search.rival : search.best;
}

}  // namespace livetet
