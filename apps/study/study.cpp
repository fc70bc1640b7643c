#include "apps/study/study.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "apps/scene/scene_files.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/key_places.hpp"
#include "config/yaml.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

constexpr std::size_t max_solves =
    100'000;  // each has a file until the end, and its scene is checked before the first solve

/// A step of a key: "a[2].b" is "a", index 2, "b".
struct KeyStep {
    std::string name;  ///< key in a table; empty: index in a list
    std::size_t place = 0;
    std::size_t end = 0;  ///< end of the step in the key
};

std::vector<KeyStep> steps_of(const std::string& key, const std::string& where) {
    std::vector<KeyStep> steps;
    std::size_t i = 0;
    while (i < key.size()) {
        if (key[i] == '[') {
            const std::size_t close = std::min(key.find(']', i), key.size());
            const auto place = parse_index(std::string_view(key).substr(i + 1, close - i - 1));
            if (close == key.size() || !place || steps.empty())
                fail("{} = {}: expected a key such as materials[0].young_Pa", where, key);
            steps.push_back({"", *place, close + 1});
            i = close + 1;
        } else {
            if (key[i] == '.' && !steps.empty()) ++i;
            const std::size_t end = std::min(key.find_first_of(".[", i), key.size());
            if (end == i) fail("{} = {}: expected a key such as materials[0].young_Pa", where, key);
            steps.push_back({key.substr(i, end - i), 0, end});
            i = end;
        }
    }
    if (steps.empty())
        fail("{} is missing, expected a key of the scene such as materials[0].young_Pa", where);
    return steps;
}

/// Sets the value of a key. Checks only that the key's path exists; key and value are checked when
/// the scene is read.
void set_value(const YAML::Node& scene, const std::string& key, const std::string& value,
               const std::string& where) {
    const std::vector<KeyStep> steps = steps_of(key, where);
    YAML::Node node = scene;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const KeyStep& step = steps[i];
        const std::string so_far = key.substr(0, i == 0 ? 0 : steps[i - 1].end);
        if (step.name.empty()) {
            if (!node.IsSequence()) fail("{} = {}: {} of the scene is no list", where, key, so_far);
            if (step.place >= node.size())
                fail("{} = {}: {} of the scene has {} entries, counted from 0", where, key, so_far,
                     node.size());
            node.reset(node[step.place]);
        } else {
            if (!node.IsMap()) fail("{} = {}: {} of the scene is no table", where, key, so_far);
            const bool last = i + 1 == steps.size();
            if (!last && !node[step.name]) {
                std::vector<std::string> names;
                for (const auto& entry : node) names.push_back(entry.first.as<std::string>());
                const std::string nearest = nearest_name(step.name, names);
                fail("{} = {}: the scene has no {}{}", where, key, key.substr(0, step.end),
                     nearest.empty() ? fmt::format(", it has {}", fmt::join(names, ", "))
                                     : fmt::format(", did you mean {}?", nearest));
            }
            if (last && !node[step.name]) node[step.name] = YAML::Node();
            node.reset(node[step.name]);
        }
    }
    if (node.IsMap() || node.IsSequence())
        fail("{} = {}: is a {} in the scene, expected a single value to vary", where, key,
             node.IsMap() ? "table" : "list");
    node = value;
}

/// The value at a share, from 0 to 1, of the range.
std::string at_share(const VaryOptions& v, double share) {
    const double value = share == 1 ? *v.to
                         : v.spacing == Spacing::linear
                             ? *v.from + share * (*v.to - *v.from)
                             : *v.from * std::pow(*v.to / *v.from, share);
    const double near = std::round(value);  // keeps 1 to 100 by 1 from giving 14.000000000000002
    return fmt::format("{}",
                       v.whole || std::abs(value - near) < 1e-12 * std::abs(near) ? near : value);
}

