#include "solvers/parallel/team_vector.hpp"

#include <petsc/private/vecimpl.h>  // a vector's operations, of which VecSetOperation has no names

#include <Eigen/Dense>

#include <cmath>
#include <tuple>

#include "base/piece_sums.hpp"

namespace livetet {

namespace {

/// Least number of components for which a further thread is woken.
constexpr std::size_t grain = 2000;

constexpr const char* key = "livetet_team";

/// What a vector is given: its team, and the operations that it had.
struct Team {
    ThreadTeam* threads = nullptr;
    PetscErrorCode (*duplicate)(Vec, Vec*) = nullptr;
    PetscErrorCode (*norm)(Vec, NormType, PetscReal*) = nullptr;
};

const Team& team_of(Vec v) {
    PetscObject container = nullptr;
    void* team = nullptr;
    LIVETET_PETSC(PetscObjectQuery(reinterpret_cast<PetscObject>(v), key, &container));
    LIVETET_PETSC(PetscContainerGetPointer(reinterpret_cast<PetscContainer>(container), &team));
    return *static_cast<const Team*>(team);
}

using Values = Eigen::Map<Eigen::ArrayXd>;
using ConstValues = Eigen::Map<const Eigen::ArrayXd>;

/// work(y, x...) on pieces of the vectors' values, on the team of `owner`: PETSc calls an operation
/// of one vector, and others need have no team.
template <class Work, class... From>
PetscErrorCode on_pieces(Vec owner, Vec y, Work&& work, From... from) {
    return in_callback([&] {
        const std::tuple<std::conditional_t<true, ReadArray, From>...> read(from...);
        WriteArray to(y);
        team_of(owner).threads->run_pieces(
            to.span().size(), grain, [&](std::size_t begin, std::size_t end) {
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
        *sum = dot_on_team(*team_of(x).threads, a.span().data(), b.span().data(), a.span().size());
    });
}

PetscErrorCode dots(Vec x, PetscInt count, const Vec y[], PetscScalar* sums) {
    for (PetscInt k = 0; k < count; ++k)
        if (const PetscErrorCode failure = dot(x, y[k], sums + k)) return failure;
    return 0;
}

PetscErrorCode norm(Vec x, NormType type, PetscReal* size) {
    if (type != NORM_2 && type != NORM_FROBENIUS) return team_of(x).norm(x, type, size);
    const PetscErrorCode failure = dot(x, x, size);
    *size = std::sqrt(*size);
    return failure;
}

PetscErrorCode set(Vec y, PetscScalar value) {
    return on_pieces(y, y, [=](Values to) { to = value; });
}

PetscErrorCode scale(Vec y, PetscScalar factor) {
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
    return on_pieces(
        y, y, [=](Values to, ConstValues from) { to = a * from + b * to; }, x);
}

/// y = x + b y
PetscErrorCode aypx(Vec y, PetscScalar b, Vec x) {
    return on_pieces(
        y, y, [=](Values to, ConstValues from) { to = from + b * to; }, x);
}

/// w = a x + y
PetscErrorCode waxpy(Vec w, PetscScalar a, Vec x, Vec y) {
    return on_pieces(
        w, w, [=](Values to, ConstValues of_x, ConstValues of_y) { to = a * of_x + of_y; }, x, y);
}

PetscErrorCode maxpy(Vec y, PetscInt count, const PetscScalar* a, Vec* x) {
    for (PetscInt k = 0; k < count; ++k)
        if (const PetscErrorCode failure = axpy(y, a[k], x[k])) return failure;
    return 0;
}

PetscErrorCode duplicate(Vec v, Vec* twin) {
    return in_callback([&] {
        const Team& team = team_of(v);
        PetscReal size = 0;
        LIVETET_PETSC(team.duplicate(v, twin));
        run_on_team(*twin, *team.threads);
        LIVETET_PETSC(VecSet(*twin, 0));
        LIVETET_PETSC(VecNorm(*twin, NORM_2, &size));
    });
}

}  // namespace

void run_on_team(Vec v, ThreadTeam& team) {
    _VecOps& ops = *v->ops;
    if (ops.dot != dot) {
        auto* own = new Team{&team, ops.duplicate, ops.norm};
        const auto destroy = [](void* t) -> PetscErrorCode {
            delete static_cast<Team*>(t);
            return 0;
        };
        PetscContainer container = nullptr;
        LIVETET_PETSC(PetscContainerCreate(PETSC_COMM_SELF, &container));
        LIVETET_PETSC(PetscContainerSetPointer(container, own));
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
