#pragma once

#ifdef __AVX2__
#include <immintrin.h>
#endif

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mechanics/batch_kernels.hpp"

namespace livetet {

/// h_i = R g_i, 1/m, of the four corners of a tet; the fourth numbers of the first two corners are
/// its volume times lambda and times mu, N m (of the others: none). A cache line.
struct alignas(64) RotatedTet {
    float corner[4][4];
};

/// The tet of every lane of `range` to tets[batch * batch_width + lane].
void rotate_gradients(const TetBatches<float>& batches, BatchRange range,
                      std::span<const RotationBatch<float>> rotations, std::span<RotatedTet> tets);

/// Which blocks a renewal writes. Half renewals split the blocks by the position of their last tet;
/// blocks of the two halves differ by the rotation between the two renewals.
enum class Renewal : std::uint8_t { whole, first_half, second_half };

/// The stiffness sum R K R^T (as `assemble`) in 22 bytes a block rather than 40: S Q S, where S is
/// a number for each node that does not change, and the blocks of Q off the diagonal are integers
/// of 16 bits. A step of Q is 1/32000 of the largest that a block between two nodes can become,
/// however its tets turn: K_ij of a positive operator is no larger than the root of K_ii K_jj, and
/// rotations do not change the size of a tet's share in those. Blocks are column-major; the
/// diagonal's are float, minus the sum of the others, so that translations make no force to float's
/// last digit.
///
/// Blocks are made one by one rather than tet by tet: each is summed in registers over the tets
/// around its edge and written once, as soon as the last of these tets is rotated, while they are
/// in the cache.
class ScaledStiffness {
  public:
    /// `tets[e]`: the corners of `elements[e]`; `parts`: where their lanes are.
    ScaledStiffness(std::span<const TetElement> elements,
                    std::span<const std::array<std::int32_t, 4>> tets, const BatchParts& parts,
                    std::size_t nodes);

    std::size_t nodes() const { return start_.size() - 1; }
    /// S, the root of N/m.
    std::span<const float> scale() const { return scale_; }
    /// Q's block on the diagonal, without unit.
    std::span<float, 9> diagonal(std::size_t node) {
        return std::span<float, 9>(diagonal_.data() + 9 * node, 9);
    }
    /// visit(column, block's numbers) for the blocks off the diagonal of a row.
    template <class Visit>
    void visit_row(std::size_t node, Visit&& visit) const {
        for (std::int32_t k = start_[node]; k < end_[node]; ++k) {
            std::array<std::int16_t, 9> numbers;
            std::copy_n(blocks_.data() + eight_at(k), 8, numbers.begin());
            numbers[8] = blocks_[ninth_at(k)];
            visit(columns_[k] / 3, numbers);
        }
    }

    /// First for the batches of later rounds (ranges of BatchParts::later, by any threads), then
    /// for each part of the first (one thread each), then for rows_of(renewal): each when all of
    /// the one before is done.
    void rotate_later(BatchRange range, const TetBatches<float>& batches,
                      std::span<const RotationBatch<float>> rotations);
    void write_part(int part, Renewal renewal, const TetBatches<float>& batches,
                    std::span<const RotationBatch<float>> rotations);
    void write_rows(std::span<const std::int32_t> rows);
    /// The rows with a block that a renewal writes, ascending.
    std::span<const std::int32_t> rows_of(Renewal renewal) const {
        return rows_[static_cast<std::size_t>(renewal)];
    }

    /// y_i = Q_ii x_i + sum_j Q_ij x_j over the blocks of row i. visit(i, y_i) for rows [begin,
    /// end), y_i in the first three lanes of four; x: three numbers a node and one behind.
    template <class Visit>
    void multiply(std::size_t begin, std::size_t end, const float* x, Visit&& visit) const;

    std::size_t bytes_of_product() const {
        return blocks_.size() * 2 + (columns_.size() + diagonal_.size()) * 4;
    }
    std::size_t bytes_of_update() const {
        return 2 * sizeof(RotatedTet) * rotated_.size() + sizeof(Share) * shares_.size() +
               sizeof(Edge) * edges_.size() + 4 * mirror_.size() + 3 * 2 * blocks_.size() +
               4 * (columns_.size() + diagonal_.size());
    }

  private:
    using Four [[gnu::vector_size(16)]] = float;
    using Eight [[gnu::vector_size(32)]] = float;
    using EightShorts [[gnu::vector_size(16)]] = std::int16_t;

    /// Integers of 16 bits as floats; four numbers in both halves of a register. GCC 12 takes two
    /// to four times the instructions for what can be said without intrinsics.
#ifdef __AVX2__
    static Eight eight_floats(const EightShorts& q) {
        return _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(reinterpret_cast<const __m128i&>(q)));
    }
    static Four four_floats(const std::int16_t* p) {
        return _mm_cvtepi32_ps(
            _mm_cvtepi16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p))));
    }
    static Eight load_twice(const float* p) {
        return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p));
    }
