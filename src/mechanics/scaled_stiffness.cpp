#include "mechanics/scaled_stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/sliced_task.hpp"

namespace livetet {

namespace {

using Four [[gnu::vector_size(16)]] = float;
using Eight [[gnu::vector_size(32)]] = float;
using EightInts [[gnu::vector_size(32)]] = std::int32_t;
using EightShorts [[gnu::vector_size(16)]] = std::int16_t;

constexpr float largest = 32000;  ///< that a number of Q becomes; 16 bits end at 32767
constexpr std::size_t step_batches =
    8;  ///< rotated before the edges that they complete are written

Four load(const float* p) {
    Four v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

Eight load_eight(const float* p) {
    Eight v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

/// Adding 3 2^22 leaves a float's nearest integer in the last bits of its mantissa, negative ones
/// as integers have them.
constexpr float round_to_bits = 12582912;

/// A 3x3 matrix by its columns; the fourth lanes mean nothing.
struct Columns {
    Four a, b, c;
};

Columns transposed(const Columns& m) {
    const Four top = __builtin_shufflevector(m.a, m.b, 0, 4, 1, 5),
               low = __builtin_shufflevector(m.a, m.b, 2, 6, 2, 6);
    return {__builtin_shufflevector(top, m.c, 0, 1, 4, 4),
            __builtin_shufflevector(top, m.c, 2, 3, 5, 5),
            __builtin_shufflevector(low, m.c, 0, 1, 6, 6)};
}

void store(const Columns& m, float factor, std::int16_t* to, std::int16_t* ninth) {
    const Four bc = __builtin_shufflevector(m.b, m.c, 1, 2, 4, 5),
               ab = __builtin_shufflevector(m.a, m.b, 0, 1, 2, 4);
    const Eight rounded =
        __builtin_shufflevector(ab, bc, 0, 1, 2, 3, 4, 5, 6, 7) * factor + round_to_bits;
    EightInts bits;
    std::memcpy(&bits, &rounded, sizeof bits);
    const EightShorts shorts = __builtin_convertvector(bits, EightShorts);
    std::memcpy(to, &shorts, sizeof shorts);
    const float last = m.c[2] * factor + round_to_bits;
    std::memcpy(ninth, &last, sizeof *ninth);
}

/// Sum of lambda h_i h_j^T + mu h_j h_i^T + mu h_i . h_j over the tets around an edge: with A = sum
/// lambda h_i h_j^T and B = sum mu h_i h_j^T, in the lower and upper halves of a register, A + B^T
/// + tr(B).
template <class Share>
Columns block_of(const Share* shares, int count, const RotatedTet* tets) {
    const float* numbers = tets->corner[0];
    Eight x{}, y{}, z{};
    for (int k = 0; k < count; ++k) {
        const std::uint32_t i = shares[k].i, j = shares[k].j;
        const float* hj = numbers + j;
        const Four hi = load(numbers + i);
        const Eight moduli =
            load_eight(numbers + i / 16 * 16);  // lambda is the fourth, mu the eighth
        const Eight scaled = __builtin_shufflevector(hi, hi, 0, 1, 2, 3, 0, 1, 2, 3) *
                             __builtin_shufflevector(moduli, moduli, 3, 3, 3, 3, 7, 7, 7, 7);
        x += scaled * hj[0];
        y += scaled * hj[1];
        z += scaled * hj[2];
    }
    const Columns A{__builtin_shufflevector(x, x, 0, 1, 2, 3),
                    __builtin_shufflevector(y, y, 0, 1, 2, 3),
                    __builtin_shufflevector(z, z, 0, 1, 2, 3)};
    const Columns B = transposed({__builtin_shufflevector(x, x, 4, 5, 6, 7),
                                  __builtin_shufflevector(y, y, 4, 5, 6, 7),
                                  __builtin_shufflevector(z, z, 4, 5, 6, 7)});
    const float trace = B.a[0] + B.b[1] + B.c[2];
    return {A.a + B.a + Four{trace, 0, 0, 0}, A.b + B.b + Four{0, trace, 0, 0},
            A.c + B.c + Four{0, 0, trace, 0}};
}

}  // namespace

ScaledStiffness::ScaledStiffness(std::span<const TetElement> elements,
                                 std::span<const std::array<std::int32_t, 4>> tets,
                                 const BatchParts& parts, std::size_t nodes) {
    // The size of a tet's share in the block of a node with itself is V (lambda + 2 mu) |g|^2, or V
    // mu |g|^2.
    std::vector<double> size(nodes, 0.0);
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (int i = 0; i < 4; ++i)
            size[tets[e][i]] += elements[e].volume *
                                std::max(elements[e].lambda + 2 * elements[e].mu, elements[e].mu) *
                                elements[e].gradients.col(i).squaredNorm();
    for (const double s : size)
        scale_.push_back(s > 0 ? static_cast<float>(std::sqrt(s / largest)) : 1.0F);
    find_rows(tets, nodes);
    blocks_.assign(9 * columns_.size() + 2, 0);  // ninths are read with two numbers behind them
    diagonal_.assign(9 * nodes, 0.0F);
    rotated_.resize(parts.tet_of_lane.size());
    find_steps(tets, parts);
    find_renewed_rows();
}

void ScaledStiffness::find_rows(std::span<const std::array<std::int32_t, 4>> tets,
                                std::size_t nodes) {
    std::vector<std::vector<std::int32_t>> neighbours(nodes);
    for (std::size_t e = 0; e < tets.size(); ++e) {
        pause_point_at(e);
        for (const std::int32_t i : tets[e])
            for (const std::int32_t j : tets[e])
                if (i != j) neighbours[i].push_back(j);
    }
    start_.push_back(0);
    for (std::size_t i = 0; i < nodes; ++i) {
        pause_point_at(i);
        auto& row = neighbours[i];
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        for (const std::int32_t j : row) columns_.push_back(3 * j);
        end_.push_back(static_cast<std::int32_t>(columns_.size()));
        if (row.size() % 2) columns_.push_back(3 * static_cast<std::int32_t>(i));
        start_.push_back(static_cast<std::int32_t>(columns_.size()));
        const auto lower =
            std::lower_bound(row.begin(), row.end(), static_cast<std::int32_t>(i)) - row.begin();
        upper_.push_back(start_[i] + static_cast<std::int32_t>(lower));
    }
    std::vector<std::int32_t> next =
        upper_;  // rows ascend: a column's blocks right of the diagonal are met in order
    for (std::size_t i = 0; i < nodes; ++i) {
        first_mirror_.push_back(static_cast<std::int32_t>(mirror_.size()));
        for (std::int32_t k = start_[i]; k < upper_[i]; ++k)
            mirror_.push_back(next[columns_[k] / 3]++);
    }
}

namespace {

/// Steps in which so many batches are rotated.
std::size_t steps_of(std::size_t batches) { return (batches + step_batches - 1) / step_batches; }

}  // namespace

void ScaledStiffness::find_steps(std::span<const std::array<std::int32_t, 4>> tets,
                                 const BatchParts& parts) {
    const std::vector<BatchRange>& own = parts.rounds.front();
    const auto block = [&](std::int32_t row, std::int32_t column) {
        return static_cast<std::int32_t>(std::lower_bound(columns_.begin() + start_[row],
                                                          columns_.begin() + end_[row],
                                                          3 * column) -
                                         columns_.begin());
    };
    struct EdgeTets {  // the tets around an edge
        std::vector<Share> shares;
        int part = -1;
        std::size_t step = 0;  ///< of its part, in which its last tet is rotated
        float factor = 0;
    };
    std::vector<EdgeTets> tets_of_block(columns_.size());  // of each block right of the diagonal
    for (std::size_t lane = 0; lane < parts.tet_of_lane.size(); ++lane) {
        pause_point_at(lane);
        if (parts.tet_of_lane[lane] < 0) continue;
        const auto& tet = tets[parts.tet_of_lane[lane]];
        const auto at = static_cast<std::uint32_t>(lane) * 16;
        const std::size_t batch = lane / batch_width<float>;
        const auto part = std::find_if(own.begin(), own.end(),
                                       [batch](const BatchRange& r) { return batch < r.end; });
        for (std::uint32_t i = 0; i < 4; ++i)
            for (std::uint32_t j = 0; j < 4; ++j) {
                if (tet[i] >= tet[j]) continue;
                EdgeTets& edge_tets = tets_of_block[block(tet[i], tet[j])];
                edge_tets.shares.push_back({at + 4 * i, at + 4 * j});
                edge_tets.factor = 1 / (scale_[tet[i]] * scale_[tet[j]]);
                if (part == own.end()) continue;  // of a later round
                edge_tets.part = static_cast<int>(part - own.begin());
                edge_tets.step = std::max(edge_tets.step, (batch - part->begin) / step_batches);
            }
    }
    std::vector<std::vector<std::vector<std::int32_t>>> edges(own.size());  // part, step
    for (std::size_t p = 0; p < edges.size(); ++p)
        edges[p].resize(std::max<std::size_t>(1, steps_of(own[p].end - own[p].begin)));
    // Edges of later tets alone go to parts and steps by their order: a cache line that two threads
    // write is slow.
    std::vector<std::int32_t> of_later;
    for (std::size_t i = 0; i < nodes(); ++i)
        for (std::int32_t k = upper_[i]; k < end_[i]; ++k)
            if (const EdgeTets& e = tets_of_block[k]; e.part < 0)
                of_later.push_back(k);
            else
                edges[e.part][e.step].push_back(k);
    for (std::size_t q = 0; q < of_later.size(); ++q) {
        const std::size_t place = q * edges.size(), part = place / of_later.size();
        const std::size_t in_part = place % of_later.size();
        edges[part][in_part * edges[part].size() / of_later.size()].push_back(of_later[q]);
    }
    for (std::size_t p = 0; p < edges.size(); ++p) {
        const std::size_t first_half = (edges[p].size() + 1) / 2;
        for (std::size_t s = 0; s < edges[p].size(); ++s) {
            if (s == 0 || s == first_half)
                halves_.push_back({steps_.size(), groups_.size(), edges_.size(), shares_.size()});
            auto& of_step = edges[p][s];
            std::stable_sort(of_step.begin(), of_step.end(), [&](std::int32_t a, std::int32_t b) {
                return tets_of_block[a].shares.size() < tets_of_block[b].shares.size();
            });
            const std::size_t first_group = groups_.size();
            pause_point();
            for (const std::int32_t k : of_step) {
                const auto& shares = tets_of_block[k].shares;
                const auto count = static_cast<std::int32_t>(shares.size());
                if (groups_.size() == first_group || groups_.back().tets != count)
                    groups_.push_back({count, 0});
                ++groups_.back().edges;
                edges_.push_back({k, tets_of_block[k].factor});
                shares_.insert(shares_.end(), shares.begin(), shares.end());
            }
            const std::size_t begin = own[p].begin + s * step_batches;
            steps_.push_back({{begin, std::min(begin + step_batches, own[p].end)}, groups_.size()});
        }
        if (first_half == edges[p].size())
            halves_.push_back({steps_.size(), groups_.size(), edges_.size(), shares_.size()});
    }
    halves_.push_back({steps_.size(), groups_.size(), edges_.size(), shares_.size()});
}

void ScaledStiffness::find_renewed_rows() {
    std::vector<std::uint8_t> halves_of(
        nodes(), 0);  // bit 0: the first half writes in the row; bit 1: the second
    std::vector<std::int32_t> row_of(columns_.size());
    for (std::size_t i = 0; i < nodes(); ++i)
        std::fill(row_of.begin() + start_[i], row_of.begin() + start_[i + 1],
                  static_cast<std::int32_t>(i));
    for (std::size_t h = 0; h + 1 < halves_.size(); ++h)
        for (std::size_t e = halves_[h].first_edge; e < halves_[h + 1].first_edge; ++e)
            for (const std::int32_t i : {row_of[edges_[e].block], columns_[edges_[e].block] / 3})
                halves_of[i] |= 1 << h % 2;
    for (std::size_t i = 0; i < nodes(); ++i) {
        rows_[0].push_back(static_cast<std::int32_t>(i));
        for (int half = 0; half < 2; ++half)
            if (halves_of[i] >> half & 1) rows_[1 + half].push_back(static_cast<std::int32_t>(i));
    }
}

void ScaledStiffness::rotate_later(BatchRange range, const TetBatches<float>& batches,
                                   std::span<const RotationBatch<float>> rotations) {
    rotate_gradients(batches, range, rotations, rotated_);
}

template <int tets>
void ScaledStiffness::write_group(const Group& group, const Edge*& edge, const Share*& share) {
    const int count = tets > 0 ? tets : group.tets;
    for (std::int32_t e = 0; e < group.edges; ++e, ++edge, share += count)
        store(block_of(share, count, rotated_.data()), edge->factor,
              blocks_.data() + eight_at(edge->block), blocks_.data() + ninth_at(edge->block));
}

void ScaledStiffness::write_half(std::size_t half, const TetBatches<float>& batches,
                                 std::span<const RotationBatch<float>> rotations) {
    const Edge* edge = edges_.data() + halves_[half].first_edge;
    const Share* share = shares_.data() + halves_[half].first_share;
    std::size_t g = halves_[half].first_group;
    for (std::size_t s = halves_[half].first_step; s < halves_[half + 1].first_step; ++s) {
        rotate_gradients(batches, steps_[s].batches, rotations, rotated_);
        for (; g < steps_[s].end_group; ++g) {
            switch (groups_[g].tets) {  // the usual numbers unrolled
                case 3:
                    write_group<3>(groups_[g], edge, share);
                    break;
                case 4:
                    write_group<4>(groups_[g], edge, share);
                    break;
                case 5:
                    write_group<5>(groups_[g], edge, share);
                    break;
                case 6:
                    write_group<6>(groups_[g], edge, share);
                    break;
                default:
                    write_group<0>(groups_[g], edge, share);
            }
        }
    }
}

void ScaledStiffness::write_part(int part, Renewal renewal, const TetBatches<float>& batches,
                                 std::span<const RotationBatch<float>> rotations) {
    if (renewal != Renewal::second_half) write_half(2 * part, batches, rotations);
    if (renewal != Renewal::first_half) write_half(2 * part + 1, batches, rotations);
}

void ScaledStiffness::write_rows(std::span<const std::int32_t> rows) {
    std::int16_t* blocks = blocks_.data();
    for (const std::int32_t i : rows) {
        const std::int32_t* mirror = mirror_.data() + first_mirror_[i];
        Eight sum{};
        float last = 0;
        const auto add = [&](const EightShorts& q, std::int16_t ninth, std::int32_t k) {
            const float s = scale_[static_cast<std::uint32_t>(columns_[k]) / 3];
            sum += eight_floats(q) * s;
            last += static_cast<float>(ninth) * s;
        };
        for (std::int32_t k = start_[i]; k < upper_[i]; ++k, ++mirror) {
            const EightShorts upper = load_shorts(blocks + eight_at(*mirror)),
                              q = __builtin_shufflevector(upper, upper, 0, 3, 6, 1, 4, 7, 2, 5);
            const std::int16_t ninth = blocks[ninth_at(*mirror)];
            std::memcpy(blocks + eight_at(k), &q, sizeof q);
            blocks[ninth_at(k)] = ninth;
            add(q, ninth, k);
        }
        for (std::int32_t k = upper_[i]; k < end_[i]; ++k)
            add(load_shorts(blocks + eight_at(k)), blocks[ninth_at(k)], k);
        const float per = -1 / scale_[i];
        sum *= per;
        std::memcpy(diagonal_.data() + 9 * i, &sum, sizeof sum);
        diagonal_[9 * i + 8] = per * last;
    }
}

}  // namespace livetet
