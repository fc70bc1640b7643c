// What a frame is made of, each part alone, on a block of about 60,000 tets: milliseconds, one
// core.
//     build/benchmarks/bench_kernels --benchmark_repetitions=5
//     --benchmark_report_aggregates_only=true
// `assemble` stands beside PETSc's own way in (MatSetValuesBlocked) on the same mesh in the same
// run.

#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <random>

#include "mechanics/rotation.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "solvers/parallel/petsc_session.hpp"
#include "support/p1_kernels.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

struct Setting {
    MeshHierarchy hierarchy = make_hierarchy(
        {test::block({32, 18, 18}, {0.16, 0.09, 0.09}), test::block({16, 9, 9}, {0.16, 0.09, 0.09}),
         test::block({8, 5, 5}, {0.16, 0.09, 0.09})},
        "block");
    std::vector<Material> materials{Material{}};
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
};

const Setting& setting() {
    static const Setting s;
    return s;
}

struct Level {
    LevelAssembler level;
    PetscHandle<Vec> u, f;
    ElementRotations rotations;
    explicit Level(MatrixLayout layout)
        : level(distribute_mesh(PETSC_COMM_SELF, setting().mesh(), {}), setting().materials,
                "corotated", Formulation::displacement, layout),
          u(make_vector(level.share())),
          f(make_vector(level.share())),
          rotations(level.make_rotations()) {
        std::vector<Vector3> bend;
        for (const Vector3& x : setting().mesh().nodes) bend.push_back({0, 0, 2 * x.x() * x.x()});
        set_values(level.share(), bend, u.get());
        update_ghosts(u.get());
        level.update_rotations(u.get(), rotations);
        level.assemble({.u = u.get(), .rotations = &rotations}, {});
    }
};

void rotations(benchmark::State& state) {
    Level l(MatrixLayout::blocks);
    for (auto _ : state) l.level.update_rotations(l.u.get(), l.rotations);
}

void elastic_force(benchmark::State& state) {
    Level l(MatrixLayout::blocks);
    for (auto _ : state)
        l.level.elastic_force({.u = l.u.get(), .rotations = &l.rotations}, l.f.get());
}

template <MatrixLayout layout, Tangent tangent = Tangent::frozen_rotation>
void assemble(benchmark::State& state) {
    Level l(layout);
    for (auto _ : state)
        l.level.assemble({.u = l.u.get(), .rotations = &l.rotations}, {.tangent = tangent});
}

/// The alternative: the same blocks through PETSc's own call.
void assemble_by_matsetvaluesblocked(benchmark::State& state) {
    Level l(MatrixLayout::blocks);
    const TetMesh& mesh = setting().mesh();
    Mat A = l.level.matrix();
    std::array<double, 144> K;
    for (auto _ : state) {
        LIVETET_PETSC(MatZeroEntries(A));
        for (const Tet& t : mesh.tets) {
            const TetElement e = make_element(
                {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]}, 1000,
                500);
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) {
                    const Eigen::Matrix3d block =
                        test::stiffness_block(e, e.gradients.col(i), e.gradients.col(j));
                    for (int a = 0; a < 3; ++a)
                        for (int b = 0; b < 3; ++b) K[12 * (3 * i + a) + 3 * j + b] = block(a, b);
                }
            LIVETET_PETSC(MatSetValuesBlocked(A, 4, t.data(), 4, t.data(), K.data(), ADD_VALUES));
        }
        LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
        LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    }
}

template <MatrixLayout layout>
void matrix_vector_product(benchmark::State& state) {
    Level l(layout);
    for (auto _ : state) LIVETET_PETSC(MatMult(l.level.matrix(), l.u.get(), l.f.get()));
    MatInfo info;
    LIVETET_PETSC(MatGetInfo(l.level.matrix(), MAT_LOCAL, &info));
    // Bytes that must come from memory: the values, an index each block (or number), the vectors.
    const double index_bytes = layout == MatrixLayout::blocks ? 4.0 / 9 : 4.0;
    state.counters["GB/s"] = benchmark::Counter(
        (8 + index_bytes) * info.nz_used + 48.0 * setting().mesh().nodes.size(),
        benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
}

/// The bound of the products above: what this core reads from memory, in the same run.
void memory_bandwidth(benchmark::State& state) {
    const std::vector<double> values(16 << 20, 1.0);
    double sum = 0;
    for (auto _ : state)
        benchmark::DoNotOptimize(
            sum += Eigen::Map<const Eigen::VectorXd>(values.data(), values.size()).sum());
    state.counters["GB/s"] =
        benchmark::Counter(8.0 * values.size(), benchmark::Counter::kIsIterationInvariantRate,
                           benchmark::Counter::kIs1000);
}

/// A whole frame: one linearisation, solved to 1e-3, of a press that goes up and down.
template <SolverKind kind, CoarseOperator coarse>
void frame(benchmark::State& state) {
    const Setting& s = setting();
    DeformableBody body(
        {PETSC_COMM_SELF, s.hierarchy}, {s.materials, "corotated"},
        {.scheme = TimeScheme::newmark, .rayleigh_alpha = 10, .rayleigh_beta = 0.01},
        {.kind = kind, .coarse = coarse});
    Constraints constraints(s.mesh().nodes.size());
    const auto held = test::nodes_where(s.mesh(), [](const Vector3& x) { return x.z() < 1e-9; });
    const auto driven = test::nodes_where(s.mesh(), [](const Vector3& x) {
        return x.z() > 0.0899 && (x - Vector3(0.08, 0.045, 0.09)).norm() < 0.015;
    });
    constraints.prescribe(held, Vector3::Zero());
    int step = 0, iterations = 0;
    for (auto _ : state) {
        constraints.prescribe(driven, {0, 0, -0.0075 * (1 - std::cos(2 * M_PI * 0.05 * step++))});
        body.set_constraints(constraints);
        iterations +=
            body.advance(0.05, {.newton_iterations = 1, .linear_tolerance = 1e-3}).iterations;
    }
    state.counters["iterations"] = static_cast<double>(iterations) / step;
}

#define LIVETET_BENCHMARK(...) BENCHMARK(__VA_ARGS__)->Unit(benchmark::kMillisecond)
LIVETET_BENCHMARK(memory_bandwidth);
LIVETET_BENCHMARK(rotations);
LIVETET_BENCHMARK(elastic_force);
LIVETET_BENCHMARK(assemble<MatrixLayout::blocks>);
LIVETET_BENCHMARK(assemble<MatrixLayout::blocks, Tangent::exact>);
LIVETET_BENCHMARK(assemble<MatrixLayout::scalars>);
LIVETET_BENCHMARK(assemble_by_matsetvaluesblocked);
LIVETET_BENCHMARK(matrix_vector_product<MatrixLayout::blocks>);
LIVETET_BENCHMARK(matrix_vector_product<MatrixLayout::scalars>);
LIVETET_BENCHMARK(frame<SolverKind::live, CoarseOperator::rediscretised>)->Iterations(200);
LIVETET_BENCHMARK(frame<SolverKind::multigrid, CoarseOperator::rediscretised>)->Iterations(40);
LIVETET_BENCHMARK(frame<SolverKind::multigrid, CoarseOperator::galerkin>)->Iterations(20);
LIVETET_BENCHMARK(frame<SolverKind::gamg, CoarseOperator::galerkin>)->Iterations(5);

}  // namespace
}  // namespace livetet

int main(int argc, char** argv) {
    livetet::PetscSession session("bench_kernels", {});
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
