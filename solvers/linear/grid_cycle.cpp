#include "solvers/linear/grid_cycle.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/sliced_task.hpp"
#include "mesh/hex_transfer.hpp"

namespace livetet {

namespace {

/// Minimum number of nodes for which a further thread is woken.
constexpr std::size_t grain = 150;

/// The interpolation from a grid to the next finer one. A node there is in the middle of one, two,
/// four or eight nodes of this grid: of a corner, an edge, a face or a cell. Nodes are taken by
/// blocks, and in a block by that number, so that loops have constant lengths.
class MeansOfCorners {
  public:
    MeansOfCorners() = default;
    MeansOfCorners(const HexLevel& finer, std::span<const Hexahedron> cells) {
        const std::vector<std::int32_t> from = places_in_coarser(finer);
        for (std::size_t first = 0; first < from.size(); first += block_length) {
            Block block;
            for (int k = 0; k < 4; ++k) {
                block.nodes[k] = nodes_.size();
                block.corners[k] = corners_.size();
                for (std::size_t i = first; i < std::min(from.size(), first + block_length); ++i)
                    add(i, from[i], cells, 1 << k);
            }
            block.nodes[4] = nodes_.size();
            blocks_.push_back(block);
        }
    }

    std::size_t blocks() const { return blocks_.size(); }
    /// visit(i, mean of x) for the finer grid's nodes of some blocks.
    template <class Visit>
    void visit(std::size_t begin, std::size_t end, const float* x, const Visit& visit) const {
        for (const Block& block : std::span(blocks_).subspan(begin, end - begin)) {
            visit_run<1>(block, 0, x, visit);
            visit_run<2>(block, 1, x, visit);
            visit_run<4>(block, 2, x, visit);
            visit_run<8>(block, 3, x, visit);
        }
    }
    /// visit(i, c, weight): node c is one of those whose weighted mean is at the finer node i.
    template <class Visit>
    void visit_weights(const Visit& visit) const {
        for (const Block& block : blocks_)
            for (int k = 0; k < 4; ++k) {
                std::size_t c = block.corners[k];
                for (std::size_t n = block.nodes[k]; n < block.nodes[k + 1]; ++n)
                    for (int corner = 0; corner < 1 << k; ++corner)
                        visit(nodes_[n], corners_[c++], 1.0F / static_cast<float>(1 << k));
            }
    }

  private:
    static constexpr std::size_t block_length = 256;
    struct Block {
        std::array<std::size_t, 5> nodes;    ///< where those of 1, 2, 4, 8 corners begin, and end
        std::array<std::size_t, 4> corners;  ///< and their corners
    };

    void add(std::size_t node, std::int32_t from, std::span<const Hexahedron> cells, int count) {
        const auto& values = corner_values_at_places()[from % places_in_parent];
        if (std::ranges::count_if(values, [](double v) { return v != 0; }) != count) return;
        nodes_.push_back(static_cast<std::int32_t>(node));
        for (int c = 0; c < 8; ++c)
            if (values[c] != 0) corners_.push_back(cells[from / places_in_parent][c]);
    }
    template <int count, class Visit>
    void visit_run(const Block& block, int k, const float* x, const Visit& visit) const {
        const std::int32_t* corner = corners_.data() + block.corners[k];
        for (std::size_t n = block.nodes[k]; n < block.nodes[k + 1]; ++n, corner += count) {
            FourFloats sum = load_node(x + std::ptrdiff_t{3} * corner[0]);
            for (int c = 1; c < count; ++c) sum += load_node(x + std::ptrdiff_t{3} * corner[c]);
            visit(static_cast<std::size_t>(nodes_[n]), 1.0F / count * sum);
        }
    }

    std::vector<std::int32_t> nodes_, corners_;
    std::vector<Block> blocks_;
};

/// Change of s or m beyond which the coarsest factor is made anew.
bool has_changed(double now, double before) { return std::abs(now - before) > 0.05 * before; }

}  // namespace

struct GridCycle::Level {
    LevelAssembler& level;
    MatrixFreeOperator A;
    MatrixFreeSmoother smoother;
    ElementRotations rotations;
    std::vector<float> r;
    // Of a coarse level:
    MeansOfCorners interpolation;  ///< to the next finer one
    std::unique_ptr<TransposedMap> restriction;

    Level(LevelAssembler& l, int smoothing_steps, ThreadTeam& team)
        : level(l),
          A(l, team),
          smoother(A, smoothing_steps),
          rotations(l.make_rotations_of_cells()),
          r(A.components() + 1, 0.0F) {}

