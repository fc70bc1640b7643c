#include "apps/bench/solve_run.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/child_process.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/run_program.hpp"

namespace livetet {

using nlohmann::json;

namespace {

/// What `livetet solve` runs: the program without images, where it is, which takes 40 MB less than
/// this one.
std::filesystem::path solving_program() {
    const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe"),
                                lean = own.parent_path() / "livetet-lean";
    return std::filesystem::exists(lean) ? lean : own;
}

}  // namespace

SolveRun run_solve(const std::string& name, const std::string& launcher, int ranks,
                   const std::filesystem::path& scene, std::optional<double> time_limit_s) {
    std::filesystem::path figures = scene, log = scene;
    figures.replace_extension(fmt::format("{}.json", ranks));
    log.replace_extension(fmt::format("{}.log", ranks));
    std::filesystem::remove(figures);
    std::string start = launcher;
    const std::size_t place = start.find("{}");
    if (place != std::string::npos)
        start.replace(place, 2, fmt::format("{}", ranks));
    else if (!launcher.empty())
        fail("--launcher \"{}\": expected {{}} where the number of ranks goes", launcher);
    const std::string command =
        fmt::format("{} '{}' solve '{}' --json '{}'", start, solving_program().string(),
                    scene.string(), figures.string());
    const int status = run_program(command, log, time_limit_s);
    if (!std::filesystem::exists(figures))
        fail("{}: `livetet solve` ended with status {}: {}", scene.string(), status,
             last_error_lines(read_text_file(log)));
    const json j = json::parse(read_text_file(figures));
    SolveRun run{.name = name,
                 .solver = j.at("solver"),
                 .ranks = j.at("ranks"),
                 .converged = j.at("converged")};
    run.unknowns = 3 * j.at("nodes").get<double>();
    run.mesh_s = j.at("mesh_s");
    run.partition_s = j.at("partition_s");
    run.setup_s = j.at("setup_s").get<double>() - run.partition_s;
    run.forces_s = j.at("forces_s");
    run.assembly_s = j.at("assembly_s");
    run.preconditioner_s = j.at("preconditioner_s");
    run.linear_s = j.at("linear_s");
    run.output_s = j.at("output_s");
    run.steps = static_cast<int>(j.at("steps").size());
    run.newton_iterations = j.at("linearisations");
    run.iterations = j.at("iterations");
    run.largest_mm = j.at("largest_displacement_mm");
    run.peak_bytes = j.at("peak_bytes");
    run.peak_bytes_most = j.at("peak_bytes_most");
    run.messages = j.at("messages");
    run.message_bytes = j.at("message_bytes");
    run.reductions = j.at("reductions");
    return run;
}

json json_of(const SolveRun& r) {
    return {{"name", r.name},
            {"solver", r.solver},
            {"ranks", r.ranks},
            {"converged", r.converged},
            {"unknowns", r.unknowns},
            {"seconds", r.solution_s()},
            {"mesh_s", r.mesh_s},
            {"partition_s", r.partition_s},
            {"setup_s", r.setup_s},
            {"forces_s", r.forces_s},
            {"assembly_s", r.assembly_s},
            {"preconditioner_s", r.preconditioner_s},
            {"linear_s", r.linear_s},
            {"output_s", r.output_s},
            {"linearisations", r.newton_iterations},
            {"iterations", r.iterations},
            {"largest_displacement_mm", r.largest_mm},
            {"peak_bytes", r.peak_bytes},
            {"peak_bytes_most", r.peak_bytes_most},
            {"messages", r.messages},
            {"message_bytes", r.message_bytes},
            {"reductions", r.reductions}};
}

}  // namespace livetet
