#include "solvers/linear/hex_multigrid.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/hex_transfer.hpp"
#include "solvers/linear/lanczos_bound.hpp"

namespace livetet {

namespace {

using Vector24 = Eigen::Matrix<double, 24, 1>;
using Vector24f = Eigen::Matrix<float, 24, 1>;
using Corners = Eigen::Matrix<double, 3, 8>;

/// Chebyshev's interval, relative to the largest eigenvalue. That is estimated from below.
constexpr double margin = 1.05, smallest_smoothed = 0.06;

/// P of the cell in each octant, on components.
template <class Matrix>
const std::array<Matrix, 8>& octant_transfers() {
    static const std::array<Matrix, 8> transfers = [] {
        std::array<Matrix, 8> all;
        for (int octant = 0; octant < 8; ++octant) {
            all[octant].setZero();
            for (int i = 0; i < 8; ++i)
                for (int j = 0; j < 8; ++j)
                    for (int d = 0; d < 3; ++d)
                        all[octant](3 * i + d, 3 * j + d) = static_cast<typename Matrix::Scalar>(
                            corner_values_at_places()[place_in_parent(octant, i)][j]);
        }
        return all;
    }();
    return transfers;
}

Corners gather(const Hexahedron& cell, const double* x) {
    Corners values;
    for (int c = 0; c < 8; ++c) values.col(c) = Eigen::Map<const Eigen::Vector3d>(x + 3 * cell[c]);
    return values;
}

void scatter(const Hexahedron& cell, const Corners& values, double* y) {
    for (int c = 0; c < 8; ++c) Eigen::Map<Eigen::Vector3d>(y + 3 * cell[c]) += values.col(c);
}

/// Whether a coarse place holds several cells: parts of the body across a cut or another gap.
bool has_gaps(std::span<const HexLevel> levels) {
    return std::any_of(levels.begin() + 1, levels.end(), [](const HexLevel& level) {
        std::vector<HexPlace> places = level.places;
        std::sort(places.begin(), places.end());
        return std::ranges::adjacent_find(places) != places.end();
    });
}

}  // namespace

HexMultigrid::HexMultigrid(std::vector<HexLevel> levels, HexCells cells, int smoothing_steps)
    : cells_(std::move(cells)),
      smoothing_steps_(smoothing_steps),
      coarse_smoothing_steps_(has_gaps(levels) ? 2 * smoothing_steps : smoothing_steps) {
    for (const auto& [lambda, mu] : cells_.moduli) {
        TetElement cell = cells_.frame;
        cell.lambda = lambda, cell.mu = mu;
        stiffness_.push_back(hooke_stiffness(cell, cells_.dilation));
        volumetric_stiffness_.push_back(cell.volume * cell.lambda);
        cell.lambda = 0;
        shear_stiffness_.push_back(hooke_stiffness(cell, cells_.dilation));
    }
    for (HexLevel& grid : levels) {
        Level& level = levels_.emplace_back();
        level.grid = std::move(grid);
        const Eigen::Index size = 3 * static_cast<Eigen::Index>(level.grid.nodes);
        level.free = Vector::Ones(size);
        for (Vector* v : {&level.x, &level.r, &level.d, &level.w}) *v = Vector::Zero(size);
        if (levels_.size() < levels.size()) level.from = places_in_coarser(level.grid);
    }
    cells_at_node_.assign(levels_.front().grid.nodes, 0);
    for (const Hexahedron& cell : levels_.front().grid.cells)
        for (const std::int32_t n : cell) ++cells_at_node_[n];
}

void HexMultigrid::set_constrained(std::span<const std::uint8_t> components) {
    Level& finest = levels_.front();
    for (Eigen::Index i = 0; i < finest.free.size(); ++i)
        finest.free[i] = components[i / 3] >> (i % 3) & 1 ? 0 : 1;
    bounds_known_ = false;
}

void HexMultigrid::update(double s, std::span<const double> diagonal,
                          std::span<const Eigen::Matrix3d> rotations,
                          std::span<const CellDilation> dilations) {
    s_ = s;
    diagonal_.assign(diagonal.begin(), diagonal.end());
    rotations_.assign(rotations.begin(), rotations.end());
    dilations_.assign(dilations.begin(), dilations.end());
    find_uniform_cells();
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        if (l > 0) form_coarse_level(l);
        invert_diagonal(l);
        if (!bounds_known_ && l + 1 < levels_.size())
            levels_[l].largest = margin * largest_eigenvalue(l, bound_steps);
    }
    bounds_known_ = true;
    factor_coarsest();
}

