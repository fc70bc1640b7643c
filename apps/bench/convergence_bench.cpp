#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/bench/beam_mesh.hpp"
#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/solve_run.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "base/work_folder.hpp"
#include "io/hierarchy_file.hpp"
#include "mesh/refine.hpp"
#ifdef LIVETET_IMAGES
#include "apps/bench/convergence_bodies.hpp"
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct ConvergenceArguments {
    double min_nodes = 1050, max_nodes = 1.1e6;  ///< range of mesh sizes
    double nodes = 1e4;  ///< size of the mesh on which everything else is varied
    std::string only;    ///< part of the name "VARIED, METHOD", such as "nodes, multigrid"
    std::filesystem::path csv, json, figure, folder;
};

constexpr double tolerance = 1e-8;
constexpr int max_iterations = 2000;
constexpr double max_meshed_nodes = 5e5;  ///< above this size the finest mesh is refined from the
                                          ///< next: Gmsh takes minutes for a million nodes

struct SolveMethod {
    std::string name, solver;
    double max_nodes;        ///< left out above this size, where it takes minutes
    bool one_level = false;  ///< of bodies: solved without their coarse levels
};

const std::vector<SolveMethod>& methods() {
    static const std::vector<SolveMethod> all{
        {"multigrid", "kind: multigrid, coarse: rediscretised", 1e9},
        {"multigrid, Galerkin", "kind: multigrid, coarse: galerkin", 5e5},
        {"multigrid, nested", "kind: multigrid, coarse: rediscretised", 1e9},
        {"BoomerAMG", "kind: boomeramg", 2.5e5},
        {"GAMG", "kind: gamg", 2.5e5},
        {"ICC", "kind: petsc, petsc_options: -ksp_type cg -pc_type icc", 2.5e5},
        {"Jacobi", "kind: petsc, petsc_options: -ksp_type cg -pc_type jacobi", 5e4},
    };
    return all;
}

constexpr const char *with_levels = "automatic", *on_one_level = "automatic, one level";

#ifdef LIVETET_IMAGES
/// Those that solve bodies.
const std::vector<SolveMethod>& body_methods() {
    static const std::vector<SolveMethod> all{
        methods()[0],
        methods()[1],
        {with_levels, "kind: automatic", 1e9},
        {"BoomerAMG", "kind: boomeramg", 1e9, true},
        {"GAMG", "kind: gamg", 1e9, true},
        {"direct", "kind: direct", 1e9, true},
        {on_one_level, "kind: automatic", 1e9, true},
    };
    return all;
}
#endif

/// Parameters of a beam, or a body of `convergence_bodies`.
struct Setting {
    std::string against;  ///< what is varied: "nodes", "nu", ..., "body"
    double value = 0;
    std::string body{};  ///< in place of the value where bodies are varied
    double edge_m = 0.0054;
    int refine = 0;  ///< number of uniform refinements of a mesh that is coarser by as much
    double poisson = 0.45;
    double contrast = 1;  ///< of Young's modulus, upper half to lower half
    double stretch = 1;   ///< scaling of the mesh along z
    int levels = 0;       ///< 0: all
    int smoothing = 0;    ///< 0: default of the solver
};

std::string value_text(const Setting& s) {
    return s.body.empty() ? fmt::format("{}", s.value) : s.body;
}

std::string name_of(const Setting& s, const SolveMethod& m) {
    return s.against + (s.body.empty() ? "" : " " + s.body) + ", " + m.name;
}

struct Point {
    Setting setting;
    std::string method;
    std::string failure;
    double nodes = 0, iterations = 0, seconds = 0;

    double factor() const { return std::pow(tolerance, 1 / std::max(1.0, iterations)); }
};

/// Solves scenes of settings.
class Scenes {
  public:
    /// `nodes`: about those of bodies that are not beams.
    Scenes(const WorkFolder& folder, double nodes) : folder_(folder), nodes_(nodes) {}

