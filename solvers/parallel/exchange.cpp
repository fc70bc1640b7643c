#include "solvers/parallel/exchange.hpp"

#include <cstring>
#include <numeric>

namespace livetet {

namespace {

std::vector<int> starts_of(const std::vector<int>& counts) {
    std::vector<int> starts(counts.size(), 0);
    std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
    return starts;
}

}  // namespace

std::vector<std::byte> exchange_bytes(MPI_Comm comm, std::span<const std::int32_t> ranks,
                                      std::span<const std::byte> items, std::size_t size) {
    int count = 1;
    MPI_Comm_size(comm, &count);
    std::vector<int> sent(count, 0), coming(count, 0);
    for (const std::int32_t r : ranks) ++sent[r];
    MPI_Alltoall(sent.data(), 1, MPI_INT, coming.data(), 1, MPI_INT, comm);
    const std::vector<int> first_sent = starts_of(sent), first_coming = starts_of(coming);

    std::vector<std::byte> sorted(items.size());
    std::vector<int> next = first_sent;
    for (std::size_t i = 0; i < ranks.size(); ++i)
        std::memcpy(sorted.data() + size * static_cast<std::size_t>(next[ranks[i]]++),
                    items.data() + size * i, size);

    MPI_Datatype item = MPI_BYTE;  // whole items are counted, so that counts stay small
    MPI_Type_contiguous(static_cast<int>(size), MPI_BYTE, &item);
    MPI_Type_commit(&item);
    std::vector<std::byte> came(size *
                                static_cast<std::size_t>(first_coming.back() + coming.back()));
    MPI_Alltoallv(sorted.data(), sent.data(), first_sent.data(), item, came.data(), coming.data(),
                  first_coming.data(), item, comm);
    MPI_Type_free(&item);
    return came;
}

}  // namespace livetet
