#pragma once

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace livetet {

/// Sends item i, of `size` bytes, to rank `ranks[i]`. What came: by rising ranks, of each in its
/// order. Collective.
std::vector<std::byte> exchange_bytes(MPI_Comm comm, std::span<const std::int32_t> ranks,
                                      std::span<const std::byte> items, std::size_t size);

/// The same of plain values. Collective.
template <class T>
std::vector<T> exchange(MPI_Comm comm, std::span<const std::int32_t> ranks,
                        const std::vector<T>& items) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::vector<std::byte> came =
        exchange_bytes(comm, ranks, std::as_bytes(std::span(items)), sizeof(T));
    std::vector<T> values(came.size() / sizeof(T));
    if (!came.empty()) std::memcpy(values.data(), came.data(), came.size());
    return values;
}

/// Plain values of all ranks, by rising ranks, on each. For few. Collective.
template <class T>
std::vector<T> of_all_ranks(MPI_Comm comm, const std::vector<T>& here) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    std::vector<std::int32_t> to;
    std::vector<T> items;
    for (std::int32_t r = 0; r < ranks; ++r) {
        to.insert(to.end(), here.size(), r);
        items.insert(items.end(), here.begin(), here.end());
    }
    return exchange(comm, to, items);
}

}  // namespace livetet