    Point solve(const Setting& s, const SolveMethod& method) {
        Point point{s, method.name, "", 0, 0, 0};
        try {
            const fs::path scene = folder_ / fmt::format("{}.yaml", ++count_);
            write_text_file(
                scene, fmt::format("{}strain: linear\nformulation: displacement\n"
                                   "solver: {{{}, smoothing_steps: {}, relative_tolerance: {}, "
                                   "max_iterations: {}, newton_tolerance: 0.5, max_newton: 1}}\n"
                                   "output: {{file: result.h5}}\n",
                                   s.body.empty() ? beam(s) : body(s, method), method.solver,
                                   s.smoothing, tolerance, max_iterations));
            const SolveRun run = run_solve(method.name, "", 1, scene);
            point.nodes = run.unknowns / 3;
            point.iterations = run.iterations_a_solve();
            point.seconds = run.assembly_s + run.preconditioner_s + run.linear_s;
            if (point.iterations >= max_iterations)
                point.failure = fmt::format("not in {} iterations", max_iterations);
            else if (!run.converged)
                point.failure = "did not converge";
        } catch (const Error& error) {
            point.failure = error.what();
        }
        return point;
    }

  private:
    /// Lines of a scene: a beam, clamped and pressed.
    std::string beam(const Setting& s) {
        const double top = 1e3 * 0.1 * s.stretch;
        return fmt::format(
            "mesh: {{file: {}, refine: {}}}\n"
            "materials: [{{region: 1, young_Pa: 5000, poisson: {}}}, {{region: 2, young_Pa: {}, "
            "poisson: {}}}]\n"
            "fix: [{{half_space_mm: [0.001, 0, 0, 1, 0, 0]}}]\n"
            "drive: [{{box_mm: [83.5, 33.5, {}, 116.5, 66.5, {}], displacement_mm: [0, 0, -1]}}]\n",
            mesh_of(s), s.refine, s.poisson, 5000 * s.contrast, s.poisson, top - 0.001,
            top + 0.001);
    }

    /// Lines of a scene: a body with its boundary conditions, of as many levels as the method uses.
    std::string body([[maybe_unused]] const Setting& s, [[maybe_unused]] const SolveMethod& m) {
#ifdef LIVETET_IMAGES
        const auto& all = convergence_bodies();
        const auto& body = *std::find_if(all.begin(), all.end(),
                                         [&](const auto& one) { return one.name == s.body; });
        std::string name = s.body;
        std::replace(name.begin(), name.end(), ' ', '_');
        const std::string finest = name + "_finest.h5";
        name += ".h5";
        if (!fs::exists(folder_ / finest)) {
            MeshHierarchy hierarchy = mesh_body(body, nodes_);
            write_hierarchy(folder_ / name, hierarchy);
            hierarchy.levels.resize(1);
            write_hierarchy(folder_ / finest, make_hierarchy(std::move(hierarchy.levels), s.body));
        }
        return fmt::format("mesh: {{file: {}}}\nmaterials: [{{young_Pa: 5000, poisson: {}}}]\n{}",
                           m.one_level ? finest : name, s.poisson, body.boundary);
#else
        return {};
#endif
    }

    std::string mesh_of(const Setting& s) {
        const std::string name = fmt::format("{:.6f}_{}_{}.h5", s.edge_m, s.stretch, s.levels);
        if (fs::exists(folder_ / name)) return name;
        MeshHierarchy hierarchy = mesh_beam(s.edge_m, {});
        if (s.levels > 0 && hierarchy.levels.size() > static_cast<std::size_t>(s.levels))
            hierarchy.levels.resize(s.levels);
        for (TetMesh& level : hierarchy.levels) {
            for (const Tet& t : level.tets) {
                double z = 0;
                for (const std::int32_t n : t) z += level.nodes[n].z() / 4;
                level.regions.push_back(z < 0.05 ? 1 : 2);
            }
            for (Vector3& x : level.nodes) x.z() *= s.stretch;
        }
        write_hierarchy(folder_ / name, make_hierarchy(std::move(hierarchy.levels), "beam"));
        return name;
    }

    const WorkFolder& folder_;
    double nodes_;
    int count_ = 0;
};

