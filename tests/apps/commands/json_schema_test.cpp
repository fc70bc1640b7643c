#include "apps/commands/json_schema.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <set>

#include "apps/phantom/phantom.hpp"
#include "apps/scene/scene.hpp"
#include "apps/study/study.hpp"
#include "config/yaml.hpp"
#include "support/program.hpp"
#include "tracking/motion_script.hpp"
#if __has_include(<valijson/validator.hpp>)
#define LIVETET_VALIJSON
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>
#endif

namespace livetet {
namespace {

using nlohmann::json;

/// YAML as an editor's language server sees it: plain scalars by the core schema of YAML 1.2.
json document_of(const YAML::Node& node) {
    if (node.IsMap()) {
        json table = json::object();
        for (const auto& entry : node)
            table[entry.first.as<std::string>()] = document_of(entry.second);
        return table;
    }
    if (node.IsSequence()) {
        json list = json::array();
        for (const YAML::Node& entry : node) list.push_back(document_of(entry));
        return list;
    }
    if (!node.IsDefined() || node.IsNull()) return nullptr;
    const std::string text = node.Scalar();
    if (node.Tag() == "!") return text;  // quoted
    if (text == "true" || text == "false") return text == "true";
    int whole = 0;
    double number = 0;
    if (YAML::convert<int>::decode(node, whole)) return whole;
    if (YAML::convert<double>::decode(node, number) && std::isfinite(number)) return number;
    return text;
}

template <class Table>
json schema_as_json() {
    return json::parse(schema_text<Table>("keys", "a test"));
}

std::filesystem::path root_of_tree() { return std::filesystem::path(LIVETET_TESTS).parent_path(); }

/// A text of every scene that the tree has, by where it stands.
std::map<std::string, std::string> shipped_scenes() {
    std::map<std::string, std::string> scenes;
    for (const auto& entry :
         std::filesystem::directory_iterator(root_of_tree() / "benchmarks/scenes"))
        if (entry.path().extension() == ".yaml")
            scenes[entry.path().filename().string()] = test::text_of(entry.path());
#ifdef LIVETET_IMAGES
    Truth truth;
    truth.depths = {0.01};
    scenes["the phantom's, to track"] = phantom_track_scene(truth);
    scenes["the phantom's, to solve"] = phantom_solve_scene(truth);
    scenes["the phantom's, with a blade"] = phantom_resection_scene(truth);
    scenes["the phantom's, swept"] = phantom_sweep_scene(truth);
#endif
    return scenes;
}

/// A scene with every optional table and list, as the program writes it, and the keys that it does
/// not write as they have no value.
std::string complete_scene() {
    Scene scene;
    SelectionOptions nodes;
    nodes.mask = "mask.nii";
    nodes.group = "set";
    nodes.box_mm = nodes.sphere_mm = nodes.half_space_mm = std::vector<double>{1, 2, 3, 4};
    nodes.nodes = std::vector<int>{1, 2};
    scene.mesh.body.speck_ml = 1;
    scene.mesh.wrap_mm = scene.mesh.voxel_mm = scene.mesh.smoothing_mm = 2;
    scene.materials.clear();
    for (const ModelChoice& model : ModelChoice::alternatives())
        scene.materials.push_back({{3000, 600}, 0.45, 1060, 1, model});
    static_cast<SelectionOptions&>(scene.fix.emplace_back()) = nodes;
    scene.fix[0].stiffness_N_per_m = Uncertain(500, 200);
    static_cast<SelectionOptions&>(scene.drive.emplace_back()) = nodes;
    scene.drive[0].stiffness_N_per_m = 500;
    scene.drive[0].centre_mm = Eigen::Vector3d(1, 2, 3);
    static_cast<SelectionOptions&>(scene.loads.emplace_back()) = nodes;
    CutOptions& cut = scene.cuts.emplace_back();
    cut.point_mm = cut.normal = Eigen::Vector3d(1, 2, 3);
    cut.radius_mm = 20;
    cut.edges_mm = std::vector<double>{1, 0, 0, 0, 1, 0};
    cut.file = "cut.stl";
    scene.solver.time_limit_s = 60;
    TrackOptions& track = scene.track.emplace();
    track.sensors[0].patch_spread_mm = 2;
    track.sensors[0].place_mm = Eigen::Vector3d(1, 2, 3);
    track.sensors[0].stiffness_N_per_m = 10;
    track.tools.emplace_back().blade_mm = {0, -40, 0, 0, 40, 0};
    track.cut_by_hand_mm = 30;
    static_cast<SelectionOptions&>(track.targets.emplace_back()) = nodes;
    track.targets[0].point_mm = Eigen::Vector3d(1, 2, 3);
    track.smoothing_Hz = 1;
    track.newton_iterations = 2;
    track.ahead_ms = NumberOrAuto{};
    track.request_ms = 10;
    track.publish.emplace();
    DeformOptions& deform = scene.deform.emplace();
    static_cast<SelectionOptions&>(deform.forces.emplace_back()) = nodes;
    deform.targets = track.targets;
    deform.later_points = {"later.csv"};
    scene.probes.emplace();
    scene.output.fields = {"stress", "reactions"};
    std::string text = to_yaml(scene);
    const std::string direction = "fibre_1:";  // with it fibre_2, which has no default
    const std::size_t at = text.find(direction);
    return text.insert(at, "fibre_2: [1, 0, 0]\n    ");
}

std::string complete_study() {
    StudyOptions study;
    VaryOptions& vary = study.vary.emplace_back();
    vary.values = {"1", "2.5", "a"};
    vary.from = 1;
    vary.to = 2;
    return to_yaml(study);
}

std::string complete_script() {
    MotionScript script;
    script.organ.moves.emplace_back().at_s = 1;
    script.tools.emplace_back().moves.emplace_back().at_s = 1;
    return to_yaml(script);
}

/// All keys of a schema: "track.sensors.tool".
void collect_keys(const json& schema, const std::string& path, std::set<std::string>& keys) {
    for (const auto& [key, value] : schema.at("properties").items()) {
        keys.insert(path + key);
        if (value.contains("properties")) collect_keys(value, path + key + ".", keys);
        if (value.contains("items") && value["items"].contains("properties"))
            collect_keys(value["items"], path + key + ".", keys);
    }
}

/// The same of a file.
void collect_given(const json& table, const std::string& path, std::set<std::string>& keys) {
    for (const auto& [key, value] : table.items()) {
        keys.insert(path + key);
        if (value.is_object()) collect_given(value, path + key + ".", keys);
        if (value.is_array())
            for (const json& entry : value)
                if (entry.is_object()) collect_given(entry, path + key + ".", keys);
    }
}

template <class Table>
void expect_all_keys_in(const std::string& text) {
    std::set<std::string> keys, given;
    collect_keys(schema_as_json<Table>(), "", keys);
    collect_given(document_of(YAML::Load(text)), "", given);
    EXPECT_EQ(given, keys);
}

TEST(JsonSchema, HasTheKeysThatTheProgramWritesAndNoOthers) {
    expect_all_keys_in<Scene>(complete_scene());
    expect_all_keys_in<StudyOptions>(complete_study());
    expect_all_keys_in<MotionScript>(complete_script());
}

TEST(JsonSchema, StatesUnitLimitDefaultAndMeaning) {
    const json scene = schema_as_json<Scene>().at("properties");
    const json& material = scene["materials"]["items"]["properties"];
    const std::string density = material["density_kg_per_m3"]["description"];
    EXPECT_EQ(density.rfind("[kg/m^3] mass density", 0), 0u) << density;
    EXPECT_EQ(material["density_kg_per_m3"]["exclusiveMinimum"], 0);
    EXPECT_EQ(material["density_kg_per_m3"]["default"], 1060);
    EXPECT_EQ(scene["mesh"]["properties"]["tets"]["minimum"], min_tets);
    EXPECT_EQ(scene["mesh"]["properties"]["tets"]["maximum"], max_tets);
    const json& scheme = scene["time"]["properties"]["scheme"];
    EXPECT_EQ(scheme["enum"], (json{"static", "euler", "newmark", "generalized_alpha"}));
    EXPECT_EQ(scheme["enumDescriptions"].size(), scheme["enum"].size());
    EXPECT_EQ(scheme["default"], "static");
}

#ifdef LIVETET_VALIJSON

/// Validates by a schema, as an editor does.
class Judge {
  public:
    explicit Judge(const json& schema) {
        valijson::SchemaParser parser(valijson::SchemaParser::kDraft7);
        parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(schema), schema_);
    }
    bool accepts(const json& document) {
        return validator_.validate(schema_, valijson::adapters::NlohmannJsonAdapter(document),
                                   nullptr);
    }
    bool accepts(const std::string& text) { return accepts(document_of(YAML::Load(text))); }

