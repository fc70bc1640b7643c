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

/// One key of the scene, and the values it takes: a list, or a range.
struct VaryOptions {
    std::string key;
    std::vector<std::string> values;
    std::optional<double> from, to;
    int count = 0;
    Spacing spacing = Spacing::linear;
    bool whole = false;
};

/// A study file: a scene, and what varies. Paths are relative to it until `load_study` has made
/// them absolute.
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
            "what varies, as the scene names it: materials[0].young_Pa, "
            "drive[0].displacement_mm[2], mesh.file");
    v.field("values", o.values, "", "these, one after the other; or");
    v.field("from", o.from, "", "a range of numbers from here");
    v.field("to", o.to, "", "to here, both in it");
    v.field("count", o.count, "", "as many of them, in `grid` and `list`", at_least<0, int>());
    v.choice("spacing", o.spacing, "of a range",
             {{Spacing::linear, "linear", "equal steps"},
              {Spacing::logarithmic, "log", "equal ratios"}});
    v.field("whole", o.whole, "",
            "whole numbers only, rounded from the range: for seeds and counts");
}

template <class Visitor>
void visit_fields(Visitor& v, StudyOptions& o) {
    v.field("scene", o.scene, "",
            "the scene that every solve begins with, a file of `livetet solve`");
    v.choice(
        "design", o.design, "which combinations are solved",
        {{Design::grid, "grid", "every value with every other; the last key varies fastest"},
         {Design::list, "list", "first values together, then second ones ...: as many of each"},
         {Design::latin_hypercube, "latin-hypercube",
          "`samples` points that fill the ranges evenly, each key's range cut into as many "
          "strata"}});
    v.list("vary", o.vary, "what varies");
    v.field("samples", o.samples, "", "how many, in `latin-hypercube`", at_least<0, int>());
    v.field("seed", o.seed, "", "of `latin-hypercube`: the same gives the same points",
            at_least<0, int>());
    v.field("ranks_per_solve", o.ranks_per_solve, "",
            "ranks that work together on one solve; the others solve others", at_least<1, int>());
    v.field("keep_displacements", o.keep_displacements, "",
            "keep each solve's last displacement field, for ParaView");
    v.field(
        "output", o.output, "",
        "inputs, outputs, histories, displacements (.h5, with .xdmf, .csv and pictures beside it)");
    v.field("plots", o.plots, "",
            "outputs that pictures are made of, against every input that is a number");
}

/// A study, its solves spelt out.
struct Study {
    StudyOptions options;
    std::string file;                    ///< its name, as messages give it
    std::string text;                    ///< as it was read
    std::string scene_text;              ///< the scene with every value it resolved to
    std::filesystem::path scene_folder;  ///< what a relative path among the values starts from
    std::vector<std::vector<std::string>> samples;  ///< for each solve, a value for each key
    std::set<std::filesystem::path> files;          ///< that the solves read
    std::string petsc_options{};                    ///< of the command line

    /// The scene of solve `k`, checked. Throws Error, naming solve, keys and values.
    Scene scene(std::size_t k) const;
    /// All that the results depend on, as text.
    std::string fingerprint() const;
};

/// Reads a study file and its scene, and checks every solve's scene. Throws Error.
Study load_study(const std::filesystem::path& path, const ProgressCallback& progress = {});

/// `count` points of a Latin hypercube in [0, 1)^dimensions, by rows: in every dimension one point
/// in each of `count` strata, at a random place within it (McKay, Beckman and Conover 1979). The
/// same seed gives the same points on every machine.
std::vector<std::vector<double>> latin_hypercube(std::size_t count, std::size_t dimensions,
                                                 std::uint64_t seed);

}  // namespace livetet