/// Edge length of a beam's mesh with about this number of nodes; the power is fitted to meshes from
/// 10^3 to 10^6 nodes.
double edge_for(double nodes) {
    return std::cbrt(4.955 * 0.002 / (5.75 * nodes)) /
           std::cbrt(0.877 * std::pow(nodes / 1000, 0.062));
}

void print(const std::vector<Point>& points) {
    fmt::print("\n{:<12} {:>15} {:<22} {:>9} {:>4} {:>11} {:>7} {:>9}\n", "against", "",
               "preconditioner", "nodes", "cut", "iterations", "factor", "seconds");
    for (const Point& p : points) {
        fmt::print("{:<12} {:>15} {:<22} ", p.setting.against, value_text(p.setting), p.method);
        if (p.failure.empty())
            fmt::print("{:>9.0f} {:>4} {:>11.0f} {:>7.3f} {:>9.2f}\n", p.nodes, p.setting.refine,
                       p.iterations, p.factor(), p.seconds);
        else
            fmt::print("{}\n", p.failure);
    }
}

std::string csv_text(const std::vector<Point>& points) {
    std::string text = "against,value,preconditioner,nodes,cut,iterations,factor,seconds,failure\n";
    for (const Point& p : points)
        text += fmt::format("{},{},\"{}\",{},{},{},{:.4f},{:.4f},\"{}\"\n", p.setting.against,
                            value_text(p.setting), p.method, p.nodes, p.setting.refine,
                            p.iterations, p.factor(), p.seconds, p.failure);
    return text;
}

json json_of(const std::vector<Point>& points) {
    json list = json::array();
    for (const Point& p : points)
        list.push_back(
            {{"against", p.setting.against},
             {"value", p.setting.body.empty() ? json(p.setting.value) : json(p.setting.body)},
             {"preconditioner", p.method},
             {"nodes", p.nodes},
             {"cut", p.setting.refine},
             {"iterations", p.iterations},
             {"factor", p.factor()},
             {"seconds", p.seconds},
             {"failure", p.failure}});
    return list;
}

#ifdef LIVETET_IMAGES
void draw(const fs::path& path, const std::vector<Point>& points) {
    WorkPrecisionChart iterations{"Iterations to 1e-8", "iterations", {}, "nodes"},
        seconds{"Time to 1e-8", "seconds, operator and solve", {}, "nodes"};
    for (const SolveMethod& m : methods()) {
        WorkPrecisionLine of_iterations{m.name, {}, {}}, of_seconds{m.name, {}, {}};
        for (const Point& p : points) {
            if (p.setting.against != "nodes" || p.method != m.name || !p.failure.empty()) continue;
            for (WorkPrecisionLine* line : {&of_iterations, &of_seconds})
                line->seconds.push_back(p.nodes);
            of_iterations.error.push_back(p.iterations);
            of_seconds.error.push_back(p.seconds);
        }
        if (of_iterations.error.empty()) continue;
        iterations.lines.push_back(of_iterations);
        seconds.lines.push_back(of_seconds);
    }
    const WorkPrecisionChart charts[] = {iterations, seconds};
    write_work_precision_picture(path, charts);
}
#endif

using Solve = std::pair<Setting, SolveMethod>;

/// Meshes of rising size, solved by every method that is quick enough on them.
void add_sizes(const ConvergenceArguments& a, std::vector<Solve>& all) {
    for (double nodes = a.min_nodes; nodes < 1.01 * a.max_nodes; nodes *= std::sqrt(10)) {
        for (const SolveMethod& m : methods()) {
            if (nodes > m.max_nodes) continue;
            const int cuts = m.name.ends_with("nested") ? (nodes > 3e4 ? 2 : 1)
                             : nodes > max_meshed_nodes ? 1
                                                        : 0;
            all.emplace_back(Setting{.against = "nodes",
                                     .value = std::round(nodes),
                                     .edge_m = std::pow(2, cuts) * edge_for(nodes),
                                     .refine = cuts},
                             m);
        }
    }
}