  private:
    valijson::Schema schema_;
    valijson::Validator validator_;
};

template <class Table>
bool is_read(const std::string& text) {
    try {
        (void)read_yaml<Table>(text, "file.yaml");
        return true;
    } catch (const Error&) {
        return false;
    }
}

/// The key with one letter left out, doubled, replaced, or exchanged with the next.
std::set<std::string> mistyped(const std::string& key) {
    std::set<std::string> words;
    for (std::size_t i = 0; i < key.size(); ++i) {
        words.insert(std::string(key).erase(i, 1));
        words.insert(std::string(key).insert(i, 1, key[i]));
        words.insert(std::string(key).replace(i, 1, 1, key[i] == 'q' ? 'w' : 'q'));
        std::string exchanged = key;
        if (i + 1 < key.size()) std::swap(exchanged[i], exchanged[i + 1]);
        words.insert(exchanged);
    }
    words.erase(key);
    words.erase("");
    return words;
}

/// Mistypes each key of a table in `document` in turn. Returns how many were judged.
std::size_t mistype_each(json& document, json& table, const std::set<std::string>& known,
                         const std::string& path, Judge& judge) {
    std::size_t count = 0;
    const json original = table;
    for (const auto& [key, value] : original.items()) {
        for (const std::string& word : mistyped(key)) {
            if (known.contains(path + word)) continue;  // another key: from, form
            table.erase(key);
            table[word] = value;
            EXPECT_FALSE(judge.accepts(document)) << path << word;
            table = original;
            ++count;
        }
        if (value.is_object())
            count += mistype_each(document, table[key], known, path + key + ".", judge);
        if (value.is_array())
            for (json& entry : table[key])
                if (entry.is_object())
                    count += mistype_each(document, entry, known, path + key + ".", judge);
    }
    return count;
}

template <class Table>
void expect_no_mistyped_key_in(const std::string& text) {
    const json schema = schema_as_json<Table>();
    Judge judge(schema);
    std::set<std::string> known;
    collect_keys(schema, "", known);
    json document = document_of(YAML::Load(text));
    ASSERT_TRUE(judge.accepts(document)) << text;
    EXPECT_GT(mistype_each(document, document, known, "", judge), 5 * known.size());
}

TEST(JsonSchema, AcceptsEveryShippedScene) {
    Judge judge(schema_as_json<Scene>());
    EXPECT_GE(shipped_scenes().size(), 8u);
    for (const auto& [name, text] : shipped_scenes()) {
        EXPECT_TRUE(judge.accepts(text)) << name;
        EXPECT_TRUE(judge.accepts(to_yaml(read_yaml<Scene>(text, name)))) << name << ", resolved";
    }
}

TEST(JsonSchema, AcceptsTheFilesOfTheDocumentation) {
    Judge scene(schema_as_json<Scene>()), study(schema_as_json<StudyOptions>()),
        script(schema_as_json<MotionScript>());
    int count = 0;
    std::vector<std::filesystem::path> pages{root_of_tree() / "README.md"};
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root_of_tree() / "docs"))
        if (entry.path().extension() == ".md") pages.push_back(entry.path());
    for (const std::filesystem::path& page : pages) {
        const std::string text = test::text_of(page), begin = "```yaml\n", end = "```\n";
        for (std::size_t at = text.find(begin); at != text.npos; at = text.find(begin, at + 1)) {
            const std::size_t from = at + begin.size();
            const std::string block = text.substr(from, text.find(end, from) - from);
            EXPECT_TRUE(scene.accepts(block) || study.accepts(block) || script.accepts(block))
                << page << "\n"
                << block;
            ++count;
        }
    }
    EXPECT_GE(count, 5);
}