void HexMultigrid::find_uniform_cells() {
    Level& finest = levels_.front();
    finest.uniform.assign(finest.grid.cells.size(), -1);
    if (!rotations_.empty()) return;
    for (std::size_t e = 0; e < finest.grid.cells.size(); ++e) {
        bool is_uniform = cells_.shares[e] == 1;
        for (const std::int32_t n : finest.grid.cells[e])
            is_uniform = is_uniform && finest.free.segment<3>(3 * n).sum() == 3 &&
                         (diagonal_.empty() || diagonal_[n] == 0);
        if (is_uniform) finest.uniform[e] = cells_.material[e];
    }
}

HexMultigrid::Matrix24f HexMultigrid::element_matrix(std::size_t l, std::size_t e) const {
    const Level& level = levels_[l];
    if (l > 0) return level.matrices[level.matrix[e]];
    const Hexahedron& cell = level.grid.cells[e];
    Matrix24 K = (s_ * cells_.shares[e]) * reference_stiffness(e);
    if (!rotations_.empty()) {
        const Eigen::Matrix3d& R = rotations_[e];
        for (int c = 0; c < 8; ++c) K.middleRows<3>(3 * c) = (R * K.middleRows<3>(3 * c)).eval();
        for (int c = 0; c < 8; ++c)
            K.middleCols<3>(3 * c) = (K.middleCols<3>(3 * c) * R.transpose()).eval();
    }
    if (!dilations_.empty()) {
        const Eigen::Map<const Vector24> b(dilations_[e].data());
        K +=
            (s_ * cells_.shares[e] * volumetric_stiffness_[cells_.material[e]]) * b * b.transpose();
    }
    for (int c = 0; c < 8; ++c) {
        const std::int32_t n = cell[c];
        if (!diagonal_.empty())
            K.diagonal().segment<3>(3 * c).array() += diagonal_[n] / cells_at_node_[n];
        for (int d = 0; d < 3; ++d)
            if (level.free[3 * n + d] == 0) {
                K.row(3 * c + d).setZero();
                K.col(3 * c + d).setZero();
            }
    }
    return K.cast<float>();
}

void HexMultigrid::form_coarse_level(std::size_t l) {
    const Level& fine = levels_[l - 1];
    Level& level = levels_[l];
    const std::size_t count = level.grid.cells.size();
    // A cell is uniform if its eight cells are, and alike.
    std::vector<int> children(count, 0);
    level.uniform.assign(count, -1);
    for (std::size_t e = 0; e < fine.grid.cells.size(); ++e) {
        const std::int32_t parent = fine.grid.parents[e];
        if (children[parent]++ == 0)
            level.uniform[parent] = fine.uniform[e];
        else if (level.uniform[parent] != fine.uniform[e])
            level.uniform[parent] = -1;
    }
    level.matrix.assign(count, -1);
    level.matrices.clear();
    std::vector<std::int32_t> shared(stiffness_.size(), -1), first(stiffness_.size(), -1);
    for (std::size_t e = 0; e < count; ++e) {
        if (children[e] < 8) level.uniform[e] = -1;
        const std::int32_t material = level.uniform[e];
        if (material >= 0 && shared[material] >= 0) {
            level.matrix[e] = shared[material];
            continue;
        }
        level.matrix[e] = static_cast<std::int32_t>(level.matrices.size());
        level.matrices.push_back(Matrix24f::Zero());
        if (material < 0) continue;
        shared[material] = level.matrix[e];
        first[material] = static_cast<std::int32_t>(e);  // whose cells make the matrix
    }
    for (std::size_t e = 0; e < fine.grid.cells.size(); ++e) {
        const std::int32_t parent = fine.grid.parents[e];
        const std::int32_t material = level.uniform[parent];
        if (material >= 0 && first[material] != parent) continue;
        const Matrix24f& P = octant_transfers<Matrix24f>()[octant_of(fine.grid.places[e])];
        const Matrix24f KP = element_matrix(l - 1, e) * P;
        level.matrices[level.matrix[parent]].noalias() += P.transpose() * KP;
    }
}

void HexMultigrid::invert_diagonal(std::size_t l) {
    Level& level = levels_[l];
    level.inverse.assign(level.grid.nodes, Eigen::Matrix3d::Zero());
    for (std::size_t e = 0; e < level.grid.cells.size(); ++e) {
        const bool is_plain = l == 0 && level.uniform[e] >= 0;
        const Matrix24f K = is_plain ? Matrix24f() : element_matrix(l, e);
        for (int c = 0; c < 8; ++c) {
            Eigen::Matrix3d& block = level.inverse[level.grid.cells[e][c]];
            if (is_plain)
                block += s_ * stiffness_[level.uniform[e]].block<3, 3>(3 * c, 3 * c);
            else
                block += K.block<3, 3>(3 * c, 3 * c).cast<double>();
        }
    }
    double largest = 0;
    for (const Eigen::Matrix3d& block : level.inverse)
        largest = std::max(largest, block.diagonal().maxCoeff());
    // A coarse component that moves no free component has an empty row.
    constexpr double empty = 1e-12;
    for (std::size_t n = 0; n < level.inverse.size(); ++n) {
        Eigen::Matrix3d& block = level.inverse[n];
        for (int d = 0; d < 3; ++d) {
            double& free = level.free[static_cast<Eigen::Index>(3 * n + d)];
            if (l > 0) free = block(d, d) > empty * largest ? 1 : 0;
            if (free != 0) continue;
            block.row(d).setZero();
            block.col(d).setZero();
            block(d, d) = largest;
        }
        block = block.inverse().eval();
        for (int d = 0; d < 3; ++d)
            if (level.free[static_cast<Eigen::Index>(3 * n + d)] == 0) block(d, d) = 0;
    }
}

