#include "tracking/blade_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace livetet {

namespace {

constexpr int max_pieces_along = 255, max_pieces_across = 64;
/// A sweep at rest may be longer than in the image by this factor, where the body is compressed.
constexpr double longest_at_rest = 4;

double largest_move(std::span<const Vector3> a, std::span<const Vector3> b) {
    double distance = 0;
    for (std::size_t i = 0; i < a.size(); ++i) distance = std::max(distance, (a[i] - b[i]).norm());
    return distance;
}

int pieces_of(double length, double longest, int most) {
    return static_cast<int>(
        std::clamp(std::ceil(length / longest), 1.0, static_cast<double>(most)));
}

}  // namespace

bool BladeSweep::continues(const Seen& now) const {
    return last_ && now.rest.size() == last_->rest.size() && now.time_s >= last_->time_s &&
           now.time_s - last_->time_s <=
               (was_unseen_ ? options_.longest_gap_s : options_.longest_miss_s) &&
           largest_move(now.edge, last_->edge) <= options_.longest_step &&
           largest_move(now.rest, last_->rest) <= longest_at_rest * options_.longest_step;
}

/// The surface between two rows of points: a bilinear patch between each two neighbours, divided
/// across so that no piece is longer than longest_edge.
void BladeSweep::span(const std::vector<Vector3>& from, const std::vector<Vector3>& to) {
    const int across = pieces_of(largest_move(from, to), options_.longest_edge, max_pieces_across);
    const auto count = static_cast<std::int32_t>(from.size());
    for (int row = 0; row <= across; ++row) {
        const double s = static_cast<double>(row) / across;
        for (std::int32_t i = 0; i < count; ++i)  // both ends to the bit
            surface_.nodes.push_back(row == 0        ? from[i]
                                     : row == across ? to[i]
                                                     : from[i] + s * (to[i] - from[i]));
    }
    for (int row = 0; row < across; ++row)
        for (std::int32_t i = 0; i + 1 < count; ++i) {
            const std::int32_t a = row * count + i, b = a + count;
            surface_.triangles.push_back({a, a + 1, b + 1});
            surface_.triangles.push_back({a, b + 1, b});
        }
}

const TriangleMesh& BladeSweep::follow(double time_s, const std::optional<BladeEdge>& edge,
                                       const RestPlace& rest_place) {
    surface_.nodes.clear();
    surface_.triangles.clear();
    gap_.reset();
    if (!edge) {
        was_unseen_ = true;
        return surface_;
    }
    const auto& [a, b] = *edge;
    // The blade is rigid: as many pieces in each frame, but for rounding.
    const int pieces =
        pieces_of((b - a).norm() * (1 - 1e-9), options_.longest_edge, max_pieces_along);
    Seen now{time_s, *edge, {}};
    for (int i = 0; i <= pieces; ++i)
        now.rest.push_back(rest_place(a + static_cast<double>(i) / pieces * (b - a)));
    if (continues(now))
        span(last_->rest, now.rest);
    else if (last_)
        gap_ = {largest_move(now.edge, last_->edge), std::move(last_->rest), now.rest};
    last_ = std::move(now);
    was_unseen_ = false;
    return surface_;
}

}  // namespace livetet