TEST(JsonSchema, RefusesEveryKeyMistypedByOneLetter) {
    expect_no_mistyped_key_in<Scene>(complete_scene());
    expect_no_mistyped_key_in<StudyOptions>(complete_study());
    expect_no_mistyped_key_in<MotionScript>(complete_script());
    for (const auto& [name, text] : shipped_scenes()) {
        Judge judge(schema_as_json<Scene>());
        std::set<std::string> known;
        collect_keys(schema_as_json<Scene>(), "", known);
        json document = document_of(YAML::Load(text));
        EXPECT_GT(mistype_each(document, document, known, "", judge), 50u) << name;
    }
}

/// Values that the program takes, and others.
TEST(JsonSchema, JudgesValuesAsTheProgramDoes) {
    Judge judge(schema_as_json<Scene>());
    int accepted = 0;
    const std::vector<std::string> texts{
        "materials: [{young_Pa: 3000 +- 600}]",
        "materials: [{young_Pa: 3e3}]",
        "materials: [{young_Pa: 3000 + 600}]",
        "materials: [{young_Pa: 3000 +- -600}]",
        "materials: [{young_Pa: -1}]",
        "materials: [{young_Pa: 0}]",
        "materials: [{poisson: 0.5}]",
        "materials: [{poisson: 0.4999}]",
        "materials: [{model: mooney_rivlin, c01_share: 0.5}]",
        "materials: [{model: mooney_rivlin, c01_share: 1.5}]",
        "materials: [{model: neohookean, c01_share: 0.5}]",
        "materials: [{c01_share: 0.5}]",
        "materials: [{model: rubber}]",
        "materials: {young_Pa: 3000}",
        "materials: [{region: 1.5}]",
        "track: {ahead_ms: auto}",
        "track: {ahead_ms: 500}",
        "track: {ahead_ms: 501}",
        "track: {ahead_ms: soon}",
        "track: {pace: every-sample}",
        "track: {pace: every sample}",
        "track: {publish: {port: 70000}}",
        "track: {sensors: [{tool: 5, may_slip: false}]}",
        "track: {sensors: [{may_slip: perhaps}]}",
        "track:",
        "fix:",
        "time: {step_s: }",
        "time: {step_s: 0}",
        "time: {beta: 1}",
        "solver: {relative_tolerance: 1}",
        "solver: {tangent: held-rotation}",
        "gravity_m_per_s2: [0, 0, -9.81]",
        "gravity_m_per_s2: [0, -9.81]",
        "gravity_m_per_s2: -9.81",
        "mesh: {labels: [1, 2]}",
        "mesh: {labels: [liver]}",
        "mesh: {labels: 1}",
        "output: {fields: [stress, reactions]}",
        "output: {fields: [strain]}",
    };
    for (const std::string& text : texts) {
        EXPECT_EQ(judge.accepts(text), is_read<Scene>(text)) << text;
        accepted += judge.accepts(text);
    }
    EXPECT_GT(accepted, 10);
    EXPECT_GT(static_cast<int>(texts.size()) - accepted, 10);
}

#else

TEST(JsonSchema, AcceptsAndRefusesAsTheProgramDoes) {
    GTEST_SKIP() << "libvalijson-dev is not installed: no validator";
}

#endif

}  // namespace
}  // namespace livetet
