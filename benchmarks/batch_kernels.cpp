// The batch kernels in double and float beside the scalar ones, on blocks of about 60,000 and
// 370,000 tets, one core: milliseconds, tets/s, GB/s that must move (each array once; what is added
// to, twice), and that as a part of what this core reads from memory (of_read) and moves in a triad
// (of_triad), measured at the start. The small block's float data fit in a cache of 8 MB.
//     build/benchmarks/bench_batch_kernels --benchmark_repetitions=7
//     --benchmark_report_aggregates_only=true

#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <numeric>
#include <optional>

#include "base/stopwatch.hpp"
#include "mechanics/batch_law.hpp"
#include "mechanics/materials/registry.hpp"
#include "mechanics/rotation.hpp"
#include "mesh/quadratic.hpp"
#include "support/hex_grids.hpp"
#include "support/p1_kernels.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using namespace test;

using Nodal = Eigen::Matrix<double, 3, 4>;

/// A mesh bent by up to a quarter turn, with the pattern of its operator in blocks.
struct Setting {
    TetMesh mesh;
    std::vector<TetElement> elements;
    std::vector<double> u;
    BlockPattern pattern{mesh.tets, mesh.nodes.size()};

    explicit Setting(std::array<int, 3> cells) : mesh(test::block(cells, {0.16, 0.09, 0.09})) {
        for (const Vector3& x : mesh.nodes)
            for (const double component : {0.1 * x.y() * x.z(), -x.y() * x.x(), 5 * x.x() * x.x()})
                u.push_back(component);
        for (const Tet& t : mesh.tets)
            elements.push_back(make_element(
                {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]}, 9000,
                1000));
    }
};

const Setting& setting(std::int64_t size) {
    static const Setting small({32, 18, 18}), large({52, 34, 35});
    return size == 0 ? small : large;
}

/// Bytes a second of `pass`, the median of eleven.
template <class Pass>
double bandwidth(double bytes, Pass&& pass) {
    std::vector<double> seconds(11);
    for (double& s : seconds) {
        const auto begin = std::chrono::steady_clock::now();
        pass();
        s = seconds_since(begin);
    }
    std::nth_element(seconds.begin(), seconds.begin() + 5, seconds.end());
    return bytes / seconds[5];
}

struct Bandwidths {
    double read, triad;
};

const Bandwidths& bandwidths() {
    static const Bandwidths measured = [] {
        Eigen::VectorXd a = Eigen::VectorXd::Ones(16 << 20), b = a, c = a;
        const double n = 8.0 * static_cast<double>(a.size());
        double sum = 0;
        const double read = bandwidth(n, [&] { benchmark::DoNotOptimize(sum += a.sum()); });
        const double triad = bandwidth(3 * n, [&] { a = b + 3.0 * c, benchmark::ClobberMemory(); });
        return Bandwidths{read, triad};
    }();
    return measured;
}

void report(benchmark::State& state, double bytes, double tets) {
    using benchmark::Counter;
    const auto a_second = [](double x) { return Counter(x, Counter::kIsIterationInvariantRate); };
    state.counters["tets/s"] = a_second(tets);
    state.counters["GB/s"] = a_second(bytes / 1e9);
    state.counters["of_read"] = a_second(bytes / bandwidths().read);
    state.counters["of_triad"] = a_second(bytes / bandwidths().triad);
}

void report(benchmark::State& state, double bytes) {
    report(state, bytes, static_cast<double>(setting(state.range(0)).elements.size()));
}

template <class T>
double bytes_of(const std::vector<T>& v) {
    return static_cast<double>(v.size() * sizeof(T));
}

void memory_bandwidth(benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(bandwidths());
    state.counters["read GB/s"] = bandwidths().read / 1e9;
    state.counters["triad GB/s"] = bandwidths().triad / 1e9;
}

/// The scalar way: an array of elements, one after the other, as LevelAssembler has it.
struct Scalar {
    const Setting& s;
    std::vector<Eigen::Matrix3d> rotations{s.elements.size()};
    std::vector<double> f = std::vector<double>(s.u.size()),
                        values = std::vector<double>(9 * s.pattern.size(0));
    double read_bytes = bytes_of(s.elements) + bytes_of(s.mesh.tets) + bytes_of(s.u);

