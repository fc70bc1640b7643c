#pragma once

#include <Eigen/Core>

#include <vector>

#include "base/petsc.hpp"
#include "mechanics/batch_kernels.hpp"

namespace livetet {

/// The rotation of every quadrature point of a level, in the one layout that the level's kernels
/// read (LevelAssembler::make_rotations makes it); empty where the model does not rotate.
struct ElementRotations {
    std::vector<Eigen::Matrix3d> points;         ///< of tet e, point q: e * points + q
    std::vector<RotationBatch<double>> batches;  ///< of batches
    std::vector<RotationBatch<float>> single;    ///< without a matrix; of points, or tets
    std::vector<float>
        single_u;  ///< with `single`: u that they were taken at, m, one number behind

    /// Heap memory, bytes.
    double bytes() const {
        const auto of = [](const auto& list) {
            return static_cast<double>(list.capacity() * sizeof(list[0]));
        };
        return of(points) + of(batches) + of(single) + of(single_u);
    }
};

/// State at which elements are evaluated: displacement u; pressure p, null in the displacement
/// form, and where cells eliminate theirs null, or one number a cell to take in their place;
/// rotations taken at u (null: identity). Ghosts are up to date. Owns nothing.
struct Configuration {
    Vec u = nullptr;
    Vec p = nullptr;
    const ElementRotations* rotations = nullptr;
};

}  // namespace livetet
