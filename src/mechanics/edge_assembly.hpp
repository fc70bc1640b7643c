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
/// over the tets around its edge and written once. Nothing has to be zeroed, and rows can be given to threads. 3x3 blocks
/// of nine floats, column-major, in rows of ascending columns.
class EdgeAssembly {
  public:
    /// `start`, `columns`: the rows of blocks, between all nodes that share a tet; `parts`: where the tets' lanes are.
    EdgeAssembly(std::span<const std::array<std::int32_t, 4>> tets, const BatchParts& parts,
                 std::span<const std::int32_t> start, std::span<const std::int32_t> columns);

    /// Rows are worked on so many at a time.
    static constexpr std::size_t chunk_rows = 64;
    std::size_t chunks() const { return first_group_.size() - 1; }

    /// Writes the blocks right of the diagonal of chunks [begin, end).
    void write_upper(std::size_t begin, std::size_t end, std::span<const RotatedTet> tets, std::span<float> values) const;
    /// When all upper blocks stand: writes those below the diagonal of rows [begin, end), the upper ones' transposes,
    /// and the diagonal's, minus the sum of the others since a translation makes no force.
    void write_rest(std::size_t begin, std::size_t end, std::span<float> values) const;

    std::size_t bytes() const { return 4 * (mirror_.size() + 2 * shares_.size() + blocks_.size()); }

  private:
    /// Edges with the same number of tets, which follow each other so that the loop over them is foreseen.
    struct Group {
        std::int32_t tets, edges;
    };
    /// A tet at an edge: where h_i and h_j stand, the tets read as one array of numbers.
    struct Share {
        std::uint32_t i, j;
    };
    template <int tets>
    void write_group(const Group& group, const std::int32_t*& block, const Share*& share,
                     std::span<const RotatedTet> rotated, std::span<float> values) const;

    std::span<const std::int32_t> start_;
    std::vector<std::int32_t> diagonal_;      ///< of each row
    std::vector<std::int32_t> first_mirror_;  ///< of each row
    std::vector<std::int32_t> mirror_;        ///< of each block below a diagonal: the upper one
    std::vector<std::size_t> first_group_, first_edge_, first_share_;  ///< of each chunk
    std::vector<Group> groups_;
    std::vector<std::int32_t> blocks_;   ///< of each edge, group by group: the upper block
    std::vector<Share> shares_;          ///< of each edge, one after the other
};

}  // namespace livetet