    Eigen::Matrix3d gradient(std::size_t e) const {
        Nodal u;
        for (int i = 0; i < 4; ++i)
            u.col(i) = Eigen::Map<const Eigen::Vector3d>(&s.u[3 * s.mesh.tets[e][i]]);
        return gradient_of(s.elements[e], u);
    }
    void update() {
        for (std::size_t e = 0; e < s.elements.size(); ++e)
            rotations[e] = rotation_of(Eigen::Matrix3d::Identity() + gradient(e));
    }
    void scatter(std::size_t e, const Eigen::Matrix3d& P) {
        const Nodal forces = nodal_forces(s.elements[e], P);
        for (int i = 0; i < 4; ++i)
            Eigen::Map<Eigen::Vector3d>(&f[3 * s.mesh.tets[e][i]]) += forces.col(i);
    }
};

void rotations_scalar(benchmark::State& state) {
    Scalar k{setting(state.range(0))};
    for (auto _ : state) k.update();
    report(state, k.read_bytes + bytes_of(k.rotations));
}

void forces_scalar(benchmark::State& state) {
    Scalar k{setting(state.range(0))};
    k.update();
    for (auto _ : state)
        for (std::size_t e = 0; e < k.s.elements.size(); ++e)
            k.scatter(e, first_piola(k.s.elements[e], k.rotations[e],
                                     Eigen::Matrix3d::Identity() + k.gradient(e)));
    report(state, k.read_bytes + bytes_of(k.rotations) + 2 * bytes_of(k.f));
}

void stiffness_times_scalar(benchmark::State& state) {
    Scalar k{setting(state.range(0))};
    k.update();
    for (auto _ : state)
        for (std::size_t e = 0; e < k.s.elements.size(); ++e)
            k.scatter(e, 0.5 * stress_increment(k.s.elements[e], k.rotations[e], k.gradient(e)));
    report(state, k.read_bytes + bytes_of(k.rotations) + 2 * bytes_of(k.f));
}

void assemble_scalar(benchmark::State& state) {
    Scalar k{setting(state.range(0))};
    k.update();
    for (auto _ : state)
        for (std::size_t e = 0; e < k.s.elements.size(); ++e) {
            const Nodal h = k.rotations[e] * k.s.elements[e].gradients;
            const Tet& t = k.s.mesh.tets[e];
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j)
                    Eigen::Map<Eigen::Matrix3d>(
                        &k.values[9 * static_cast<std::size_t>(
                                          k.s.pattern.place(e, i, j, t[i], t[j]))]) +=
                        stiffness_block(k.s.elements[e], h.col(i), h.col(j));
        }
    report(state, bytes_of(k.s.elements) + bytes_of(k.rotations) + k.s.pattern.bytes() +
                      2 * bytes_of(k.values));
}

/// As kernels of floats read.
template <class Real>
std::vector<Real> with_one_behind(const std::vector<double>& values) {
    std::vector<Real> all(values.begin(), values.end());
    all.push_back(0);
    return all;
}

template <class Real>
struct Batched {
    const Setting& s;
    TetBatches<Real> batches{[this](std::size_t e) { return s.elements[e]; }, s.mesh.tets};
    std::vector<RotationBatch<Real>> rotations = batches.make_rotations();
    std::vector<Real> u = with_one_behind<Real>(s.u), f = std::vector<Real>(u.size());
    std::vector<Real> values = std::vector<Real>(9 * s.pattern.size(0));
    double batch_bytes = static_cast<double>(batches.all().end * sizeof(TetBatch<Real>));

    void update() { update_rotations<Real>(batches, batches.all(), u, rotations); }
};

template <class Real>
void rotations_batched(benchmark::State& state) {
    Batched<Real> k{setting(state.range(0))};
    for (auto _ : state) k.update();
    report(state, k.batch_bytes + bytes_of(k.u) + bytes_of(k.rotations));
}

template <class Real>
void forces_batched(benchmark::State& state) {
    Batched<Real> k{setting(state.range(0))};
    k.update();
    for (auto _ : state) add_forces<Real>(k.batches, k.batches.all(), k.rotations, k.u, k.f);
    report(state, k.batch_bytes + bytes_of(k.u) + bytes_of(k.rotations) + 2 * bytes_of(k.f));
}

