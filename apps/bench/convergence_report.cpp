#include "apps/bench/convergence_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

using nlohmann::json;

void print_convergence(const std::vector<ConvergencePoint>& points) {
    fmt::print("\n{:<12} {:>15} {:<22} {:>9} {:>4} {:>11} {:>7} {:>9}\n", "against", "",
               "preconditioner", "nodes", "cut", "iterations", "factor", "seconds");
    for (const ConvergencePoint& p : points) {
        fmt::print("{:<12} {:>15} {:<22} ", p.setting.against, p.setting.value_text(), p.method);
        if (p.failure.empty())
            fmt::print("{:>9.0f} {:>4} {:>11.0f} {:>7.3f} {:>9.2f}\n", p.nodes, p.setting.refine,
                       p.iterations, p.factor(), p.seconds);
        else
            fmt::print("{}\n", p.failure);
    }
}

std::string convergence_csv(const std::vector<ConvergencePoint>& points) {
    std::string text = "against,value,preconditioner,nodes,cut,iterations,factor,seconds,failure\n";
    for (const ConvergencePoint& p : points)
        text += fmt::format("{},{},\"{}\",{},{},{},{:.4f},{:.4f},\"{}\"\n", p.setting.against,
                            p.setting.value_text(), p.method, p.nodes, p.setting.refine,
                            p.iterations, p.factor(), p.seconds, p.failure);
    return text;
}

json convergence_json(const std::vector<ConvergencePoint>& points) {
    json list = json::array();
    for (const ConvergencePoint& p : points)
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
void draw_convergence(const std::filesystem::path& path,
                      const std::vector<ConvergencePoint>& points) {
    WorkPrecisionChart iterations{"Iterations to 1e-8", "iterations", {}, "nodes"},
        seconds{"Time to 1e-8", "seconds, operator and solve", {}, "nodes"};
    for (const SolveMethod& m : convergence_methods()) {
        WorkPrecisionLine of_iterations{m.name, {}, {}}, of_seconds{m.name, {}, {}};
        for (const ConvergencePoint& p : points) {
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

bool judge_growth(const std::vector<ConvergencePoint>& points) {
    double at_ten_thousand = 0, most = 0;
    for (const ConvergencePoint& p : points)
        if (p.setting.against == "nodes" && p.method == convergence_methods().front().name &&
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

bool judge_bodies(const std::vector<ConvergencePoint>& points) {
    constexpr double max_iterations_on_organ = 40, max_ratio = 2, min_nodes = 5000;
    bool all_hold = true;
    for (const ConvergencePoint& automatic : points) {
        const std::string& body = automatic.setting.body;
        if (automatic.method == automatic_with_levels && body == "organ") {
            const bool holds =
                automatic.failure.empty() && automatic.iterations <= max_iterations_on_organ;
            fmt::print("automatic with levels on the organ: {} iterations, target at most {}: {}\n",
                       automatic.iterations, max_iterations_on_organ, holds ? "holds" : "MISSED");
            all_hold = all_hold && holds;
        }
        if (automatic.method != automatic_on_one_level) continue;
        const ConvergencePoint* quickest = nullptr;
        for (const ConvergencePoint& p : points)
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

}  // namespace livetet
