#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "base/thread_team.hpp"

namespace livetet {

/// The sum of of_piece(begin, end) over pieces of [0, count), added in their order. The pieces
/// depend on `count` alone, so that the same bits come out on any number of threads. Allocates
/// nothing.
template <class OfPiece>
auto sum_in_pieces(ThreadTeam& team, std::size_t count, OfPiece&& of_piece) {
    constexpr std::size_t max_pieces = 64;
    constexpr std::size_t min_length = 1536;  // shorter ones are not worth a call
    using Sum = decltype(of_piece(std::size_t{0}, count));
    const std::size_t length = std::max(min_length, (count + max_pieces - 1) / max_pieces);
    const std::size_t pieces = std::max<std::size_t>(1, (count + length - 1) / length);
    std::array<Sum, max_pieces> sums;
    team.run_pieces(pieces, 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k)
            sums[k] = of_piece(k * length, std::min(count, (k + 1) * length));
    });
    Sum total = sums[0];
    for (std::size_t k = 1; k < pieces; ++k) total += sums[k];
    return total;
}

/// a . b over [begin, end), in as many sums as keep the adders busy.
template <class A, class B>
double dot_of_piece(const A* a, const B* b, std::size_t begin, std::size_t end) {
    constexpr std::size_t width = 32;
    double sums[width] = {};
    std::size_t i = begin;
    for (; i + width <= end; i += width)
        for (std::size_t k = 0; k < width; ++k)
            sums[k] += static_cast<double>(a[i + k]) * static_cast<double>(b[i + k]);
    for (; i < end; ++i) sums[0] += static_cast<double>(a[i]) * static_cast<double>(b[i]);
    for (std::size_t half = width / 2; half > 0; half /= 2)
        for (std::size_t k = 0; k < half; ++k) sums[k] += sums[k + half];
    return sums[0];
}

/// a . b, of `count` numbers.
template <class A, class B>
double dot_on_team(ThreadTeam& team, const A* a, const B* b, std::size_t count) {
    return sum_in_pieces(team, count, [=](std::size_t begin, std::size_t end) {
        return dot_of_piece(a, b, begin, end);
    });
}

}  // namespace livetet