void check_vary(const VaryOptions& v, Design design, const std::string& where) {
    const bool range = v.from || v.to;
    if (range == !v.values.empty())
        fail("{} ({}) has {}, expected either values or from and to", where, v.key,
             range ? "values and a range" : "no values and no range: an empty grid");
    if (v.whole && !range) fail("{} ({}): whole is of a range, found values", where, v.key);
    if (!range) return;
    if (!v.from || !v.to)
        fail("{} ({}) has only {} of its range, expected from and to", where, v.key,
             v.from ? "from" : "to");
    if (v.spacing == Spacing::logarithmic && !(*v.from * *v.to > 0))
        fail("{} ({}): spacing log from {} to {}, expected both above 0 or both below", where,
             v.key, *v.from, *v.to);
    if (design == Design::latin_hypercube) return;
    if (v.count < 1)
        fail("{} ({}): count = {}, an empty grid, expected at least 1", where, v.key, v.count);
    if (static_cast<std::size_t>(v.count) > max_solves)
        fail("{} ({}): count = {}: more than {} solves", where, v.key, v.count, max_solves);
}

std::vector<std::string> values_of(const VaryOptions& v) {
    if (!v.values.empty()) return v.values;
    std::vector<std::string> values;
    for (int i = 0; i < v.count; ++i)
        values.push_back(at_share(v, v.count > 1 ? i / (v.count - 1.0) : 0));
    return values;
}

std::vector<Sample> grid_of(const std::vector<VaryOptions>& vary, const std::string& file) {
    std::vector<Sample> values, samples;
    std::size_t count = 1;
    for (const VaryOptions& v : vary) {
        values.push_back(values_of(v));
        if (count > max_solves / values.back().size())
            fail("{}: more than {} solves", file, max_solves);
        count *= values.back().size();
    }
    for (std::size_t k = 0; k < count; ++k) {
        std::vector<std::string> sample(vary.size());
        std::size_t rest = k;
        for (std::size_t i = vary.size(); i-- > 0; rest /= values[i].size())
            sample[i] = values[i][rest % values[i].size()];
        samples.push_back(std::move(sample));
    }
    return samples;
}

std::vector<Sample> list_of(const std::vector<VaryOptions>& vary, const std::string& file) {
    std::vector<Sample> samples;
    for (const VaryOptions& v : vary) {
        const std::vector<std::string> values = values_of(v);
        if (&v == &vary.front()) samples.resize(values.size());
        if (values.size() != samples.size())
            fail("{}: design list has {} values of {} and {} of {}, expected equally many", file,
                 samples.size(), vary.front().key, values.size(), v.key);
        for (std::size_t k = 0; k < values.size(); ++k) samples[k].push_back(values[k]);
    }
    return samples;
}

std::vector<Sample> hypercube_of(const StudyOptions& o, const std::string& file) {
    if (o.samples < 1 || static_cast<std::size_t>(o.samples) > max_solves)
        fail("{}: samples = {}, expected from 1 to {} for design latin-hypercube", file, o.samples,
             max_solves);
    std::vector<Sample> samples;
    for (const auto& point : latin_hypercube(static_cast<std::size_t>(o.samples), o.vary.size(),
                                             static_cast<std::uint64_t>(o.seed))) {
        std::vector<std::string>& sample = samples.emplace_back();
        for (std::size_t i = 0; i < point.size(); ++i) {
            const VaryOptions& v = o.vary[i];
            const auto place =
                static_cast<std::size_t>(point[i] * static_cast<double>(v.values.size()));
            sample.push_back(v.values.empty() ? at_share(v, point[i]) : v.values[place]);
        }
    }
    return samples;
}

void note_files(const Scene& scene, std::set<std::filesystem::path>& files) {
    files.merge(mesh_files(scene));
    if (scene.probes) files.insert(scene.probes->points);
}

}  // namespace

std::vector<Sample> samples_of(const StudyOptions& options, const std::string& file) {
    switch (options.design) {
        case Design::grid:
            return grid_of(options.vary, file);
        case Design::list:
            return list_of(options.vary, file);
        case Design::latin_hypercube:
            return hypercube_of(options, file);
    }
    return {};
}

