#include "meshing/locality.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <tuple>
#include <utility>

#include "base/lists.hpp"

namespace livetet {

namespace {

constexpr int bits = 20;  // along each axis

/// Index of a cell along the Hilbert curve: Skilling's transform, then interleaving of the axes'
/// bits.
std::uint64_t hilbert_index(std::array<std::uint32_t, 3> x) {
    for (std::uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
        const std::uint32_t p = q - 1;
        for (std::uint32_t& xi : x) {
            if (xi & q) {
                x[0] ^= p;
            } else {
                const std::uint32_t t = (x[0] ^ xi) & p;
                x[0] ^= t;
                xi ^= t;
            }
        }
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    std::uint32_t t = 0;
    for (std::uint32_t q = 1u << (bits - 1); q > 1; q >>= 1)
        if (x[2] & q) t ^= q - 1;
    std::uint64_t index = 0;
    for (int b = bits - 1; b >= 0; --b)
        for (const std::uint32_t xi : x) index = (index << 1) | (((xi ^ t) >> b) & 1u);
    return index;
}

std::vector<std::int32_t> order_of_nodes(const std::vector<Vector3>& nodes) {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : nodes) box.extend(x);
    const double extent = std::max(box.sizes().maxCoeff(), 1e-300);
    std::vector<std::pair<std::uint64_t, std::int32_t>> keys(nodes.size());
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        std::array<std::uint32_t, 3> cell{};
        for (int d = 0; d < 3; ++d)
            cell[d] = static_cast<std::uint32_t>((nodes[n][d] - box.min()[d]) / extent *
                                                 ((1u << bits) - 1));
        keys[n] = {hilbert_index(cell), static_cast<std::int32_t>(n)};
    }
    const auto rank_in_cell = [&](std::int32_t n) {
        return std::tuple(nodes[n].x(), nodes[n].y(), nodes[n].z(), n);
    };
    std::sort(keys.begin(), keys.end(), [&](const auto& a, const auto& b) {
        return a.first != b.first ? a.first < b.first
                                  : rank_in_cell(a.second) < rank_in_cell(b.second);
    });
    std::vector<std::int32_t> order;
    order.reserve(keys.size());
    for (const auto& [key, n] : keys) order.push_back(n);
    return order;
}

/// The even permutation of a tet's nodes that puts its lowest node first and the second lowest
/// next.
Tet canonical(Tet t) {
    const auto low = std::min_element(t.begin(), t.end()) - t.begin();
    if (low != 0) {
        std::swap(t[0], t[low]);
        std::swap(t[1 + low % 3], t[1 + (low + 1) % 3]);
    }
    std::rotate(t.begin() + 1, std::min_element(t.begin() + 1, t.end()), t.end());
    return t;
}

}  // namespace

Renumbering sort_for_locality(TetMesh& mesh) {
    const std::vector<std::int32_t> order = order_of_nodes(mesh.nodes);
    Renumbering result{std::vector<std::int32_t>(order.size()), {}};
    std::vector<std::int32_t>& number = result.number_of_node;
    std::vector<Vector3> nodes(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        number[order[i]] = static_cast<std::int32_t>(i);
        nodes[i] = mesh.nodes[order[i]];
    }
    mesh.nodes = std::move(nodes);

    std::vector<Tet> tets = mesh.tets;
    for (Tet& t : tets) {
        for (std::int32_t& n : t) n = number[n];
        t = canonical(t);
    }
    // By the lowest node, which comes first, and then the few tets of the same one.
    Lists of_lowest = make_lists(number.size(), [&](auto&& add) {
        for (std::size_t e = 0; e < tets.size(); ++e)
            add(static_cast<std::size_t>(tets[e][0]), static_cast<std::int32_t>(e));
    });
    for (std::size_t n = 0; n < number.size(); ++n)
        std::sort(of_lowest.items.begin() + of_lowest.start[n],
                  of_lowest.items.begin() + of_lowest.start[n + 1],
                  [&](std::int32_t a, std::int32_t b) {
                      return std::pair(tets[a], a) < std::pair(tets[b], b);
                  });
    result.tets = std::move(of_lowest.items);
    const std::vector<std::int32_t> regions = mesh.regions;
    for (std::size_t i = 0; i < tets.size(); ++i) {
        mesh.tets[i] = tets[result.tets[i]];
        if (!regions.empty()) mesh.regions[i] = regions[result.tets[i]];
    }
    for (auto& [name, set] : mesh.node_sets) {
        for (std::int32_t& n : set) n = number[n];
        std::sort(set.begin(), set.end());
    }
    for (auto& [name, set] : mesh.triangle_sets)
        for (Triangle& t : set)
            for (std::int32_t& n : t) n = number[n];
    return result;
}

}  // namespace livetet
