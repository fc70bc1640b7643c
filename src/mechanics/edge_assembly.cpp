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
Columns block_of(std::span<const std::uint32_t> shares, std::span<const RotatedTet> tets) {
    Eight x{}, y{}, z{};
    for (const std::uint32_t share : shares) {
        const RotatedTet& t = tets[share >> 4];
        const float *hj = t.corner[share & 3], lambda = t.corner[0][3], mu = t.corner[1][3];
        const Four hi = load(t.corner[share >> 2 & 3]);
        const Eight scaled = __builtin_shufflevector(hi, hi, 0, 1, 2, 3, 0, 1, 2, 3) *
                             Eight{lambda, lambda, lambda, lambda, mu, mu, mu, mu};
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
    : start_(start), first_{0}, edge_start_{0} {
    std::vector<std::int32_t> edge_of_block(columns.size(), -1);
    const auto block = [&](std::int32_t row, std::int32_t column) {
        return static_cast<std::int32_t>(
            std::lower_bound(columns.begin() + start[row], columns.begin() + start[row + 1], column) - columns.begin());
    };
    for (std::int32_t i = 0; i + 1 < static_cast<std::int32_t>(start.size()); ++i) {
        diagonal_.push_back(block(i, i));
        for (std::int32_t k = diagonal_.back() + 1; k < start[i + 1]; ++k) {
            edge_of_block[k] = static_cast<std::int32_t>(mirror_.size());
            mirror_.push_back(block(columns[k], i));
        }
        first_.push_back(static_cast<std::int32_t>(mirror_.size()));
    }
    // visit(edge, share) for each edge of each tet
    const auto visit_shares = [&](auto&& visit) {
        for (std::size_t lane = 0; lane < parts.tet_of_lane.size(); ++lane) {
            if (parts.tet_of_lane[lane] < 0) continue;
            const auto& tet = tets[parts.tet_of_lane[lane]];
            for (std::uint32_t i = 0; i < 4; ++i)
                for (std::uint32_t j = 0; j < 4; ++j)
                    if (tet[i] < tet[j])
                        visit(edge_of_block[block(tet[i], tet[j])], static_cast<std::uint32_t>(lane) * 16 + 4 * i + j);
        }
    };
    edge_start_.resize(mirror_.size() + 1, 0);
    visit_shares([&](std::int32_t edge, std::uint32_t) { ++edge_start_[edge + 1]; });
    for (std::size_t e = 0; e < mirror_.size(); ++e) edge_start_[e + 1] += edge_start_[e];
    shares_.resize(edge_start_.back());
    std::vector<std::int32_t> next(edge_start_.begin(), edge_start_.end() - 1);
    visit_shares([&](std::int32_t edge, std::uint32_t share) { shares_[next[edge]++] = share; });
}

void EdgeAssembly::write_off_diagonal(std::size_t begin, std::size_t end, std::span<const RotatedTet> tets,
                                      std::span<float> values) const {
    const std::span shares(shares_);
    for (std::size_t i = begin; i < end; ++i) {
        float* right = values.data() + 9 * (static_cast<std::size_t>(diagonal_[i]) + 1);
        for (std::int32_t e = first_[i]; e < first_[i + 1]; ++e, right += 9) {
            const Columns block = block_of(shares.subspan(edge_start_[e], edge_start_[e + 1] - edge_start_[e]), tets);
            store(block, right);
            store(transposed(block), values.data() + 9 * static_cast<std::size_t>(mirror_[e]));
        }
    }
}

void EdgeAssembly::write_diagonal(std::size_t begin, std::size_t end, std::span<float> values) const {
    for (std::size_t i = begin; i < end; ++i) {
        float sum[9] = {};
        for (std::int32_t k = start_[i]; k < start_[i + 1]; ++k) {
            const float* block = values.data() + 9 * static_cast<std::size_t>(k);
            if (k != diagonal_[i])
                for (int c = 0; c < 9; ++c) sum[c] += block[c];
        }
        for (int c = 0; c < 9; ++c) values[9 * static_cast<std::size_t>(diagonal_[i]) + c] = -sum[c];
    }
}

}  // namespace livetet
