#include "mesh/node_copies.hpp"

#include <algorithm>

#include "base/sort_and_unique.hpp"

namespace livetet {

std::int32_t NodeCopies::number(std::int32_t node, std::int32_t k) {
    std::int32_t& n = number_[k];
    if (n >= 0) return n;
    if (!is_taken_[node]) {
        is_taken_[node] = 1;
        return n = node;
    }
    originals_.push_back(node);
    return n = next_++;
}

void append_copies(TetMesh& mesh, std::span<const std::int32_t> originals) {
    const std::size_t first = mesh.nodes.size();
    for (auto& [name, nodes] : mesh.node_sets) {
        std::vector<std::uint8_t> is_in(first, 0);
        for (const std::int32_t n : nodes) is_in[n] = 1;
        for (std::size_t k = 0; k < originals.size(); ++k)
            if (is_in[originals[k]]) nodes.push_back(static_cast<std::int32_t>(first + k));
        sort_and_unique(nodes);
    }
    mesh.nodes.reserve(first + originals.size());
    for (const std::int32_t n : originals) mesh.nodes.push_back(Vector3(mesh.nodes[n]));
}

std::map<std::string, std::vector<Triangle>> moved_sets(const TetMesh& before,
                                                        const std::vector<Tet>& after) {
    std::map<std::string, std::vector<Triangle>> sets = before.triangle_sets;
    if (sets.empty()) return sets;
    const auto sorted = [](Triangle t) {
        std::sort(t.begin(), t.end());
        return t;
    };
    std::map<Triangle, std::vector<Triangle*>> wanted;
    std::vector<std::uint8_t> is_at_one(before.nodes.size(), 0);
    for (auto& [name, triangles] : sets)
        for (Triangle& t : triangles) {
            wanted[sorted(t)].push_back(&t);
            for (const std::int32_t n : t) is_at_one[n] = 1;
        }
    for (std::size_t e = 0; e < before.tets.size() && !wanted.empty(); ++e)
        for (int opposite = 0; opposite < 4; ++opposite) {
            Triangle face{};
            for (int i = 0, k = 0; i < 4; ++i)
                if (i != opposite) face[k++] = before.tets[e][i];
            if (std::ranges::any_of(face, [&](std::int32_t n) { return is_at_one[n] == 0; }))
                continue;
            const auto found = wanted.find(sorted(face));
            if (found == wanted.end()) continue;
            for (Triangle* t : found->second)
                for (std::int32_t& n : *t)
                    n = after[e][std::find(before.tets[e].begin(), before.tets[e].end(), n) -
                                 before.tets[e].begin()];
            wanted.erase(found);
        }
    return sets;
}

}  // namespace livetet
