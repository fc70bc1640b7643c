#pragma once

#include <petscsf.h>

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "base/petsc.hpp"

namespace livetet {

/// Rows of values, each owned by one rank, and what ranks use of them: moves values between owners
/// and users.
class SharedRows {
  public:
    /// `owned`: number of this rank's rows; they are numbered rank by rank. `used`: the rows that
    /// this rank uses, by number. Collective.
    SharedRows(MPI_Comm comm, std::size_t owned, std::span<const PetscInt> used);

    /// The values of the rows used, from those of the rows owned: `components` each, of integers,
    /// floats, or of doubles or fixed-size matrices of them. Collective.
    template <class T>
    std::vector<T> from_owners(std::span<const T> of_owned, int components = 1) const {
        std::vector<T> of_used(used_ * static_cast<std::size_t>(components));
        from_owners(of_owned, std::span(of_used), components);
        return of_used;
    }
    /// The same into `of_used`.
    template <class T>
    void from_owners(std::span<const T> of_owned, std::span<T> of_used, int components) const {
        constexpr bool is_number = std::is_arithmetic_v<T>;
        static_assert(!is_number || sizeof(T) == 1 || sizeof(T) == 4 || sizeof(T) == 8);
        const MPI_Datatype type = std::is_same_v<T, float> ? MPI_FLOAT
                                  : !std::is_integral_v<T> ? MPI_DOUBLE
                                  : sizeof(T) == 1         ? MPI_UNSIGNED_CHAR
                                  : sizeof(T) == 4         ? MPI_INT
                                                           : MPI_INT64_T;
        const std::size_t numbers = is_number ? 1 : sizeof(T) / sizeof(double);
        broadcast(of_owned.data(), of_used.data(), type,
                  numbers * static_cast<std::size_t>(components));
    }
    /// The sum, for each row owned, of what ranks have for it. Collective.
    std::vector<double> sum_to_owners(std::span<const double> of_used, int components = 1) const {
        return reduce(of_used, components, MPI_SUM);
    }
    /// What the one rank that uses a row has for it; zero for rows that none uses. Collective.
    std::vector<double> to_owners(std::span<const double> of_used, int components) const {
        return reduce(of_used, components, MPI_REPLACE);
    }

  private:
    void broadcast(const void* of_owned, void* of_used, MPI_Datatype type,
                   std::size_t numbers) const;
    std::vector<double> reduce(std::span<const double> of_used, int components, MPI_Op op) const;

    PetscHandle<PetscSF> sf_;  ///< roots: the rows owned; leaves: those used
    std::size_t owned_, used_;
};

}  // namespace livetet
