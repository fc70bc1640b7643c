#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/stability_limits.hpp"
#include "apps/bench/stability_run.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "solvers/parallel/petsc_session.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

using nlohmann::json;

struct StabilityArguments {
    int cells = 4;  ///< along the height of the box
    int fine_cells = 21;
    int noise_frames = 1000000;
    double budget_ms = 10;
    std::string only, column;  ///< in the names of the cases and of the columns that are tried
    bool plain = false;        ///< whether the live columns' plain counterparts are tried, too
    std::filesystem::path csv, json, figure;
};

constexpr std::array schemes{TimeScheme::static_equilibrium, TimeScheme::implicit_euler,
                             TimeScheme::newmark, TimeScheme::generalized_alpha};
constexpr std::array scheme_names{"static", "euler", "newmark", "generalized_alpha"};
constexpr std::array way_names{"solve",
                               "track",
                               "track P2",
                               "plain",
                               "plain P2",
                               "hexahedra",
                               "hexahedra Q1-P0",
                               "track hexahedra",
                               "track hexahedra Q1-P0",
                               "plain hexahedra",
                               "plain hexahedra Q1-P0"};
constexpr std::array verdict_names{"pass", "fail", "refused", "left out"};

std::vector<StabilityColumn> columns(bool plain) {
    std::vector<StabilityColumn> all;
    std::vector<SteppedAs> ways{SteppedAs::solve,
                                SteppedAs::track,
                                SteppedAs::track_p2,
                                SteppedAs::hexahedra,
                                SteppedAs::hexahedra_mixed,
                                SteppedAs::track_hexahedra,
                                SteppedAs::track_hexahedra_mixed};
    if (plain)
        ways.insert(ways.end(), {SteppedAs::plain, SteppedAs::plain_p2, SteppedAs::plain_hexahedra,
                                 SteppedAs::plain_hexahedra_mixed});
    for (const SteppedAs way : ways)
        for (const ModelChoice& strain : ModelChoice::alternatives())
            for (const TimeScheme scheme : schemes) all.push_back({way, strain, scheme});
    return all;
}

std::string name_of(const StabilityColumn& c) {
    return fmt::format("{}, {}, {}", way_names[static_cast<int>(c.way)],
                       std::string(c.strain.name()), scheme_names[static_cast<int>(c.scheme)]);
}

std::string name_of(const StabilityCase& c) { return fmt::format("{} {}", c.group, c.value); }

struct Row {
    StabilityCase trial;
    std::vector<StabilityCell> cells;
};

char letter(const Row& row, std::size_t k, const std::vector<StabilityColumn>& all) {
    const StabilityCell& cell = row.cells[k];
    if (cell.verdict == Verdict::pass) return '.';
    if (cell.verdict == Verdict::refused) return 'r';
    if (cell.verdict == Verdict::left_out) return '-';
    return known_limit(row.trial, all[k], row.cells[k]).empty() ? 'F' : 'x';
}

void print(const std::vector<Row>& rows, const std::vector<StabilityColumn>& all) {
    // Columns of one way and strain stand together, under their names.
    std::string ways(38, ' '), models(38, ' '), letters(38, ' ');
    std::vector<std::size_t> places;
    for (std::size_t k = 0; k < all.size(); ++k) {
        const bool new_way = k == 0 || all[k].way != all[k - 1].way;
        if (new_way || all[k].strain != all[k - 1].strain) {
            const std::size_t place =
                std::max({models.size() + 1, letters.size() + 3, new_way ? ways.size() : 0}) +
                (new_way && k > 0 ? 2 : 0);
            models.append(place - models.size(), ' ').append(all[k].strain.name());
            letters.resize(place, ' ');
        }
        if (new_way)
            ways += std::string(letters.size() - ways.size(), ' ') +
                    way_names[static_cast<int>(all[k].way)];
        places.push_back(letters.size());
        letters += fmt::format("{} ", scheme_names[static_cast<int>(all[k].scheme)][0]);
    }
    fmt::print("\n{}\n{}\n{}\n", ways, models, letters);
    for (const Row& row : rows) {
        std::string line = name_of(row.trial);
        for (std::size_t k = 0; k < all.size(); ++k) {
            line.resize(places[k], ' ');
            line += letter(row, k, all);
        }
        fmt::print("{}\n", line);
    }
    fmt::print(
        "\n. passes   r refused   - left out   x fails, a known limit   F FAILS   (s static, e "
        "euler, n "
        "newmark, g generalized_alpha)\n");
    // What fails for one reason, together.
    std::map<std::string, std::vector<std::string>> by_reason;
    for (const Row& row : rows)
        for (std::size_t k = 0; k < all.size(); ++k) {
            const StabilityCell& cell = row.cells[k];
            if (cell.verdict == Verdict::pass || cell.verdict == Verdict::left_out) continue;
            const std::string known = cell.verdict == Verdict::refused
                                          ? "refused: " + cell.reason
                                          : known_limit(row.trial, all[k], row.cells[k]);
            const std::string text =
                fmt::format("{}; {}{}", name_of(row.trial), name_of(all[k]),
                            cell.verdict == Verdict::refused ? "" : ": " + cell.reason);
            by_reason[known.empty() ? "FAILS, not known to" : known].push_back(text);
        }
    for (const auto& [reason, cells] : by_reason) {
        fmt::print("\n{}\n", reason);
        for (const std::string& cell : cells) fmt::print("    {}\n", cell);
    }
}

