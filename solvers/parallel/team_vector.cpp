#include "solvers/parallel/team_vector.hpp"

#include <petsc/private/vecimpl.h>  // a vector's operations, of which VecSetOperation has no names

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/piece_sums.hpp"

namespace livetet {

namespace {

/// Least number of components for which a further thread is woken.
constexpr std::size_t grain = 2000;

constexpr const char* key = "livetet_team";

/// What is composed with a vector: its team, and the operations that it had.
struct TeamOfVector {
    ThreadTeam* team = nullptr;
    PetscErrorCode (*duplicate)(Vec, Vec*) = nullptr;
    PetscErrorCode (*norm)(Vec, NormType, PetscReal*) = nullptr;
};

const TeamOfVector& composed(Vec v) {
    PetscObject container = nullptr;
    void* found = nullptr;
    LIVETET_PETSC(PetscObjectQuery(reinterpret_cast<PetscObject>(v), key, &container));
    LIVETET_PETSC(PetscContainerGetPointer(reinterpret_cast<PetscContainer>(container), &found));
    return *static_cast<const TeamOfVector*>(found);
}

ThreadTeam& team_of(Vec v) { return *composed(v).team; }

using Values = Eigen::Map<Eigen::ArrayXd>;
using ConstValues = Eigen::Map<const Eigen::ArrayXd>;

/// work(y, x...) on pieces of the vectors' values. PETSc calls the operation of one vector,
/// `owner`; the others may have no team.
template <class Work, class... From>
PetscErrorCode on_pieces(Vec owner, Vec y, Work&& work, From... from) {
    return in_callback([&] {
        const std::tuple<std::conditional_t<true, ReadArray, From>...> read(from...);
        WriteArray to(y);
        team_of(owner).run_pieces(to.span().size(), grain, [&](std::size_t begin, std::size_t end) {
            const auto count = static_cast<Eigen::Index>(end - begin);
            std::apply(
                [&](const auto&... x) {
                    work(Values(to.span().data() + begin, count),
                         ConstValues(x.span().data() + begin, count)...);
                },
                read);
        });
    });
}

PetscErrorCode dot(Vec x, Vec y, PetscScalar* sum) {
    return in_callback([&] {
        const ReadArray a(x), b(y);
        *sum = dot_on_team(team_of(x), a.span().data(), b.span().data(), a.span().size());
    });
}

/// So many vectors a sum or an update takes in one pass over the vector that they all meet.
constexpr PetscInt at_once = 8;

/// The arrays of up to at_once vectors.
class ReadArrays {
  public:
    ReadArrays(const Vec* vectors, PetscInt count) : vectors_(vectors), count_(count) {
        for (PetscInt k = 0; k < count_; ++k)
            LIVETET_PETSC(VecGetArrayRead(vectors_[k], &data_[k]));
    }
    ~ReadArrays() {
        for (PetscInt k = 0; k < count_; ++k) VecRestoreArrayRead(vectors_[k], &data_[k]);
    }
    ReadArrays(const ReadArrays&) = delete;
    ReadArrays& operator=(const ReadArrays&) = delete;
    PetscInt count() const { return count_; }
    const double* operator[](PetscInt k) const { return data_[k]; }

