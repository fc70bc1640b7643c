#include "meshing/partition.hpp"

#include <metis.h>

#include <algorithm>
#include <stdexcept>

#include "base/error.hpp"

namespace livetet {

namespace {

const char* metis_text(int code) {
    switch (code) {
        case METIS_ERROR_INPUT:
            return "erroneous input";
        case METIS_ERROR_MEMORY:
            return "not enough memory";
        default:
            return "no further word";
    }
}

}  // namespace

std::vector<std::int32_t> partition_tets(std::span<const Tet> tets, int parts) {
    if (parts < 1) fail("partition: {} parts, expected at least 1", parts);
    if (tets.size() < static_cast<std::size_t>(parts))
        fail("partition: {} parts of {} tets, expected no more parts than tets", parts, tets.size());
    std::vector<std::int32_t> part(tets.size(), 0);
    if (parts == 1) return part;

    std::vector<idx_t> first, corners;
    idx_t node_count = 0;
    for (const Tet& t : tets) {
        first.push_back(static_cast<idx_t>(corners.size()));
        for (const std::int32_t n : t) {
            if (n < 0) fail("partition: a tet names node {}, expected >= 0", n);
            corners.push_back(n);
            node_count = std::max(node_count, static_cast<idx_t>(n) + 1);
        }
    }
    first.push_back(static_cast<idx_t>(corners.size()));

    idx_t tet_count = static_cast<idx_t>(tets.size()), shared_nodes = 3, part_count = parts, cut = 0;
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 1;
    options[METIS_OPTION_NUMBERING] = 0;
    std::vector<idx_t> tet_part(tets.size()), node_part(node_count);
    const int code =
        METIS_PartMeshDual(&tet_count, &node_count, first.data(), corners.data(), nullptr, nullptr, &shared_nodes,
                           &part_count, nullptr, options, &cut, tet_part.data(), node_part.data());
    if (code != METIS_OK)
        throw std::runtime_error(fmt::format("METIS_PartMeshDual failed with code {} ({}) on {} tets, {} parts", code,
                                             metis_text(code), tets.size(), parts));
    std::copy(tet_part.begin(), tet_part.end(), part.begin());
    return part;
}

}  // namespace livetet
