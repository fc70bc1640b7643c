#include "mechanics/rigid_motions.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <map>
#include <numeric>

namespace livetet {

namespace {

using Matrix6 = RigidMotionConstraints::Matrix6;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A direction with its largest component positive, and no -0.
Vector3 tidy(Vector3 v) {
    Eigen::Index largest = 0;
    v.cwiseAbs().maxCoeff(&largest);
    v *= (v[largest] < 0 ? -1 : 1) / v.norm();
    for (int c = 0; c < 3; ++c)
        if (std::abs(v[c]) < 1e-6) v[c] = 0;
    return v;
}

/// `motion`: translation and turn times `size`, about `centre`.
std::string describe(const Vector6& motion, const Vector3& centre, double size,
                     const std::string& where) {
    const Vector3 along = motion.head<3>(), turn = motion.tail<3>() / size;
    const auto text = [](const Vector3& v) {
        return fmt::format("({:.3g}, {:.3g}, {:.3g})", v.x(), v.y(), v.z());
    };
    if (turn.norm() * size < 1e-6 * motion.norm())
        return "translation along " + text(tidy(along)) + where;
    // The axis passes where the turn about the centre makes up for the translation across it.
    Vector3 through = centre + turn.cross(along) / turn.squaredNorm();
    for (int c = 0; c < 3; ++c)
        if (std::abs(through[c]) < 1e-9 * size) through[c] = 0;  // no -0.0
    return fmt::format("rotation about {} through ({:.1f}, {:.1f}, {:.1f}) mm{}", text(tidy(turn)),
                       1e3 * through.x(), 1e3 * through.y(), 1e3 * through.z(), where);
}

}  // namespace

std::vector<std::int32_t> connected_pieces(const TetMesh& mesh) {
    std::vector<std::int32_t> parent(mesh.nodes.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](std::int32_t n) {
        while (parent[n] != n) n = parent[n] = parent[parent[n]];
        return n;
    };
    const auto join = [&](std::int32_t a, std::int32_t b) {
        const std::int32_t low = std::min(root(a), root(b)), high = std::max(root(a), root(b));
        parent[high] = low;
    };
    for (const Tet& t : mesh.tets)
        for (int i = 1; i < 4; ++i) join(t[0], t[i]);
    for (std::size_t e = 0; e < mesh.edge_nodes.size(); ++e)
        for (const std::int32_t n : mesh.edge_nodes[e]) join(mesh.tets[e][0], n);
    for (std::size_t n = 0; n < parent.size(); ++n) parent[n] = root(static_cast<std::int32_t>(n));
    return parent;
}

void RigidMotionConstraints::constrain(const Vector3& x, std::uint8_t components) {
    const Vector3 arm = (x - centre_) / size_;
    for (int c = 0; c < 3; ++c) {
        if (!(components >> c & 1)) continue;
        Vector6 row;  // component c of t + w x arm
        row << Vector3::Unit(c), arm.cross(Vector3::Unit(c));
        gram_ += row * row.transpose();
    }
}

bool RigidMotionConstraints::constrains_all() const {
    const Vector6 values =
        Eigen::SelfAdjointEigenSolver<Matrix6>(gram_, Eigen::EigenvaluesOnly).eigenvalues();
    return values[0] > 1e-6 * std::max(1.0, values[5]);
}

std::vector<FreeMotion> free_motions(const RigidMotionConstraints& held, const std::string& where) {
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(held.gram());
    const double limit = 1e-10 * std::max(1.0, eigen.eigenvalues()[5]);
    int count = 0;
    while (count < 6 && eigen.eigenvalues()[count] < limit) ++count;
    if (count == 0) return {};
    // Pure translations first: the free motions without a turn; the others span the rest. A column
    // that is not free is a turn by more than any: what mixes none of these in comes before it.
    Matrix6 space = eigen.eigenvectors();
    space.rightCols(6 - count).setZero();
    Matrix6 turns = space.bottomRows<3>().transpose() * space.bottomRows<3>();
    for (int k = count; k < 6; ++k) turns(k, k) = 2;
    const Eigen::SelfAdjointEigenSolver<Matrix6> mixed(turns);
    std::vector<FreeMotion> free;
    for (int k = 0; k < count; ++k) {
        const bool pure = mixed.eigenvalues()[k] < 1e-12;
        Vector6 motion = space * mixed.eigenvectors().col(k);
        if (pure) motion.tail<3>().setZero();
        free.push_back({describe(motion, held.centre(), held.size(), where)});
    }
    return free;
}

std::vector<FreeMotion> free_rigid_motions(const TetMesh& mesh,
                                           std::span<const std::uint8_t> held) {
    struct Piece {
        Vector3 centre = Vector3::Zero();
        double size = 0;
        std::size_t nodes = 0;
    };
    const std::vector<std::int32_t> piece_of = connected_pieces(mesh);
    std::map<std::int32_t, Piece> all;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        Piece& piece = all[piece_of[n]];
        piece.centre += mesh.nodes[n];
        ++piece.nodes;
    }
    for (auto& [first, piece] : all) piece.centre /= static_cast<double>(piece.nodes);
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        Piece& piece = all[piece_of[n]];
        piece.size = std::max(piece.size, (mesh.nodes[n] - piece.centre).norm());
    }
    std::map<std::int32_t, RigidMotionConstraints> motions;
    for (const auto& [first, piece] : all)
        motions.emplace(first, RigidMotionConstraints(piece.centre, piece.size));
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (held[n]) motions.at(piece_of[n]).constrain(mesh.nodes[n], held[n]);
    std::vector<FreeMotion> free;
    for (const auto& [first, held_here] : motions) {
        const std::vector<FreeMotion> more = free_motions(
            held_here, motions.size() == 1 ? "" : fmt::format(" of the piece with node {}", first));
        free.insert(free.end(), more.begin(), more.end());
    }
    return free;
}

}  // namespace livetet