/// The live cells that are worse than their plain counterparts: those that alone fail.
void print_worse(const std::vector<Row>& rows, const std::vector<StabilityColumn>& all) {
    int compared = 0;
    std::vector<std::string> worse;
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (!makes_frames(all[k].way) || is_plain(all[k].way)) continue;
        StabilityColumn counterpart = all[k];
        counterpart.way = has_cell_pressures(all[k].way) ? SteppedAs::plain_hexahedra_mixed
                          : is_of_hexahedra(all[k].way)  ? SteppedAs::plain_hexahedra
                          : has_ten_nodes(all[k].way)    ? SteppedAs::plain_p2
                                                         : SteppedAs::plain;
        const auto found = std::find_if(all.begin(), all.end(), [&](const StabilityColumn& c) {
            return name_of(c) == name_of(counterpart);
        });
        if (found == all.end()) continue;
        for (const Row& row : rows) {
            const StabilityCell& live = row.cells[k];
            const StabilityCell& plain = row.cells[found - all.begin()];
            if (live.verdict == Verdict::left_out || plain.verdict == Verdict::left_out) continue;
            ++compared;
            if (live.verdict == Verdict::fail && plain.verdict == Verdict::pass)
                worse.push_back(
                    fmt::format("{}; {}: {}", name_of(row.trial), name_of(all[k]), live.reason));
        }
    }
    if (compared == 0) return;
    fmt::print("\n{} of {} live cells fail where their plain counterparts pass\n", worse.size(),
               compared);
    for (const std::string& cell : worse) fmt::print("    {}\n", cell);
}

std::string csv_text(const std::vector<Row>& rows, const std::vector<StabilityColumn>& all) {
    std::string text =
        "extreme,value,stepped_as,strain,scheme,verdict,reason,known_limit,steps,linearisations,"
        "energy_growth,left,late,seconds,solver\n";
    for (const Row& row : rows)
        for (std::size_t k = 0; k < row.cells.size(); ++k) {
            const StabilityCell& c = row.cells[k];
            text += fmt::format(
                "\"{}\",\"{}\",{},{},{},{},\"{}\",\"{}\",{},{},{:.6g},{:.3e},{:.4f},{:.3f},\"{}"
                "\"\n",
                row.trial.group, row.trial.value, way_names[static_cast<int>(all[k].way)],
                all[k].strain.name(), scheme_names[static_cast<int>(all[k].scheme)],
                verdict_names[static_cast<int>(c.verdict)], c.reason,
                c.verdict == Verdict::fail ? known_limit(row.trial, all[k], row.cells[k]) : "",
                c.steps, c.newton_iterations, c.energy_growth, c.left, c.late, c.seconds, c.solver);
        }
    return text;
}

json json_of(const std::vector<Row>& rows, const std::vector<StabilityColumn>& all) {
    json list = json::array();
    for (const Row& row : rows)
        for (std::size_t k = 0; k < all.size(); ++k) {
            const StabilityCell& c = row.cells[k];
            list.push_back(
                {{"extreme", row.trial.group},
                 {"value", row.trial.value},
                 {"stepped_as", way_names[static_cast<int>(all[k].way)]},
                 {"strain", all[k].strain.name()},
                 {"scheme", scheme_names[static_cast<int>(all[k].scheme)]},
                 {"verdict", verdict_names[static_cast<int>(c.verdict)]},
                 {"reason", c.reason},
                 {"known_limit",
                  c.verdict == Verdict::fail ? known_limit(row.trial, all[k], row.cells[k]) : ""},
                 {"steps", c.steps},
                 {"linearisations", c.newton_iterations},
                 {"energy_growth", c.energy_growth},
                 {"left", c.left},
                 {"late", c.late},
                 {"seconds", c.seconds},
                 {"solver", c.solver}});
        }
    return list;
}

#ifdef LIVETET_IMAGES
void draw(const std::filesystem::path& path, const std::vector<Row>& rows,
          const std::vector<StabilityColumn>& all) {
    MatrixPicture picture{"Stability: what passes, what is refused, what fails", {}, {}, {}};
    for (const StabilityColumn& c : all)
        picture.columns.push_back({way_names[static_cast<int>(c.way)], std::string(c.strain.name()),
                                   scheme_names[static_cast<int>(c.scheme)]});
    for (const Row& row : rows) {
        picture.rows.push_back(name_of(row.trial));
        for (const StabilityCell& c : row.cells)
            picture.cells.push_back(c.verdict == Verdict::pass   ? MatrixCell::good
                                    : c.verdict == Verdict::fail ? MatrixCell::bad
                                                                 : MatrixCell::neither);
    }
    write_matrix_picture(path, picture);
}
#endif

