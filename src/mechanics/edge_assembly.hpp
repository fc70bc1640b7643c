#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mechanics/batch_kernels.hpp"

namespace livetet {

/// h_i = R g_i, 1/m, of the four corners of a tet; the fourth numbers of the first two corners are its volume times
/// lambda and times mu, N m (of the others: none). A cache line.
struct alignas(64) RotatedTet {
    float corner[4][4];
};

/// The tet of every lane of `range`, its stiffness times `scale`, to tets[batch * batch_width + lane].
void rotate_gradients(const TetBatches<float>& batches, BatchRange range, std::span<const RotationBatch<float>> rotations,
                      float scale, std::span<RotatedTet> tets);

/// The blocks of sum R K R^T (as `assemble`) made block by block rather than tet by tet: each is summed in registers
/// over the tets around its edge and written once, with its transpose. Nothing has to be zeroed, and rows can be given to
/// threads. 3x3 blocks of nine floats, column-major, in rows of ascending columns.
class EdgeAssembly {
  public:
    /// `start`, `columns`: the rows of blocks, between all nodes that share a tet; `parts`: where the tets' lanes are.
    EdgeAssembly(std::span<const std::array<std::int32_t, 4>> tets, const BatchParts& parts,
                 std::span<const std::int32_t> start, std::span<const std::int32_t> columns);

    /// Writes the blocks right of the diagonal of rows [begin, end), and below the diagonal their transposes, which are
    /// other rows': wait for all before reading.
    void write_off_diagonal(std::size_t begin, std::size_t end, std::span<const RotatedTet> tets,
                            std::span<float> values) const;
    /// Writes the diagonal blocks of rows [begin, end): minus the others' sum, since a translation makes no force.
    void write_diagonal(std::size_t begin, std::size_t end, std::span<float> values) const;

    std::size_t bytes() const { return 4 * (first_.size() + mirror_.size() + edge_start_.size() + shares_.size()); }

  private:
    std::span<const std::int32_t> start_;
    std::vector<std::int32_t> diagonal_;    ///< of each row
    std::vector<std::int32_t> first_;       ///< edge of each row
    std::vector<std::int32_t> mirror_;      ///< of each edge: its block below the diagonal
    std::vector<std::int32_t> edge_start_;  ///< of each edge, in shares_
    std::vector<std::uint32_t> shares_;     ///< lane 16 + corner i 4 + corner j
};

}  // namespace livetet