    std::size_t nodes() const { return A.components() / 3; }

    void connect(const HexLevel& finer, const HexLevel& own) {
        interpolation = MeansOfCorners(finer, own.cells);
        restriction = std::make_unique<TransposedMap>(
            nodes(), [&](const auto& visit) { interpolation.visit_weights(visit); });
    }
};

namespace {

/// Of each node those of its cells, with itself, rising.
Lists neighbours_of(std::span<const Hexahedron> cells, std::size_t nodes) {
    Lists lists = make_lists(nodes, [&](auto&& add) {
        for (const Hexahedron& cell : cells)
            for (const std::int32_t n : cell)
                for (const std::int32_t other : cell) add(n, other);
    });
    sort_and_unique(lists);
    return lists;
}

/// Groups of nodes of which no two have a neighbour in common: some 27, as in a grid without cuts.
std::vector<std::vector<std::int32_t>> apart(const Lists& neighbours) {
    const std::size_t nodes = neighbours.start.size() - 1;
    std::vector<std::vector<std::int32_t>> groups;
    std::vector<std::size_t> group_of(nodes, nodes);
    std::vector<std::size_t> taken_by(nodes + 1, nodes);  // of each group: the last node near it
    for (std::size_t n = 0; n < nodes; ++n) {
        for (const std::int32_t between : neighbours[n])
            for (const std::int32_t other : neighbours[between]) taken_by[group_of[other]] = n;
        std::size_t group = 0;
        while (group < groups.size() && taken_by[group] == n) ++group;
        if (group == groups.size()) groups.emplace_back();
        groups[group].push_back(static_cast<std::int32_t>(n));
        group_of[n] = group;
    }
    return groups;
}

}  // namespace

GridCycle::GridCycle(std::vector<LevelAssembler*> levels, std::span<const HexLevel> grids,
                     int smoothing_steps, ThreadTeam& team)
    : team_(team), smoothing_steps_(smoothing_steps) {
    for (std::size_t l = 0; l < levels.size(); ++l) {
        levels_.push_back(std::make_unique<Level>(*levels[l], smoothing_steps, team));
        if (l > 0) levels_[l]->connect(grids[l - 1], grids[l]);
        pause_point();
    }
    const LevelAssembler& coarsest = levels_.back()->level;
    coarsest_neighbours_ = neighbours_of(coarsest.share().hexahedra, levels_.back()->nodes());
    coarsest_groups_ = apart(coarsest_neighbours_);
}

GridCycle::~GridCycle() = default;

void GridCycle::set_constrained() {
    for (auto& level : levels_) level->A.set_constrained();
    is_new_ = true;
}

const ElementRotations& GridCycle::find_rotations(const ElementRotations& finest) {
    Level& first = *levels_.front();
    if (finest.single_u.empty() || !first.level.rotates()) return first.rotations;
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        const float* fine =
            l == 1 ? finest.single_u.data() : levels_[l - 1]->rotations.single_u.data();
        Level& coarse = *levels_[l];
        float* u = coarse.rotations.single_u.data();
        team_.run_pieces(coarse.nodes(), grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t n = begin; n < end; ++n)
                store_node(coarse.restriction->mean(n, fine), u + 3 * n);
        });
    }
    for (std::size_t l = 1; l < levels_.size(); ++l)
        levels_[l]->level.update_single_rotations(levels_[l]->rotations);
    if (finest.single.size() == first.rotations.single.size()) return finest;  // one a cell
    std::copy(finest.single_u.begin(), finest.single_u.end(), first.rotations.single_u.begin());
    first.level.update_single_rotations(first.rotations);
    return first.rotations;
}

RenewalExtent GridCycle::update(const ElementRotations& at, double s, double m, RenewalExtent) {
    const ElementRotations& of_cells = find_rotations(at);
    for (auto& level : levels_) {
        level->A.update(level == levels_.front() ? of_cells : level->rotations, s, m);
        if (level != levels_.back()) level->smoother.find_bound();
    }
    if (is_new_ || has_changed(s, s_) || has_changed(m, m_)) {
        factor_coarsest();
        is_new_ = false;
        s_ = s;
        m_ = m;
    }
    return RenewalExtent::whole;
}