#else
    static Eight eight_floats(const EightShorts& q) {
        Eight v;
        for (int i = 0; i < 8; ++i) v[i] = q[i];
        return v;
    }
    static Four four_floats(const std::int16_t* p) {
        return Four{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]),
                    static_cast<float>(p[3])};
    }
    static Eight load_twice(const float* p) {
        return Eight{p[0], p[1], p[2], p[3], p[0], p[1], p[2], p[3]};
    }
#endif

    static EightShorts load_shorts(const std::int16_t* p) {
        EightShorts q;
        __builtin_memcpy(&q, p, sizeof q);
        return q;
    }

    /// A tet at an edge: where h_i and h_j stand, `rotated_` read as one array of numbers.
    struct Share {
        std::uint32_t i, j;
    };
    /// A block right of the diagonal, and 1 / (S_i S_j).
    struct Edge {
        std::int32_t block;
        float factor;
    };
    /// Edges with the same number of tets, which follow each other so that the loop over them is
    /// foreseen.
    struct Group {
        std::int32_t tets, edges;
    };
    /// Some batches to rotate, and the groups of edges to write then.
    struct Step {
        BatchRange batches;
        std::size_t end_group;
    };
    struct HalfPart {
        std::size_t first_step, first_group, first_edge, first_share;
    };
    /// Blocks stand in pairs: eight numbers of the one, eight of the other, the ninth of both.
    static std::size_t eight_at(std::uint32_t k) { return k / 2 * 18 + k % 2 * 8; }
    static std::size_t ninth_at(std::uint32_t k) { return k / 2 * 18 + k % 2 + 16; }
    void find_rows(std::span<const std::array<std::int32_t, 4>> tets, std::size_t nodes);
    void find_steps(std::span<const std::array<std::int32_t, 4>> tets, const BatchParts& parts);
    void find_renewed_rows();
    void write_half(std::size_t half, const TetBatches<float>& batches,
                    std::span<const RotationBatch<float>> rotations);
    template <int tets>
    void write_group(const Group& group, const Edge*& edge, const Share*& share);

    // Rows of blocks off the diagonal, columns ascending (three times the node), padded to pairs by
    // blocks of zeros.
    std::vector<std::int32_t> start_, end_, columns_;
    std::vector<std::int32_t> upper_;  ///< of each row: its first block right of the diagonal
    std::vector<std::int32_t>
        mirror_;  ///< of each block left of a diagonal: where its transpose stands
    std::vector<std::int32_t> first_mirror_;  ///< of each row
    std::vector<std::int16_t> blocks_;
    std::vector<float> diagonal_, scale_;
    std::vector<RotatedTet> rotated_;                ///< of each lane
    std::vector<HalfPart> halves_;                   ///< two of each part; and one behind
    std::array<std::vector<std::int32_t>, 3> rows_;  ///< of each renewal
    std::vector<Step> steps_;
    std::vector<Group> groups_;
    std::vector<Edge> edges_;
    std::vector<Share> shares_;
};

template <class Visit>
void ScaledStiffness::multiply(std::size_t begin, std::size_t end, const float* x,
                               Visit&& visit) const {
    const auto load = [](const float* p) {
        Four v;
        __builtin_memcpy(&v, p, sizeof v);
        return v;
    };
    // x as the first eight numbers of a block meet it
    const auto spread = [](const float* p) {
        const Eight twice = load_twice(p);
        return __builtin_shufflevector(twice, twice, 0, 0, 0, 1, 5, 5, 6, 6);
    };
    for (std::size_t i = begin; i < end; ++i) {
        const float* d = diagonal_.data() + 9 * i;
        const Four own = load(x + 3 * i);
        Eight even{}, odd{};
        __builtin_memcpy(&even, d, sizeof even);
        even *= spread(x + 3 * i);
        Four ninths{d[8] * own[2], 0, 0, 0};
        const std::int16_t* a = blocks_.data() + 9 * static_cast<std::size_t>(start_[i]);
        for (std::int32_t k = start_[i]; k < start_[i + 1]; k += 2, a += 18) {
            const float *u = x + columns_[k], *v = x + columns_[k + 1];
            even += eight_floats(load_shorts(a)) * spread(u);
            odd += eight_floats(load_shorts(a + 8)) * spread(v);
            // Two ninths; what stands behind them, times what stands behind u and v, is left.
            ninths += four_floats(a + 16) * __builtin_shufflevector(load(u), load(v), 2, 6, 3, 7);
        }
        even += odd;
        const Four low = __builtin_shufflevector(even, even, 0, 1, 2, 2),
                   middle = __builtin_shufflevector(even, even, 3, 4, 5, 5);
        visit(i, low + middle + Four{even[6], even[7], ninths[0] + ninths[1], 0});
    }
}

}  // namespace livetet