std::vector<std::vector<double>> latin_hypercube(std::size_t count, std::size_t dimensions,
                                                 std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    const auto uniform = [&] {
        return static_cast<double>(engine() >> 11) * 0x1p-53;
    };  // those of std differ between libraries
    std::vector<std::vector<double>> points(count, std::vector<double>(dimensions));
    std::vector<std::size_t> strata(count);
    for (std::size_t d = 0; d < dimensions; ++d) {
        std::iota(strata.begin(), strata.end(), std::size_t{0});
        for (std::size_t i = count; i-- > 1;)
            std::swap(strata[i],
                      strata[static_cast<std::size_t>(uniform() * static_cast<double>(i + 1))]);
        for (std::size_t k = 0; k < count; ++k)
            points[k][d] =
                (static_cast<double>(strata[k]) + uniform()) / static_cast<double>(count);
    }
    return points;
}

Scene Study::scene(std::size_t k) const {
    const YAML::Node node = YAML::Load(scene_text);
    std::string where = fmt::format("{}, solve {}", file, k);
    for (std::size_t i = 0; i < options.vary.size(); ++i) {
        set_value(node, options.vary[i].key, samples[k][i],
                  fmt::format("{}: vary[{}].key", file, i));
        where += fmt::format("{} {} = {}", i ? "," : ":", options.vary[i].key, samples[k][i]);
    }
    Scene scene = read_yaml<Scene>(node, where);
    finish_scene(scene, KeyPlaces(where), scene_folder);
    return scene;
}

namespace {

/// PETSc's options without those that only print, which may differ between runs.
std::string options_of_results(const std::string& options) {
    std::string kept;
    bool prints = false;
    for (const std::string_view word : split_words(options)) {
        if (word.starts_with("-") && !parse_number(word))
            prints = word.starts_with("-log_") || word == "-info" ||
                     word.starts_with("-options_") || word.find("_view") != word.npos ||
                     word.find("_monitor") != word.npos || word.ends_with("_converged_reason");
        if (!prints) kept += fmt::format("{}{}", kept.empty() ? "" : " ", word);
    }
    return kept;
}

}  // namespace

std::string Study::fingerprint() const {
    StudyOptions of_results = options;
    of_results.ranks_per_solve = 1;  // may change, as it does not affect results
    of_results.plots.clear();
    const std::string petsc = options_of_results(petsc_options);
    return to_yaml(of_results) + "---\n" + scene_text +
           (petsc.empty() ? "" : "---\nPETSc's options: " + petsc + "\n");
}

Study load_study(const std::filesystem::path& path, const ProgressCallback& progress) {
    Study study;
    study.file = path.string();
    study.text = read_text_file(path);
    study.options = read_yaml<StudyOptions>(study.text, study.file);
    StudyOptions& o = study.options;
    if (o.scene.empty())
        fail("scene is missing, expected the scene that every solve begins with ({})", study.file);
    if (o.vary.empty())
        fail("vary is missing, an empty grid, expected at least one key that varies ({})",
             study.file);
    if (ending(o.output) != ".h5")
        fail("output = {}: expected a name that ends in .h5 ({})", o.output.string(), study.file);
    const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
    o.scene = (folder / o.scene).lexically_normal();
    o.output = (folder / o.output).lexically_normal();
    for (std::size_t i = 0; i < o.vary.size(); ++i) {
        const VaryOptions& v = o.vary[i];
        check_vary(v, o.design, fmt::format("{}: vary[{}]", study.file, i));
        for (std::size_t j = 0; j < i; ++j)
            if (o.vary[j].key == v.key)
                fail("{}: vary[{}].key = {} is vary[{}]'s too", study.file, i, v.key, j);
        if (v.key.starts_with("solver.petsc_options"))
            fail("{}: vary[{}].key = {}: PETSc has one set of options for all solves", study.file,
                 i, v.key);
        if (v.key.starts_with("output."))
            fail("{}: vary[{}].key = {}: a study keeps its results in its own output", study.file,
                 i, v.key);
    }
    study.samples = samples_of(o, study.file);
    study.scene_text = to_yaml(load_scene(o.scene));
    study.scene_folder = o.scene.parent_path();
    for (std::size_t k = 0; k < study.samples.size(); ++k) {
        if (progress && k % 1000 == 999)
            progress(static_cast<double>(k) / static_cast<double>(study.samples.size()),
                     "its scenes");
        note_files(study.scene(k), study.files);
    }
    return study;
}

}  // namespace livetet
