#include <algorithm>

#include "apps/live/tracked_body.hpp"
#include "apps/scene/mesh_grading.hpp"
#include "base/error.hpp"
#include "base/log.hpp"

namespace livetet {

void TrackedBody::place_patches() {
    for (Sensor& s : sensors_) {
        if (s.leaving || !s.patch.awaits_placement()) continue;
        const Vector3 place = s.patch.drive().base()->translation;
        const double distance =
            s.patch.place(body_.mesh(), surface_, frame_.displacement, farthest_from_organ);
        s.off_organ = distance <= farthest_from_organ ? 0 : distance;
        if (s.by_hand) {
            s.leaving = s.off_organ > 0;
            continue;
        }
        if (s.off_organ > 0 && misplaced_ == MisplacedSensor::refuse && s.patch.slips() == 0)
            fail(
                "track.sensors: {}: when placed, the sensor is at ({:.1f}, {:.1f}, {:.1f}) mm in "
                "the image, {:.1f} mm off "
                "the organ's surface, expected at most {:g} mm: is the registration of this "
                "recording?",
                s.options.tool, 1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z(), 1e3 * distance,
                1e3 * farthest_from_organ);
        if (s.off_organ > 0 || s.patch.slips() > 0) continue;
        if (const std::string cost =
                cost_of_place(body_.mesh(), scene_.elements, s.options, s.patch.rest_place());
            !cost.empty())
            log_warning(cost);
    }
}

namespace {

bool holds(const SensorPatch& patch) { return patch.is_hard() || patch.spring_stiffness() > 0; }

}  // namespace

/// Whether what is prescribed, or which free pieces sensors carry, has changed.
bool TrackedBody::is_held_anew() const {
    const bool any_free = cutting_ && !cutting_->free.empty();
    return std::ranges::any_of(sensors_, [&](const Sensor& s) {
        return s.is_hard != s.patch.is_hard() || (any_free && s.holds != holds(s.patch));
    });
}

/// A patch of three nodes determines where a piece is.
bool TrackedBody::is_carried(std::span<const std::int32_t> piece) const {
    return std::ranges::any_of(sensors_, [&](const Sensor& s) {
        return holds(s.patch) && std::ranges::count_if(s.patch.nodes(), [&](std::int32_t n) {
                                     return std::ranges::binary_search(piece, n);
                                 }) >= 3;
    });
}

/// Prescribes the pieces that nothing holds: they stay where they are from now on.
void TrackedBody::hold_free_pieces() {
    for (FreePiece& piece : cutting_->free) {
        if (is_carried(piece.nodes)) {
            piece.at.clear();
            continue;
        }
        if (piece.at.empty())
            for (const std::int32_t n : piece.nodes) piece.at.push_back(frame_.displacement[n]);
        for (std::size_t k = 0; k < piece.nodes.size(); ++k)
            constraints_.prescribe({&piece.nodes[k], 1}, piece.at[k]);
    }
}

/// Prescribed nodes: those of the scene, and the patches that are not held by springs.
void TrackedBody::take_constraints() {
    constraints_ = scene_constraints_->constraints();
    if (cutting_) hold_free_pieces();
    for (const std::int32_t n : driven_.nodes) driven_.slot[n] = -1;
    driven_.nodes.clear();
    driven_.by.clear();
    for (Sensor& s : sensors_) {
        s.is_hard = s.patch.is_hard();
        s.holds = holds(s.patch);
        if (!s.is_hard) continue;
        for (const std::int32_t n : s.patch.nodes()) {
            if (constraints_.components[n] != 0) continue;
            if (driven_.slot[n] < 0) {
                driven_.slot[n] = static_cast<std::int32_t>(driven_.nodes.size());
                driven_.nodes.push_back(n);
                driven_.by.push_back(0);
            }
            ++driven_.by[driven_.slot[n]];
        }
    }
    constraints_.prescribe(driven_.nodes, Vector3::Zero());
    driven_.to.assign(driven_.nodes.size(), Vector3::Zero());
    body_.body->set_constraints(constraints_);
}

void TrackedBody::move_patches() {
    std::fill(driven_.to.begin(), driven_.to.end(), Vector3::Zero());
    for (const Sensor& s : sensors_) {
        if (!s.is_hard) continue;
        for (std::size_t k = 0; k < s.patch.nodes().size(); ++k)
            if (const std::int32_t slot = driven_.slot[s.patch.nodes()[k]]; slot >= 0)
                driven_.to[slot] += s.patch.target(k) / driven_.by[slot];
    }
    body_.body->move_constraints(driven_.nodes, driven_.to);
}

/// Patches held by springs: those of soft sensors, and those being released or taken up again.
void TrackedBody::pull_patches() {
    const bool pull = std::any_of(sensors_.begin(), sensors_.end(),
                                  [](const Sensor& s) { return s.patch.spring_stiffness() > 0; });
    if (!pull && !pulled_) return;
    pulled_ = pull;
    springs_ = scene_constraints_->springs();
    if (!pull) {
        body_.body->set_springs(springs_);
        return;
    }
    springs_.stiffness.resize(driven_.slot.size(), 0);
    springs_.target.resize(driven_.slot.size(), Vector3::Zero());
    for (const Sensor& s : sensors_) {
        const double each = s.patch.spring_stiffness() /
                            static_cast<double>(std::max<std::size_t>(s.patch.nodes().size(), 1));
        if (each == 0) continue;
        for (std::size_t k = 0; k < s.patch.nodes().size();
             ++k) {  // overlapping patches pull to their mean
            double& stiffness = springs_.stiffness[s.patch.nodes()[k]];
            Vector3& target = springs_.target[s.patch.nodes()[k]];
            stiffness += each;
            target += each / stiffness * (s.patch.target(k) - target);
        }
    }
    body_.body->set_springs(springs_);
}

}  // namespace livetet
