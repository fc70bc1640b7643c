#include "solvers/assembly/pressure_space.hpp"

#include <algorithm>
#include <numeric>
#include <ranges>

namespace livetet {

PressureSpace make_pressure_space(const PartitionedMesh& share) {
    PressureSpace space{.comm = share.comm, .owned = 0, .numbers = {}, .tets = {}};
    if (!share.hexahedra.empty()) {
        for (; space.owned < static_cast<std::int32_t>(share.hexahedra.size()); ++space.owned) {
            space.numbers.push_back(space.owned);
            space.tets.push_back({space.owned, space.owned, space.owned, space.owned});
        }
        return space;
    }
    if (!share.quadratic_hexahedra.empty()) {
        for (std::size_t e = 0; e < share.quadratic_hexahedra.size(); ++e) {
            std::ranges::iota_view four(space.owned, space.owned + 4);
            space.numbers.insert(space.numbers.end(), four.begin(), four.end());
            space.tets.push_back({four[0], four[1], four[2], four[3]});
            space.owned += 4;
        }
        return space;
    }
    // Corners have the lowest numbers in the whole mesh: the owned ones are the first local nodes
    // of the share.
    while (space.owned < share.owned && share.nodes[space.owned] < share.corners) ++space.owned;
    PetscInt here = space.owned, end = 0;
    MPI_Scan(&here, &end, 1, MPIU_INT, MPI_SUM, share.comm);
    std::vector<PetscInt> number(share.owned, -1);  // of the pressure at each local node
    std::iota(number.begin(), number.begin() + space.owned, end - here);
    number = with_ghosts<PetscInt>(share, number);

    std::vector<std::int32_t> ghosts;
    for (std::size_t i = share.owned; i < share.nodes.size(); ++i)
        if (share.nodes[i] < share.corners) ghosts.push_back(static_cast<std::int32_t>(i));
    std::sort(ghosts.begin(), ghosts.end(),
              [&](std::int32_t a, std::int32_t b) { return number[a] < number[b]; });
    std::vector<std::int32_t> pressure_of(share.nodes.size(), -1);
    for (std::int32_t i = 0; i < space.owned; ++i) pressure_of[i] = i;
    for (std::size_t k = 0; k < ghosts.size(); ++k)
        pressure_of[ghosts[k]] = space.owned + static_cast<std::int32_t>(k);
    space.numbers.resize(space.owned + ghosts.size());
    for (std::size_t i = 0; i < share.nodes.size(); ++i)
        if (pressure_of[i] >= 0) space.numbers[pressure_of[i]] = number[i];
    for (const Tet& t : share.tets)
        space.tets.push_back(
            {pressure_of[t[0]], pressure_of[t[1]], pressure_of[t[2]], pressure_of[t[3]]});
    return space;
}

PetscHandle<Vec> make_vector(const PressureSpace& space) {
    PetscHandle<Vec> v;
    LIVETET_PETSC(VecCreateGhost(space.comm, space.owned, PETSC_DETERMINE,
                                 static_cast<PetscInt>(space.numbers.size() - space.owned),
                                 space.numbers.data() + space.owned, v.out()));
    return v;
}

}  // namespace livetet
