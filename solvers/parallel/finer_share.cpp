#include "solvers/parallel/finer_share.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/error.hpp"
#include "mesh/refine.hpp"
#include "solvers/parallel/shared_edges.hpp"

namespace livetet {

namespace {

/// What becomes of a share's nodes and edges. Candidates for fine nodes are its local nodes and,
/// behind them, the midpoints of its local edges.
class Division {
  public:
    enum class Form { refined, quadratic };
    using Middles = std::array<std::int32_t, 6>;

    Division(const PartitionedMesh& coarse, const LocalSets& sets, Form form);
    FinerShare take();

  private:
    struct Numbers {
        std::int64_t whole, petsc;
    };
    std::int32_t middle(std::int32_t a, std::int32_t b) const {
        return nodes_ + edges_.between(a, b);
    }
    std::array<std::int32_t, 3> middles(const Triangle& t) const {
        return {middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    }
    bool is_owned(std::int32_t c) const {
        return numbers_[c].petsc >= first_ && numbers_[c].petsc < first_ + fine_.share.owned;
    }
    template <class Corners>
    bool touches_owned(const Corners& corners) const {
        return std::ranges::any_of(corners, [&](std::int32_t c) { return is_owned(c); });
    }
    Numbers of_node(std::int32_t n) const;
    Numbers of_edge(std::int32_t n, std::int32_t edge) const;
    void number_candidates();
    void add_tets();
    void add_tet(const Tet& corners, const Middles* middles, std::size_t parent, int child);
    void add_nodes();
    void make_local();
    void place_in_coarse();
    void add_sets();

    const PartitionedMesh& coarse_;
    const LocalSets& sets_;
    Form form_;
    SharedEdges edges_;
    std::int32_t nodes_;  ///< local ones of the coarse share
    std::vector<Numbers> numbers_;
    std::vector<Vector3> places_;
    std::int64_t first_ = 0;  ///< PETSc's number of the first own fine node
    std::vector<std::int32_t> local_of_;
    FinerShare fine_;
};

Division::Division(const PartitionedMesh& coarse, const LocalSets& sets, Form form)
    : coarse_(coarse),
      sets_(sets),
      form_(form),
      edges_(coarse),
      nodes_(static_cast<std::int32_t>(coarse.nodes.size())) {
    PartitionedMesh& share = fine_.share;
    share.comm = coarse.comm;
    share.ranks = coarse.ranks;
    const std::int64_t total = static_cast<std::int64_t>(coarse.total) + edges_.total();
    if (total > std::numeric_limits<std::int32_t>::max())
        fail("refine: {} nodes, expected at most {}", total,
             std::numeric_limits<std::int32_t>::max());
    share.total = static_cast<std::size_t>(total);
    share.corners = form == Form::quadratic ? coarse.corners : static_cast<std::int32_t>(total);
    share.owned = coarse.owned + edges_.owned();
}

/// In a refined mesh a node follows all lower nodes and their edges. In a ten-node mesh all nodes
/// come before all midpoints. PETSc's numbers do the same within each rank.
Division::Numbers Division::of_node(std::int32_t n) const {
    const SharedEdges::Node& node = edges_.node(n);
    if (form_ == Form::refined)
        return {coarse_.nodes[n] + node.edges_below, coarse_.numbers[n] + node.first_row};
    return {coarse_.nodes[n], coarse_.numbers[n] + node.rank_first_edge};
}

Division::Numbers Division::of_edge(std::int32_t n, std::int32_t edge) const {
    const std::int64_t place = edges_.place(edge);
    if (form_ == Form::refined) {
        const Numbers lower = of_node(n);
        return {lower.whole + 1 + place, lower.petsc + 1 + place};
    }
    const SharedEdges::Node& node = edges_.node(n);
    return {static_cast<std::int64_t>(coarse_.total) + node.edges_below + place,
            node.rank_nodes_end + node.first_row + place};
}

void Division::number_candidates() {
    const Lists& edges = edges_.by_lower_end();
    numbers_.reserve(static_cast<std::size_t>(nodes_) + edges.items.size());
    places_ = coarse_.rest;
    for (std::int32_t n = 0; n < nodes_; ++n) numbers_.push_back(of_node(n));
    for (std::int32_t n = 0; n < nodes_; ++n)
        for (std::int32_t k = edges.start[n]; k < edges.start[n + 1]; ++k) {
            numbers_.push_back(of_edge(n, k));
            places_.push_back((coarse_.rest[n] + coarse_.rest[edges.items[k]]) / 2);
        }
    std::int64_t end = 0;
    const std::int64_t owned = fine_.share.owned;
    MPI_Scan(&owned, &end, 1, MPI_INT64_T, MPI_SUM, coarse_.comm);
    first_ = end - owned;
}

void Division::add_tet(const Tet& corners, const Middles* middles, std::size_t parent, int child) {
    PartitionedMesh& share = fine_.share;
    share.tets.push_back(corners);
    if (middles) share.edge_nodes.push_back(*middles);
    const std::int32_t id = coarse_.tet_ids[parent];
    share.tet_ids.push_back(form_ == Form::refined ? 8 * id + child : id);
    if (!coarse_.regions.empty()) share.regions.push_back(coarse_.regions[parent]);
}

/// Tets that touch an own fine node, in candidates.
void Division::add_tets() {
    for (std::size_t e = 0; e < coarse_.tets.size(); ++e) {
        const Tet& t = coarse_.tets[e];
        Middles m{};
        for (int k = 0; k < 6; ++k) m[k] = middle(t[tet_edges[k][0]], t[tet_edges[k][1]]);
        if (form_ == Form::quadratic) {
            add_tet(t, &m, e, 0);  // an own midpoint has an own end
            continue;
        }
        const std::array<Tet, 8> children = children_of(t, m, places_);
        for (int c = 0; c < 8; ++c)
            if (touches_owned(children[c])) add_tet(children[c], nullptr, e, c);
    }
}

/// The own nodes, and ghosts behind them.
void Division::add_nodes() {
    PartitionedMesh& share = fine_.share;
    local_of_.assign(numbers_.size(), -1);
    std::vector<std::int32_t> chosen(share.owned), ghosts;
    for (std::size_t c = 0; c < numbers_.size(); ++c)
        if (is_owned(static_cast<std::int32_t>(c))) {
            local_of_[c] = static_cast<std::int32_t>(numbers_[c].petsc - first_);
            chosen[local_of_[c]] = static_cast<std::int32_t>(c);
        }
    const auto mark = [&](std::int32_t c) {
        if (local_of_[c] >= 0) return;
        local_of_[c] = share.owned;  // its place is given below
        ghosts.push_back(c);
    };
    for (const Tet& t : share.tets) std::ranges::for_each(t, mark);
    for (const Middles& m : share.edge_nodes) std::ranges::for_each(m, mark);
    std::ranges::sort(ghosts, {}, [&](std::int32_t c) { return numbers_[c].petsc; });
    for (const std::int32_t c : ghosts) {
        local_of_[c] = static_cast<std::int32_t>(chosen.size());
        chosen.push_back(c);
    }
    for (const std::int32_t c : chosen) {
        share.nodes.push_back(static_cast<std::int32_t>(numbers_[c].whole));
        share.numbers.push_back(static_cast<PetscInt>(numbers_[c].petsc));
        share.rest.push_back(places_[c]);
    }
}

/// From candidates to local nodes.
void Division::make_local() {
    const auto local = [&](std::int32_t& c) { c = local_of_[c]; };
    for (Tet& t : fine_.share.tets) std::ranges::for_each(t, local);
    for (Middles& m : fine_.share.edge_nodes) std::ranges::for_each(m, local);
}

void Division::place_in_coarse() {
    const auto owned = static_cast<std::size_t>(fine_.share.owned);
    BarycentricMap& map = fine_.in_coarse;
    map.nodes.resize(owned);
    map.weights.resize(owned);
    const Lists& edges = edges_.by_lower_end();
    for (std::int32_t n = 0; n < coarse_.owned; ++n) {
        map.nodes[local_of_[n]] = {n, n, n, n};
        map.weights[local_of_[n]] = {1, 0, 0, 0};
        for (std::int32_t k = edges.start[n]; k < edges.start[n + 1]; ++k) {
            const std::int32_t upper = edges.items[k], row = local_of_[nodes_ + k];
            map.nodes[row] = {n, upper, n, n};
            map.weights[row] = {0.5, 0.5, 0, 0};
        }
    }
}

void Division::add_sets() {
    const Lists& edges = edges_.by_lower_end();
    for (const auto& [name, nodes] : sets_.nodes) {
        std::vector<std::uint8_t> is_in(numbers_.size(), 0);
        for (const std::int32_t n : nodes) is_in[n] = 1;
        if (const auto found = sets_.triangles.find(name); found != sets_.triangles.end()) {
            for (const Triangle& t : found->second)
                for (const std::int32_t c : middles(t)) is_in[c] = 1;
        } else {
            for (const std::int32_t n : nodes)
                for (std::int32_t k = edges.start[n]; k < edges.start[n + 1]; ++k)
                    is_in[nodes_ + k] = is_in[edges.items[k]];
        }
        // A ghost's surroundings are known to its owner alone.
        std::vector<std::uint8_t> own(fine_.share.owned, 0);
        for (std::size_t c = 0; c < is_in.size(); ++c)
            if (is_in[c] && is_owned(static_cast<std::int32_t>(c))) own[local_of_[c]] = 1;
        const auto local = with_ghosts<std::uint8_t>(fine_.share, own);
        std::vector<std::int32_t>& set = fine_.sets.nodes[name];
        for (std::size_t i = 0; i < local.size(); ++i)
            if (local[i]) set.push_back(static_cast<std::int32_t>(i));
    }
    for (const auto& [name, triangles] : sets_.triangles) {
        std::vector<Triangle>& set = fine_.sets.triangles[name];
        const auto add = [&](const Triangle& t) {
            if (touches_owned(t))
                set.push_back({local_of_[t[0]], local_of_[t[1]], local_of_[t[2]]});
        };
        for (const Triangle& t : triangles)
            if (form_ == Form::quadratic)
                add(t);
            else
                std::ranges::for_each(children_of(t, middles(t)), add);
    }
}

FinerShare Division::take() {
    number_candidates();
    add_tets();
    add_nodes();
    make_local();
    place_in_coarse();
    add_sets();
    return std::move(fine_);
}

}  // namespace

FinerShare refined_share(const PartitionedMesh& coarse, const LocalSets& sets) {
    return Division(coarse, sets, Division::Form::refined).take();
}

FinerShare quadratic_share(const PartitionedMesh& linear, const LocalSets& sets) {
    return Division(linear, sets, Division::Form::quadratic).take();
}

}  // namespace livetet
