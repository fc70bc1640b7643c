#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

#include "base/error.hpp"

namespace livetet {

/// Hard constraints of nodes: which components are prescribed, and to which displacement (metres).
/// One entry for each node of the mesh, in the mesh's numbering.
struct Constraints {
    std::vector<std::uint8_t> components;  ///< bit 0: x, bit 1: y, bit 2: z
    std::vector<Eigen::Vector3d> values;

    explicit Constraints(std::size_t nodes)
        : components(nodes, 0), values(nodes, Eigen::Vector3d::Zero()) {}

    /// Prescribes the components `which` of these nodes. Throws Error if there is no such node; the
    /// nodes before it are prescribed then.
    void prescribe(std::span<const std::int32_t> nodes, const Eigen::Vector3d& value,
                   std::uint8_t which = 7) {
        for (const std::int32_t n : nodes) {
            if (n < 0 || n >= std::ssize(components))
                fail("constraints: found node {}, expected 0 to {}", n, std::ssize(components) - 1);
            components[n] |= which;
            for (int c = 0; c < 3; ++c)
                if (which & (1 << c)) values[n][c] = value[c];
        }
    }
};

/// Soft constraints: a spring at each node that pulls it to a displacement. One entry for each node
/// of the mesh, or empty: none.
struct Springs {
    std::vector<double> stiffness;  ///< N/m, 0: no spring
    std::vector<Eigen::Vector3d> target;

    bool empty() const { return stiffness.empty(); }
};

}  // namespace livetet
