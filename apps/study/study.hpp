#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "base/progress.hpp"

namespace livetet {

enum class Design { grid, list, latin_hypercube };
enum class Spacing { linear, logarithmic };

/// A key of the scene, and its values: a list, or a range.
struct VaryOptions {
    std::string key;
    std::vector<std::string> values;
    std::optional<double> from, to;
    int count = 0;
    Spacing spacing = Spacing::linear;
    bool whole = false;
};

/// A study file: a scene, and what varies. Paths are as in the file until `load_study` resolves
/// them.
struct StudyOptions {
    std::filesystem::path scene;
    Design design = Design::grid;
    std::vector<VaryOptions> vary;
    int samples = 0;
    int seed = 1;
    int ranks_per_solve = 1;
    bool keep_displacements = true;
    std::filesystem::path output = "study.h5";
    std::vector<std::string> plots{"largest_displacement_mm"};
};

template <class Visitor>
void visit_fields(Visitor& v, VaryOptions& o) {
    v.field("key", o.key, "",
            "the key of the scene that varies: materials[0].young_Pa, drive[0].displacement_mm[2], "
            "mesh.file");
    v.field("values", o.values, "", "values of the key; or give from, to and count");
    v.field("from", o.from, "", "lower end of a range");
    v.field("to", o.to, "", "upper end of the range, included");
    v.field("count", o.count, "", "number of values in the range, for `grid` and `list`",
            at_least<0, int>());
    v.choice("spacing", o.spacing, "of a range",
             {{Spacing::linear, "linear", "equal steps"},
              {Spacing::logarithmic, "log", "equal ratios"}});
    v.field("whole", o.whole, "", "round to whole numbers: for seeds and counts");
}

template <class Visitor>
void visit_fields(Visitor& v, StudyOptions& o) {
    v.field("scene", o.scene, "", "base scene of all solves, a file of `livetet solve`");
    v.choice("design", o.design, "combinations of values to solve",
             {{Design::grid, "grid", "every value with every other; the last key varies fastest"},
              {Design::list, "list",
               "first values together, then second ones, and so on: equally many of each"},
              {Design::latin_hypercube, "latin-hypercube",
               "`samples` points spread evenly over the ranges, one in each stratum of each key"}});
    v.list("vary", o.vary, "what varies");
    v.field("samples", o.samples, "", "number of points of `latin-hypercube`", at_least<0, int>());
    v.field("seed", o.seed, "", "seed of `latin-hypercube`: the same seed gives the same points",
            at_least<0, int>());
    v.field("ranks_per_solve", o.ranks_per_solve, "",
            "ranks for each solve; other groups of ranks do other solves", at_least<1, int>());
    v.field("keep_displacements", o.keep_displacements, "",
            "keep each solve's last displacement field, for ParaView");
    v.field(
        "output", o.output, "",
        "inputs, outputs, histories, displacements (.h5, with .xdmf, .csv and pictures beside it)");
    v.field("plots", o.plots, "", "outputs to plot against every numerical input");
}

/// The values of one solve, for each key.
using Sample = std::vector<std::string>;

/// The solves of a study in their order. `file`: its name in messages. Throws Error.
std::vector<Sample> samples_of(const StudyOptions& options, const std::string& file);

/// A study with all its solves.
struct Study {
    StudyOptions options;
    std::string file;                       ///< file name, for messages
    std::string text;                       ///< contents of the file
    std::string scene_text;                 ///< scene with all defaults filled in
    std::filesystem::path scene_folder;     ///< folder of relative paths among the values
    std::vector<Sample> samples;            ///< of each solve
    std::set<std::filesystem::path> files;  ///< read by the solves
    std::string petsc_options{};            ///< from the command line

    /// The checked scene of solve `k`. Throws Error, naming solve, keys and values.
    Scene scene(std::size_t k) const;
    /// Text of everything that the results depend on.
    std::string fingerprint() const;
};

/// Reads a study file and its scene, and checks the scene of every solve. Throws Error.
Study load_study(const std::filesystem::path& path, const ProgressCallback& progress = {});

/// `count` points of a Latin hypercube in [0, 1)^dimensions, by rows: in each dimension one point
/// in each of `count` strata, at a random position in it (McKay, Beckman and Conover 1979). The
/// same seed gives the same points on every machine.
std::vector<std::vector<double>> latin_hypercube(std::size_t count, std::size_t dimensions,
                                                 std::uint64_t seed);

}  // namespace livetet