/// The solves selected by `--only`. Throws Error if there are none, or none for `--figure`.
std::vector<Solve> chosen_solves(const ConvergenceArguments& a) {
    std::vector<Solve> all;
    add_sizes(a, all);
    const auto vary = [&](const std::string& against, std::initializer_list<double> values,
                          std::initializer_list<std::size_t> of_methods, auto&& set) {
        for (const double value : values)
            for (const std::size_t m : of_methods) {
                Setting s{.against = against, .value = value, .edge_m = edge_for(a.nodes)};
                set(s, value);
                all.emplace_back(s, methods()[m]);
            }
    };
    const std::initializer_list<std::size_t> multilevel{0, 1, 3, 4}, ours{0, 1};
    vary("nu", {0, 0.3, 0.45, 0.49, 0.499}, multilevel,
         [](Setting& s, double v) { s.poisson = v; });
    vary("contrast", {1, 1e2, 1e4, 1e6}, multilevel, [](Setting& s, double v) { s.contrast = v; });
    vary("anisotropy", {1, 0.3, 0.1, 0.03}, multilevel,
         [](Setting& s, double v) { s.stretch = v; });
    vary("levels", {2, 3, 4}, ours, [](Setting& s, double v) { s.levels = static_cast<int>(v); });
    vary("smoothing", {1, 2, 4, 6, 8}, ours,
         [](Setting& s, double v) { s.smoothing = static_cast<int>(v); });
#ifdef LIVETET_IMAGES
    for (const ConvergenceBody& body : convergence_bodies())
        for (const SolveMethod& m : body_methods())
            all.emplace_back(Setting{.against = "body", .body = body.name}, m);
#endif
    std::erase_if(all, [&](const Solve& solve) {
        return name_of(solve.first, solve.second).find(a.only) == std::string::npos;
    });
    if (all.empty()) fail("--only {}: no solve has this in its name", a.only);
    if (!a.figure.empty() && std::none_of(all.begin(), all.end(), [](const Solve& solve) {
            return solve.first.against == "nodes";
        }))
        fail("--only {}: leaves nothing for --figure, which shows solves against nodes", a.only);
    return all;
}

/// Prints how multigrid's iterations grow from 10^4 nodes on. True if by at most a fifth.
bool judge_growth(const std::vector<Point>& points) {
    double at_ten_thousand = 0, most = 0;
    for (const Point& p : points)
        if (p.setting.against == "nodes" && p.method == methods().front().name &&
            p.setting.value > 9e3) {
            if (at_ten_thousand == 0) at_ten_thousand = p.iterations;
            most = std::max(most, p.failure.empty() ? p.iterations : 1e9);
        }
    const bool holds = most <= 1.2 * at_ten_thousand;
    if (at_ten_thousand > 0)
        fmt::print(
            "\nmultigrid's iterations: {} at 10^4 nodes, at most {} on larger meshes: grow by "
            "{:.0f} %, target at most 20: {}\n",
            at_ten_thousand, most, 100 * (most / at_ten_thousand - 1), holds ? "holds" : "MISSED");
    else
        fmt::print("\nmultigrid's growth is judged from 10^4 nodes on; no mesh is that large\n");
    return holds;
}

/// Prints how good `automatic` is on bodies. True if it takes at most 40 iterations on the organ
/// with levels, and on one level at most twice the time of the quickest other; times are judged
/// from 5000 nodes on.
bool judge_bodies(const std::vector<Point>& points) {
    constexpr double max_iterations_on_organ = 40, max_ratio = 2, min_nodes = 5000;
    bool all_hold = true;
    for (const Point& automatic : points) {
        const std::string& body = automatic.setting.body;
        if (automatic.method == with_levels && body == "organ") {
            const bool holds =
                automatic.failure.empty() && automatic.iterations <= max_iterations_on_organ;
            fmt::print("automatic with levels on the organ: {} iterations, target at most {}: {}\n",
                       automatic.iterations, max_iterations_on_organ, holds ? "holds" : "MISSED");
            all_hold = all_hold && holds;
        }
        if (automatic.method != on_one_level) continue;
        const Point* quickest = nullptr;
        for (const Point& p : points)
            if (p.setting.body == body && p.failure.empty() &&
                (p.method == "BoomerAMG" || p.method == "GAMG" || p.method == "direct") &&
                (!quickest || p.seconds < quickest->seconds))
                quickest = &p;
        if (!quickest) continue;
        const double ratio =
            automatic.failure.empty() ? automatic.seconds / quickest->seconds : INFINITY;
        const bool holds = ratio <= max_ratio, judged = quickest->nodes >= min_nodes;
        fmt::print("automatic on one level, {}: {:.2f} times {}, target at most {}: {}\n", body,
                   ratio, quickest->method, max_ratio,
                   !judged ? "too small to judge"
                   : holds ? "holds"
                           : "MISSED");
        all_hold = all_hold && (holds || !judged);
    }
    return all_hold;
}