void HexMultigrid::factor_coarsest() {
    const std::size_t l = levels_.size() - 1;
    const Level& level = levels_.back();
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t e = 0; e < level.grid.cells.size(); ++e) {
        const Matrix24f K = element_matrix(l, e);
        const Hexahedron& cell = level.grid.cells[e];
        for (int j = 0; j < 24; ++j)
            for (int i = 0; i < 24; ++i)
                if (K(i, j) != 0)
                    entries.emplace_back(3 * cell[i / 3] + i % 3, 3 * cell[j / 3] + j % 3, K(i, j));
    }
    double largest = 0;
    for (const auto& entry : entries)
        if (entry.row() == entry.col()) largest = std::max(largest, entry.value());
    // Empty rows become those of the identity; the rest is lifted by what rounding to float may
    // have taken from the lowest eigenvalue.
    constexpr double lift = 1e-6;
    Vector diagonal = Vector::Zero(level.free.size());
    for (const auto& entry : entries)
        if (entry.row() == entry.col()) diagonal[entry.row()] += entry.value();
    for (Eigen::Index i = 0; i < level.free.size(); ++i)
        entries.emplace_back(i, i, level.free[i] != 0 ? lift * diagonal[i] : largest);
    Eigen::SparseMatrix<double> A(level.free.size(), level.free.size());
    A.setFromTriplets(entries.begin(), entries.end());
    coarsest_.compute(A);
}

void HexMultigrid::apply_finest(const double* x, double* y) const {
    const Level& level = levels_.front();
    for (std::size_t e = 0; e < level.grid.cells.size(); ++e) {
        const Hexahedron& cell = level.grid.cells[e];
        const Corners values = gather(cell, x);
        Corners local = values, forces;
        if (!rotations_.empty()) local = rotations_[e].transpose() * values;
        Eigen::Map<Vector24>(forces.data()).noalias() =
            reference_stiffness(e) * Eigen::Map<const Vector24>(local.data());
        if (!rotations_.empty()) forces = (rotations_[e] * forces).eval();
        if (!dilations_.empty())
            forces += (volumetric_stiffness_[cells_.material[e]] *
                       dilations_[e].cwiseProduct(values).sum()) *
                      dilations_[e];
        forces *= s_ * cells_.shares[e];
        scatter(cell, forces, y);
    }
    for (std::size_t n = 0; n < diagonal_.size(); ++n)
        Eigen::Map<Eigen::Vector3d>(y + 3 * n) +=
            diagonal_[n] * Eigen::Map<const Eigen::Vector3d>(x + 3 * n);
}

void HexMultigrid::apply(std::size_t l, const Vector& x, Vector& y) const {
    const Level& level = levels_[l];
    y.setZero();
    if (l == 0) {
        apply_finest(x.data(), y.data());
    } else {
        for (std::size_t e = 0; e < level.grid.cells.size(); ++e) {
            const Hexahedron& cell = level.grid.cells[e];
            const Corners values = gather(cell, x.data());
            const Vector24f from = Eigen::Map<const Vector24>(values.data()).cast<float>();
            const Vector24f to = level.matrices[level.matrix[e]] * from;
            scatter(cell, Eigen::Map<const Eigen::Matrix<float, 3, 8>>(to.data()).cast<double>(),
                    y.data());
        }
    }
    y.array() *= level.free.array();
}

void HexMultigrid::multiply(std::span<const double> x, std::span<double> y) const {
    std::fill(y.begin(), y.end(), 0.0);
    apply_finest(x.data(), y.data());
    const Vector& free = levels_.front().free;
    for (std::size_t i = 0; i < y.size(); ++i) y[i] *= free[static_cast<Eigen::Index>(i)];
}

void HexMultigrid::precondition(const Level& level, const Vector& r, Vector& z) const {
    for (std::size_t n = 0; n < level.inverse.size(); ++n) {
        const auto at = static_cast<Eigen::Index>(3 * n);
        z.segment<3>(at).noalias() = level.inverse[n] * r.segment<3>(at);
    }
}

