#include "mechanics/edge_assembly.hpp"

#include <algorithm>
#include <cstring>

namespace livetet {

namespace {

using Four [[gnu::vector_size(16)]] = float;
using Eight [[gnu::vector_size(32)]] = float;

Four load(const float* p) {
    Four v;
    std::memcpy(&v, p, sizeof v);
    return v;
}

/// A 3x3 matrix by its columns; the fourth lanes mean nothing.
struct Columns {
    Four a, b, c;
};

Columns transposed(const Columns& m) {
    const Four top = __builtin_shufflevector(m.a, m.b, 0, 4, 1, 5), low = __builtin_shufflevector(m.a, m.b, 2, 6, 2, 6);
    return {__builtin_shufflevector(top, m.c, 0, 1, 4, 4), __builtin_shufflevector(top, m.c, 2, 3, 5, 5),
            __builtin_shufflevector(low, m.c, 0, 1, 6, 6)};
}

/// Nine numbers and not one more: the next block may stand already.
void store(const Columns& m, float* to) {
    std::memcpy(to, &m.a, sizeof m.a);
    std::memcpy(to + 3, &m.b, sizeof m.b);
    std::memcpy(to + 6, &m.c, 2 * sizeof(float));
    to[8] = m.c[2];
}

/// Sum of lambda h_i h_j^T + mu h_j h_i^T + mu h_i . h_j over the tets around an edge: with A = sum lambda h_i h_j^T and
/// B = sum mu h_i h_j^T, in the lower and upper halves of a register, A + B^T + tr(B).
template <class Share>
Columns block_of(const Share* shares, int count, std::span<const RotatedTet> tets) {
    const auto* numbers = tets.front().corner[0];
    Eight x{}, y{}, z{};
    for (int k = 0; k < count; ++k) {
        const std::uint32_t i = shares[k].i, j = shares[k].j;
        const float* hj = numbers + j;
        const Four hi = load(numbers + i);
        Eight moduli;  // lambda is the fourth of eight numbers, mu the eighth
        std::memcpy(&moduli, numbers + i / 16 * 16, sizeof moduli);
        const Eight scaled = __builtin_shufflevector(hi, hi, 0, 1, 2, 3, 0, 1, 2, 3) *
                             __builtin_shufflevector(moduli, moduli, 3, 3, 3, 3, 7, 7, 7, 7);
        x += scaled * hj[0];
        y += scaled * hj[1];
        z += scaled * hj[2];
    }
    const Columns A{__builtin_shufflevector(x, x, 0, 1, 2, 3), __builtin_shufflevector(y, y, 0, 1, 2, 3),
                    __builtin_shufflevector(z, z, 0, 1, 2, 3)};
    const Columns B = transposed({__builtin_shufflevector(x, x, 4, 5, 6, 7), __builtin_shufflevector(y, y, 4, 5, 6, 7),
                                  __builtin_shufflevector(z, z, 4, 5, 6, 7)});
    const float trace = B.a[0] + B.b[1] + B.c[2];
    return {A.a + B.a + Four{trace, 0, 0, 0}, A.b + B.b + Four{0, trace, 0, 0}, A.c + B.c + Four{0, 0, trace, 0}};
}

}  // namespace

EdgeAssembly::EdgeAssembly(std::span<const std::array<std::int32_t, 4>> tets, const BatchParts& parts,
                           std::span<const std::int32_t> start, std::span<const std::int32_t> columns)
    : start_(start) {
    const auto block = [&](std::int32_t row, std::int32_t column) {
        return static_cast<std::int32_t>(
            std::lower_bound(columns.begin() + start[row], columns.begin() + start[row + 1], column) - columns.begin());
    };
    const auto rows = static_cast<std::int32_t>(start.size()) - 1;
    for (std::int32_t i = 0; i < rows; ++i) {
        diagonal_.push_back(block(i, i));
        first_mirror_.push_back(static_cast<std::int32_t>(mirror_.size()));
        for (std::int32_t k = start[i]; k < diagonal_.back(); ++k) mirror_.push_back(block(columns[k], i));
    }
    std::vector<std::vector<Share>> shares(columns.size());  // of each upper block
    for (std::size_t lane = 0; lane < parts.tet_of_lane.size(); ++lane) {
        if (parts.tet_of_lane[lane] < 0) continue;
        const auto& tet = tets[parts.tet_of_lane[lane]];
        const auto at = static_cast<std::uint32_t>(lane) * 16;
        for (std::uint32_t i = 0; i < 4; ++i)
            for (std::uint32_t j = 0; j < 4; ++j)
                if (tet[i] < tet[j]) shares[block(tet[i], tet[j])].push_back({at + 4 * i, at + 4 * j});
    }
    for (std::int32_t first = 0; first < rows; first += chunk_rows) {
        first_group_.push_back(groups_.size());
        first_edge_.push_back(blocks_.size());
        first_share_.push_back(shares_.size());
        const auto begin = static_cast<std::ptrdiff_t>(blocks_.size());
        for (std::int32_t i = first; i < std::min<std::int32_t>(rows, first + chunk_rows); ++i)
            for (std::int32_t k = diagonal_[i] + 1; k < start[i + 1]; ++k) blocks_.push_back(k);
        std::stable_sort(blocks_.begin() + begin, blocks_.end(),
                         [&](std::int32_t a, std::int32_t b) { return shares[a].size() < shares[b].size(); });
        for (auto k = blocks_.begin() + begin; k != blocks_.end(); ++k) {
            const auto count = static_cast<std::int32_t>(shares[*k].size());
            if (groups_.size() == first_group_.back() || groups_.back().tets != count) groups_.push_back({count, 0});
            ++groups_.back().edges;
            shares_.insert(shares_.end(), shares[*k].begin(), shares[*k].end());
        }
    }
    first_group_.push_back(groups_.size());
}

template <int tets>
void EdgeAssembly::write_group(const Group& group, const std::int32_t*& block, const Share*& share,
                               std::span<const RotatedTet> rotated, std::span<float> values) const {
    const int count = tets > 0 ? tets : group.tets;
    for (std::int32_t e = 0; e < group.edges; ++e, ++block, share += count)
        store(block_of(share, count, rotated), values.data() + 9 * static_cast<std::size_t>(*block));
}

void EdgeAssembly::write_upper(std::size_t begin, std::size_t end, std::span<const RotatedTet> tets,
                               std::span<float> values) const {
    if (begin == end) return;
    const std::int32_t* block = blocks_.data() + first_edge_[begin];
    const Share* share = shares_.data() + first_share_[begin];
    for (std::size_t g = first_group_[begin]; g < first_group_[end]; ++g) {
        switch (groups_[g].tets) {  // the usual numbers unrolled
            case 3: write_group<3>(groups_[g], block, share, tets, values); break;
            case 4: write_group<4>(groups_[g], block, share, tets, values); break;
            case 5: write_group<5>(groups_[g], block, share, tets, values); break;
            case 6: write_group<6>(groups_[g], block, share, tets, values); break;
            default: write_group<0>(groups_[g], block, share, tets, values);
        }
    }
}

void EdgeAssembly::write_rest(std::size_t begin, std::size_t end, std::span<float> values) const {
    for (std::size_t i = begin; i < end; ++i) {
        Eight sum{};
        float last = 0;
        float* block = values.data() + 9 * static_cast<std::size_t>(start_[i]);
        const std::int32_t* mirror = mirror_.data() + first_mirror_[i];
        for (std::int32_t k = start_[i]; k < diagonal_[i]; ++k, ++mirror, block += 9) {
            const float* upper = values.data() + 9 * static_cast<std::size_t>(*mirror);
            Eight v;
            std::memcpy(&v, upper, sizeof v);
            v = __builtin_shufflevector(v, v, 0, 3, 6, 1, 4, 7, 2, 5);
            std::memcpy(block, &v, sizeof v);
            block[8] = upper[8];
            sum += v;
            last += upper[8];
        }
        float* diagonal = block;
        block += 9;
        for (std::int32_t k = diagonal_[i] + 1; k < start_[i + 1]; ++k, block += 9) {
            Eight v;
            std::memcpy(&v, block, sizeof v);
            sum += v;
            last += block[8];
        }
        sum = -sum;
        std::memcpy(diagonal, &sum, sizeof sum);
        diagonal[8] = -last;
    }
}

}  // namespace livetet