/// Both, one after the other for each piece of so many batches, while these are in the cache; 0:
/// for all batches.
template <std::size_t piece>
void rotations_then_forces(benchmark::State& state) {
    Batched<float> k{setting(state.range(0))};
    const std::size_t all = k.batches.all().end;
    for (auto _ : state)
        for (std::size_t begin = 0; begin < all;) {
            const BatchRange range{begin, piece == 0 ? all : std::min(all, begin + piece)};
            update_rotations<float>(k.batches, range, k.u, k.rotations);
            add_forces<float>(k.batches, range, k.rotations, k.u, k.f);
            begin = range.end;
        }
    report(state, k.batch_bytes + bytes_of(k.u) + bytes_of(k.rotations) + 2 * bytes_of(k.f));
}

template <class Real>
void stiffness_times_batched(benchmark::State& state) {
    Batched<Real> k{setting(state.range(0))};
    k.update();
    for (auto _ : state)
        add_stiffness_times<Real>(0.5, k.batches, k.batches.all(), k.rotations, k.u, k.f);
    report(state, k.batch_bytes + bytes_of(k.u) + bytes_of(k.rotations) + 2 * bytes_of(k.f));
}

template <class Real>
void assemble_batched(benchmark::State& state) {
    Batched<Real> k{setting(state.range(0))};
    k.update();
    for (auto _ : state)
        assemble<Real>(k.batches, k.batches.all(), k.rotations, 1, k.s.pattern, k.values);
    report(state,
           k.batch_bytes + bytes_of(k.rotations) + k.s.pattern.bytes() + 2 * bytes_of(k.values));
}

enum class Law { hooke, neohookean, hooke_at_points, hooke_anywhere, neohookean_anywhere };

constexpr bool is_neohookean(Law law) {
    return law == Law::neohookean || law == Law::neohookean_anywhere;
}
constexpr bool is_anywhere(Law law) {
    return law == Law::hooke_anywhere || law == Law::neohookean_anywhere;
}

/// Turns a grid, and numbers its nodes along y first, so that no cells are in a row of numbers.
void put_anywhere(TetMesh& grid) {
    std::vector<std::int32_t> order(grid.nodes.size()), number(order.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
        const auto of = [&](std::int32_t n) {
            return std::pair(std::lround(1e6 * grid.nodes[n].z()),
                             std::lround(1e6 * grid.nodes[n].x()));
        };
        return of(a) < of(b);
    });
    const Eigen::AngleAxisd turn(0.8, Vector3(1, -2, 0.5).normalized());
    std::vector<Vector3> nodes;
    for (std::size_t k = 0; k < order.size(); ++k) {
        number[order[k]] = static_cast<std::int32_t>(k);
        nodes.push_back(turn * grid.nodes[order[k]]);
    }
    grid.nodes = std::move(nodes);
    for (Hexahedron& cell : grid.hexahedra)
        for (std::int32_t& n : cell) n = number[n];
}

template <int nodes>
TetMesh mesh_of(const std::array<int, 3>& cells) {
    const Vector3 size(0.16, 0.09, 0.09);
    if (nodes == 8) return test::hex_grid(cells, size);
    if (nodes == 4) return test::block(cells, size);
    return quadratic_mesh(test::block({cells[0] / 2, cells[1] / 2, cells[2] / 2}, size));
}

/// Tets of `nodes` nodes, or hexahedra, with laws written for lanes, in float. Of ten nodes: about
/// 8,000 and 48,000 tets, as many nodes as the blocks above have; 10,000 and 62,000 hexahedra.
/// Law::hooke_at_points has a rotation for each point, for which boxes have no kernel of their own;
/// those `anywhere` have hexahedra that are not in rows, nor along the body's axes.
template <int nodes, Law chosen>
struct WithLaw {
    TetMesh mesh;
    std::vector<TetElement> elements;
    std::vector<std::array<std::int32_t, nodes>> tets;
    std::vector<float> u, f;
    std::vector<RotationBatch<float>> rotations;
    std::optional<TetBatches<float, nodes>> batches;