/// Iterations and time of one linear solve to 1e-8 of a clamped and pressed beam, by each
/// preconditioner, against mesh size, Poisson's ratio, contrast, anisotropy, levels and smoothing
/// steps; and of bodies that are not blocks. Returns 1 if multigrid's iterations grow by more than
/// a fifth from 10^4 nodes on, or if `judge_bodies` is false.
int bench_convergence(const ConvergenceArguments& a) {
    const WorkFolder folder(a.folder);
    Scenes scenes(folder, a.nodes);
    const std::vector<Solve> all = chosen_solves(a);
    std::vector<Point> points;
    {
        ProgressLine progress("convergence");
        for (std::size_t k = 0; k < all.size(); ++k) {
            const auto& [setting, method] = all[k];
            progress.update(
                static_cast<double>(k) / static_cast<double>(all.size()),
                fmt::format("{} {}, {}", setting.against, value_text(setting), method.name));
            points.push_back(scenes.solve(setting, method));
        }
    }
    print(points);
    fmt::print(
        "\ncut: number of uniform refinements that made the finest mesh; the levels below are each "
        "meshed on their own (above {:.0e} nodes\n"
        "Gmsh takes minutes); BoomerAMG, GAMG, ICC, Jacobi and Galerkin stop where they would take "
        "minutes\n",
        max_meshed_nodes);
    const bool grows_little = judge_growth(points), bodies_hold = judge_bodies(points);
    if (!a.csv.empty()) write_text_file(a.csv, csv_text(points));
    if (!a.json.empty()) write_text_file(a.json, json_of(points).dump(2) + "\n");
#ifdef LIVETET_IMAGES
    if (!a.figure.empty()) draw(a.figure, points);
#endif
    return grows_little && bodies_hold ? 0 : 1;
}

}  // namespace

void add_convergence_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "convergence",
        "Iterations and time to 1e-8 of each preconditioner against mesh size, Poisson's ratio, "
        "contrast, anisotropy, levels and smoothing steps, and on bodies that are not blocks; exit "
        "status 1 if multigrid's iterations grow by more than a fifth, or if `automatic` takes "
        "more than 40 on the organ or, on one level, twice the quickest other's time");
    auto a = std::make_shared<ConvergenceArguments>();
    command->add_option("--min-nodes", a->min_nodes, "nodes of the smallest mesh")
        ->capture_default_str()
        ->check(CLI::Range(300., 1e9));
    command->add_option("--max-nodes", a->max_nodes, "nodes of the largest mesh")
        ->capture_default_str()
        ->check(CLI::Range(1e3, 1e9));
    command
        ->add_option("--nodes", a->nodes,
                     "nodes of the mesh on which everything but mesh size is varied")
        ->capture_default_str()
        ->check(CLI::Range(300., 1e9));
    command->add_option("--only", a->only,
                        "only solves with this in their name, such as \"nodes\" or \"nu, "
                        "multigrid\"");
    command->add_option("--folder", a->folder, "keep meshes, scenes and logs here");
    command->add_option("--csv", a->csv, "write all figures to this file");
    command->add_option("--json", a->json, "the same as JSON");
    add_figure_option(*command, "--figure", a->figure,
                      "draw iterations and time against mesh size to this PNG");
    command->callback([a, &status] {
        check_output_files({a->csv, a->json});
        check_figures({a->figure});
        status = bench_convergence(*a);
    });
}

}  // namespace livetet