  private:
    const Vec* vectors_;
    PetscInt count_;
    const PetscScalar* data_[at_once] = {};
};

PetscErrorCode dots(Vec x, PetscInt count, const Vec y[], PetscScalar* sums) {
    return in_callback([&] {
        using Sums = Eigen::Array<double, at_once, 1>;
        const ReadArray a(x);
        for (PetscInt first = 0; first < count; first += at_once) {
            const ReadArrays b(y + first, std::min(at_once, count - first));
            const Sums of_these = sum_in_pieces(
                team_of(x), a.span().size(), [&](std::size_t begin, std::size_t end) -> Sums {
                    Sums of_piece = Sums::Zero();
                    for (PetscInt k = 0; k < b.count(); ++k)
                        of_piece[k] = dot_of_piece(a.span().data(), b[k], begin, end);
                    return of_piece;
                });
            std::copy_n(of_these.data(), b.count(), sums + first);
        }
    });
}

PetscErrorCode norm(Vec x, NormType type, PetscReal* size) {
    return in_callback([&] {
        if (type != NORM_2 && type != NORM_FROBENIUS) {
            LIVETET_PETSC(composed(x).norm(x, type, size));
            return;
        }
        const ReadArray a(x);
        *size =
            std::sqrt(dot_on_team(team_of(x), a.span().data(), a.span().data(), a.span().size()));
    });
}

PetscErrorCode set(Vec y, PetscScalar value) {
    return on_pieces(y, y, [=](Values to) { to = value; });
}

PetscErrorCode scale(Vec y, PetscScalar factor) {
    if (factor == 0) return set(y, 0);  // of NaN, too
    return on_pieces(y, y, [=](Values to) { to *= factor; });
}

PetscErrorCode copy(Vec x, Vec y) {
    if (x == y) return 0;
    return on_pieces(
        x, y, [](Values to, ConstValues from) { to = from; }, x);
}

/// y += a x
PetscErrorCode axpy(Vec y, PetscScalar a, Vec x) {
    return on_pieces(
        y, y, [=](Values to, ConstValues from) { to += a * from; }, x);
}

/// y = a x + b y
PetscErrorCode axpby(Vec y, PetscScalar a, PetscScalar b, Vec x) {
    if (b == 0)  // whatever y holds
        return on_pieces(
            y, y, [=](Values to, ConstValues from) { to = a * from; }, x);
    return on_pieces(
        y, y, [=](Values to, ConstValues from) { to = a * from + b * to; }, x);
}

/// y = x + b y
PetscErrorCode aypx(Vec y, PetscScalar b, Vec x) { return axpby(y, 1, b, x); }

/// w = a x + y
PetscErrorCode waxpy(Vec w, PetscScalar a, Vec x, Vec y) {
    return on_pieces(
        w, w, [=](Values to, ConstValues of_x, ConstValues of_y) { to = a * of_x + of_y; }, x, y);
}

/// y += sum_k a_k x_k
PetscErrorCode maxpy(Vec y, PetscInt count, const PetscScalar* a, Vec* x) {
    return in_callback([&] {
        constexpr std::size_t length = 1024;  // of a piece of y, which stays in the nearest cache
        WriteArray to(y);
        for (PetscInt first = 0; first < count; first += at_once) {
            const ReadArrays terms(x + first, std::min(at_once, count - first));
            team_of(y).run_pieces(to.span().size(), grain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; i += length) {
                    const auto n = static_cast<Eigen::Index>(std::min(length, end - i));
                    for (PetscInt k = 0; k < terms.count(); ++k)
                        Values(to.span().data() + i, n) +=
                            a[first + k] * ConstValues(terms[k] + i, n);
                }
            });
        }
    });
}

PetscErrorCode duplicate(Vec v, Vec* twin) {
    return in_callback([&] {
        const TeamOfVector& own = composed(v);
        LIVETET_PETSC(own.duplicate(v, twin));
        run_on_team(*twin, *own.team);
        LIVETET_PETSC(VecSet(*twin, 0));  // makes room for the norm, too
    });
}

}  // namespace

void run_on_team(Vec v, ThreadTeam& team) {
    _VecOps& ops = *v->ops;
    if (ops.dot != dot) {  // PETSc has given some duplicates what `v` has
        const auto destroy = [](void* t) -> PetscErrorCode {
            delete static_cast<TeamOfVector*>(t);
            return 0;
        };
        PetscContainer container = nullptr;
        LIVETET_PETSC(PetscContainerCreate(PETSC_COMM_SELF, &container));
        LIVETET_PETSC(
            PetscContainerSetPointer(container, new TeamOfVector{&team, ops.duplicate, ops.norm}));
        LIVETET_PETSC(PetscContainerSetUserDestroy(container, destroy));
        LIVETET_PETSC(PetscObjectCompose(reinterpret_cast<PetscObject>(v), key,
                                         reinterpret_cast<PetscObject>(container)));
        LIVETET_PETSC(PetscContainerDestroy(&container));
    }
    ops.duplicate = duplicate;
    ops.dot = ops.tdot = dot;
    ops.mdot = ops.mtdot = dots;
    ops.norm = norm;
    ops.set = set;
    ops.scale = scale;
    ops.copy = copy;
    ops.axpby = axpby;
    ops.axpy = axpy;
    ops.aypx = aypx;
    ops.waxpy = waxpy;
    ops.maxpy = maxpy;
}

}  // namespace livetet