    explicit WithLaw(std::int64_t size) {
        const std::array<int, 3> cells =
            size == 0 ? std::array{32, 18, 18} : std::array{52, 34, 35};
        mesh = mesh_of<nodes>(cells);
        if (is_anywhere(chosen)) put_anywhere(mesh);
        std::vector<double> bent;  // by moderate strains
        for (const Vector3& x : mesh.nodes)
            for (const double component : {0.1 * x.y() * x.z(), -x.y() * x.x(), x.x() * x.x()})
                bent.push_back(component);
        const std::size_t count = nodes == 8 ? mesh.hexahedra.size() : mesh.tets.size();
        for (std::size_t e = 0; e < count; ++e) add(e);
        u = with_one_behind<float>(bent);
        f.resize(u.size());
        batches.emplace([this](std::size_t e) { return elements[e]; }, tets);
        rotations.resize(batches->all().end *
                         (chosen == Law::hooke_at_points ? batches->points : 1));
        update_rotations(*batches, batches->all(), std::span<const float>(u), std::span(rotations));
    }
    void add(std::size_t e) {
        Tet t;
        std::array<std::int32_t, nodes>& of_element = tets.emplace_back();
        if constexpr (nodes == 8) {
            of_element = mesh.hexahedra[e];
            t = {of_element[0], of_element[1], of_element[2], of_element[4]};
        } else {
            t = mesh.tets[e];
            std::copy_n(t.begin(), 4, of_element.begin());
            for (int i = 4; i < nodes; ++i) of_element[i] = mesh.edge_nodes[e][i - 4];
        }
        elements.push_back(make_element(
            {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]}, 9000, 1000));
        if (nodes == 8) elements.back().volume *= 6;  // of the corner tet
    }
    static const BatchLaw& law() {
        return is_neohookean(chosen) ? *registered_material("neohookean").batch_law() : hooke_law();
    }
    void report(benchmark::State& state) const {
        const double bytes =
            static_cast<double>(batches->all().end * sizeof(TetBatch<float, nodes>)) + bytes_of(u) +
            2 * bytes_of(f) + (is_neohookean(chosen) ? 0 : bytes_of(rotations));
        livetet::report(state, bytes, static_cast<double>(tets.size()));
    }
};

template <int nodes, Law law>
void law_forces(benchmark::State& state) {
    WithLaw<nodes, law> k(state.range(0));
    for (auto _ : state) k.law().add_forces(*k.batches, k.batches->all(), k.rotations, k.u, k.f);
    k.report(state);
}

template <int nodes, Law law>
void law_products(benchmark::State& state) {
    WithLaw<nodes, law> k(state.range(0));
    for (auto _ : state)
        k.law().add_stiffness_times(0.5, *k.batches, k.batches->all(), k.rotations, k.u, k.u, k.f);
    k.report(state);
}

#define LIVETET_BENCHMARK(name)                                                                  \
    BENCHMARK(name##_scalar)->Unit(benchmark::kMillisecond)->DenseRange(0, 1);                   \
    BENCHMARK_TEMPLATE(name##_batched, double)->Unit(benchmark::kMillisecond)->DenseRange(0, 1); \
    BENCHMARK_TEMPLATE(name##_batched, float)->Unit(benchmark::kMillisecond)->DenseRange(0, 1)
BENCHMARK(memory_bandwidth);
LIVETET_BENCHMARK(rotations);
LIVETET_BENCHMARK(forces);
BENCHMARK_TEMPLATE(rotations_then_forces, 0)->Unit(benchmark::kMillisecond)->DenseRange(0, 1);
BENCHMARK_TEMPLATE(rotations_then_forces, 32)->Unit(benchmark::kMillisecond)->DenseRange(0, 1);
LIVETET_BENCHMARK(stiffness_times);
LIVETET_BENCHMARK(assemble);
#define LIVETET_LAW(kernel, nodes, law) \
    BENCHMARK_TEMPLATE(kernel, nodes, law)->Unit(benchmark::kMillisecond)->DenseRange(0, 1)
#define LIVETET_LAWS(kernel)                      \
    LIVETET_LAW(kernel, 4, Law::hooke);           \
    LIVETET_LAW(kernel, 4, Law::neohookean);      \
    LIVETET_LAW(kernel, 10, Law::hooke);          \
    LIVETET_LAW(kernel, 10, Law::neohookean);     \
    LIVETET_LAW(kernel, 8, Law::hooke);           \
    LIVETET_LAW(kernel, 8, Law::hooke_at_points); \
    LIVETET_LAW(kernel, 8, Law::neohookean);      \
    LIVETET_LAW(kernel, 8, Law::hooke_anywhere);  \
    LIVETET_LAW(kernel, 8, Law::neohookean_anywhere)
LIVETET_LAWS(law_forces);
LIVETET_LAWS(law_products);

}  // namespace
}  // namespace livetet

BENCHMARK_MAIN();