/// Every stability case in every strain model and scheme, as `solve` and as `track` step them, the
/// latter with four-node and ten-node tets, and as both step hexahedra: matrix, files, picture.
/// Returns the exit status: 1 where a cell fails that is not a known limit.
int bench_stability(const StabilityArguments& a) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1) fail("bench stability runs on one rank, found {}", session.ranks());
    if (same_file(a.csv, a.json))
        fail("--csv and --json: both name {}, expected two files", a.csv.string());
    std::vector<StabilityColumn> all = columns(a.plain);
    std::erase_if(all, [&](const StabilityColumn& c) {
        return name_of(c).find(a.column) == std::string::npos;
    });
    if (all.empty())
        fail("--column {}: no column has this in its name, they are as \"{}\"", a.column,
             name_of(columns(a.plain).back()));
    std::vector<StabilityCase> trials = stability_cases();
    std::erase_if(trials, [&](const StabilityCase& c) {
        return name_of(c).find(a.only) == std::string::npos;
    });
    if (trials.empty()) fail("--only {}: no case has this in its name", a.only);
    const StabilityLimits limits{a.noise_frames, a.budget_ms / 1e3};
    std::vector<Row> rows;
    {
        ProgressLine progress("stability");
        for (std::size_t r = 0; r < trials.size(); ++r) {
            rows.push_back({trials[r], {}});
            const bool is_long =
                trials[r].motion == PatchMotion::noise;  // as many frames as take long on any mesh
            const int cells = is_long ? 2 : trials[r].is_fine ? a.fine_cells : a.cells;
            const MeshHierarchy hierarchy = stability_mesh(trials[r], cells);
            const MeshHierarchy grid =
                trials[r].is_of_tets() ? MeshHierarchy{} : stability_grid(trials[r], cells);
            for (std::size_t k = 0; k < all.size(); ++k) {
                progress.update(static_cast<double>(r * all.size() + k) /
                                    static_cast<double>(trials.size() * all.size()),
                                fmt::format("{}: {}", name_of(trials[r]), name_of(all[k])));
                rows.back().cells.push_back(run_stability(
                    trials[r], all[k], is_of_hexahedra(all[k].way) ? grid : hierarchy, limits));
                if (!a.csv.empty())
                    write_text_file(a.csv, csv_text(rows, all));  // what hours have told stays told
            }
        }
    }
    print(rows, all);
    print_worse(rows, all);
    std::array<int, verdict_names.size()> count{};
    int unknown = 0;
    for (const Row& row : rows)
        for (std::size_t k = 0; k < all.size(); ++k) {
            ++count[static_cast<int>(row.cells[k].verdict)];
            unknown += letter(row, k, all) == 'F';
        }
    fmt::print("\n{} pass, {} refused, {} left out, {} fail, {} of them not known to\n", count[0],
               count[2], count[3], count[1], unknown);
    if (!a.json.empty()) write_text_file(a.json, json_of(rows, all).dump(2) + "\n");
#ifdef LIVETET_IMAGES
    if (!a.figure.empty()) draw(a.figure, rows, all);
#endif
    return unknown > 0 ? 1 : 0;
}

}  // namespace

void add_stability_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "stability",
        "Stiff and extreme cases with every constitutive model and time scheme, stepped as solve "
        "and as track step them, on tetrahedra and hexahedra, judged by rule; exit status 1 if one "
        "fails that is not a known "
        "limit");
    auto a = std::make_shared<StabilityArguments>();
    command->add_option("--cells", a->cells, "cells along the height of the box")
        ->capture_default_str()
        ->check(CLI::Range(2, 64));
    command
        ->add_option("--fine-cells", a->fine_cells,
                     "the same for the deep press, on ten-node tets: 111,132 of them by default")
        ->capture_default_str()
        ->check(CLI::Range(2, 64));
    command
        ->add_option("--noise-frames", a->noise_frames,
                     "frames of sensor noise on 96 tets; solve steps a thousandth of them")
        ->capture_default_str()
        ->check(CLI::Range(1000, 1000000000));
    command->add_option("--budget", a->budget_ms, "time budget of a frame of track, ms")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command->add_option("--only", a->only,
                        "only cases with this in their name, such as \"time step\"");
    command->add_option("--column", a->column,
                        "only columns with this in their name, such as \"track, green, "
                        "newmark\"");
    command->add_flag("--plain", a->plain,
                      "also make the frames of the track columns by multigrid in double precision, "
                      "and tell which live cells fail where these pass");
    command->add_option("--csv", a->csv, "write every cell to this file");
    command->add_option("--json", a->json, "the same as JSON");
    add_figure_option(*command, "--figure", a->figure, "draw the matrix to this PNG");
    command->callback([a, &status] {
        check_output_files({a->csv, a->json});
        check_figures({a->figure});
        status = bench_stability(*a);
    });
}

}  // namespace livetet