/// Columns of nodes that are apart come from one product: each of its rows comes from at most one.
void GridCycle::factor_coarsest() {
    Level& level = *levels_.back();
    const auto n = static_cast<Eigen::Index>(level.A.components());
    Eigen::MatrixXf matrix = Eigen::MatrixXf::Zero(n, n);
    std::vector<float>&x = level.smoother.x(), &product = level.r;
    std::fill(x.begin(), x.end(), 0.0F);
    const auto free = level.A.free();
    for (const std::vector<std::int32_t>& group : coarsest_groups_)
        for (int axis = 0; axis < 3; ++axis) {
            for (const std::int32_t node : group) x[3 * node + axis] = free[3 * node + axis];
            level.A.visit_positive(x, [&](std::size_t i, float Ax) { product[i] = free[i] * Ax; });
            for (const std::int32_t node : group) {
                for (const std::int32_t row : coarsest_neighbours_[node])
                    for (int c = 0; c < 3; ++c)
                        matrix(3 * row + c, 3 * node + axis) = product[3 * row + c];
                x[3 * node + axis] = 0;
            }
        }
    const float largest = std::max(matrix.diagonal().maxCoeff(), 1e-30F);
    for (Eigen::Index i = 0; i < n; ++i)
        if (!(matrix(i, i) > 0)) matrix(i, i) = largest;
    matrix.diagonal() *= 1 + 1e-6F;  // what rounding may have taken from the lowest eigenvalue
    factor_.compute(matrix);
}

void GridCycle::restrict_residual(std::size_t l, const std::vector<float>& r) {
    Level& coarse = *levels_[l + 1];
    const auto free = coarse.A.free();
    float* b = coarse.smoother.b().data();
    team_.run_pieces(coarse.nodes(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const FourFloats sum = coarse.restriction->gather(n, r.data());
            for (int c = 0; c < 3; ++c) b[3 * n + c] = free[3 * n + c] * sum[c];
        }
    });
}

void GridCycle::add_correction(std::size_t l, To to) {
    Level &level = *levels_[l], &coarse = *levels_[l + 1];
    const auto free = level.A.free();
    float* x = level.smoother.x().data();
    const float* from = coarse.smoother.x().data();
    team_.run_pieces(coarse.interpolation.blocks(), 1, [&](std::size_t begin, std::size_t end) {
        coarse.interpolation.visit(begin, end, from, [&](std::size_t i, FourFloats value) {
            for (int c = 0; c < 3; ++c)
                x[3 * i + c] = (to == To::zero ? 0 : x[3 * i + c]) + free[3 * i + c] * value[c];
        });
    });
}

void GridCycle::descend(std::size_t l, bool smooths_before) {
    Level& level = *levels_[l];
    if (l + 1 == levels_.size()) {
        const Eigen::Index n = factor_.rows();
        Eigen::Map<Eigen::VectorXf> x(level.smoother.x().data(), n);
        x = Eigen::Map<const Eigen::VectorXf>(level.smoother.b().data(), n);
        factor_.solveInPlace(x);
        x.array() *= Eigen::Map<const Eigen::ArrayXf>(level.A.free().data(), n);
        return;
    }
    if (smooths_before) {
        level.smoother.smooth(true);
        level.smoother.residual(level.r);
    }
    restrict_residual(l, smooths_before ? level.r : level.smoother.b());
    descend(l + 1, true);
    add_correction(l, smooths_before ? To::x : To::zero);
    level.smoother.smooth(false);
}

template <class Scalar>
void GridCycle::apply(std::span<const Scalar> r, std::span<Scalar> z) {
    Level& finest = *levels_.front();
    std::vector<float>&b = finest.smoother.b(), &x = finest.smoother.x();
    finest.A.over_components([&](std::size_t i) { b[i] = static_cast<float>(r[i]); });
    descend(0, std::exchange(smooths_before_, true));
    finest.A.over_components([&](std::size_t i) { z[i] = x[i]; });
}

template void GridCycle::apply(std::span<const double>, std::span<double>);
template void GridCycle::apply(std::span<const float>, std::span<float>);

double GridCycle::bytes_of_update() const {
    double bytes = 0;
    for (const auto& level : levels_) {  // displacements are written and read, rotations written
        if (!level->level.rotates()) continue;
        const auto& single = level->rotations.single;
        const auto& u = level->rotations.single_u;
        bytes +=
            static_cast<double>(single.size() * sizeof(single[0]) + 2 * u.size() * sizeof(u[0]));
    }
    return bytes;
}

double GridCycle::bytes_of_cycle() const {
    double bytes = 0;
    for (const auto& level : levels_)
        if (level != levels_.back()) bytes += 2 * smoothing_steps_ * level->A.bytes_of_multiply();
    return bytes + 4.0 * static_cast<double>(factor_.rows() * factor_.cols());
}

}  // namespace livetet