double HexMultigrid::largest_eigenvalue(std::size_t l, int steps) {
    struct Gradients {
        const HexMultigrid& multigrid;
        std::size_t l;
        Level& level;

        double residual() {
            multigrid.precondition(level, level.r, level.w);
            return level.r.dot(level.w);
        }
        void turn(double beta) { level.d = level.w + beta * level.d; }
        double curvature() {
            multigrid.apply(l, level.d, level.w);
            return level.d.dot(level.w);
        }
        void advance(double alpha) { level.r -= alpha * level.w; }
    };
    Level& level = levels_[l];
    RoughValues rough;
    for (double& v : level.r) v = rough.next();
    level.r.array() *= level.free.array();
    level.d.setZero();
    const double found = lanczos_bound(steps, Gradients{*this, l, level});
    return found > 0 ? found : 1;
}

bool HexMultigrid::take_surer_bounds() {
    constexpr int more_steps = 60;
    bool is_any_higher = false;
    for (std::size_t l = 0; l + 1 < levels_.size(); ++l) {
        const double surer = margin * largest_eigenvalue(l, more_steps);
        is_any_higher |= surer > levels_[l].largest * (1 + 1e-6);
        levels_[l].largest = std::max(levels_[l].largest, surer);
    }
    return is_any_higher;
}

// Chebyshev's iteration (Saad, Iterative Methods for Sparse Linear Systems, algorithm 12.1) for the
// residual r, which ends up to date only where another step would follow.
void HexMultigrid::smooth(std::size_t l) {
    Level& level = levels_[l];
    const double top = level.largest, bottom = smallest_smoothed * top;
    const double middle = (top + bottom) / 2, half = (top - bottom) / 2;
    double rho = half / middle;
    precondition(level, level.r, level.w);
    level.d = level.w / middle;
    const int steps = l == 0 ? smoothing_steps_ : coarse_smoothing_steps_;
    for (int k = 1; k < steps; ++k) {
        level.x += level.d;
        apply(l, level.d, level.w);
        level.r -= level.w;
        precondition(level, level.r, level.w);
        const double next = 1 / (2 * middle / half - rho);
        level.d = (next * rho) * level.d + (2 * next / half) * level.w;
        rho = next;
    }
    level.x += level.d;
}

void HexMultigrid::cycle_from(std::size_t l) {
    Level& level = levels_[l];
    if (l + 1 == levels_.size()) {
        level.x = coarsest_.solve(level.r);
        level.x.array() *= level.free.array();
        return;
    }
    Level& coarse = levels_[l + 1];
    level.x.setZero();
    smooth(l);
    apply(l, level.d, level.w);
    level.r -= level.w;
    coarse.r.setZero();
    for (std::size_t n = 0; n < level.from.size(); ++n) {
        const auto& weights = corner_values_at_places()[level.from[n] % places_in_parent];
        const Hexahedron& cell = coarse.grid.cells[level.from[n] / places_in_parent];
        for (int c = 0; c < 8; ++c)
            if (weights[c] != 0)
                coarse.r.segment<3>(3 * cell[c]) +=
                    weights[c] * level.r.segment<3>(static_cast<Eigen::Index>(3 * n));
    }
    coarse.r.array() *= coarse.free.array();
    cycle_from(l + 1);
    level.d.setZero();
    for (std::size_t n = 0; n < level.from.size(); ++n) {
        const auto& weights = corner_values_at_places()[level.from[n] % places_in_parent];
        const Hexahedron& cell = coarse.grid.cells[level.from[n] / places_in_parent];
        for (int c = 0; c < 8; ++c)
            if (weights[c] != 0)
                level.d.segment<3>(static_cast<Eigen::Index>(3 * n)) +=
                    weights[c] * coarse.x.segment<3>(3 * cell[c]);
    }
    level.d.array() *= level.free.array();
    level.x += level.d;
    apply(l, level.d, level.w);
    level.r -= level.w;
    smooth(l);
}

void HexMultigrid::cycle(std::span<const double> r, std::span<double> z) {
    Level& finest = levels_.front();
    finest.r = Eigen::Map<const Vector>(r.data(), finest.r.size());
    finest.r.array() *= finest.free.array();
    cycle_from(0);
    Eigen::Map<Vector>(z.data(), finest.x.size()) = finest.x;
}

double HexMultigrid::bytes() const {
    auto sum = static_cast<double>(dilations_.size() * sizeof(CellDilation));
    for (const Level& level : levels_)
        sum += static_cast<double>(level.matrices.size() * sizeof(Matrix24f)) +
               static_cast<double>(level.grid.cells.size() *
                                   (sizeof(Hexahedron) + sizeof(HexPlace) + 8)) +
               static_cast<double>(level.inverse.size() * (sizeof(Eigen::Matrix3d) + 5 * 24));
    return sum;
}

}  // namespace livetet
