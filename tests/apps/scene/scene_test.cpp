#include "apps/scene/scene.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include "base/error.hpp"
#include "config/key_places.hpp"
#include "config/yaml.hpp"

namespace livetet {
namespace {

std::string refusal_of(const std::string& text) {
    try {
        Scene scene = read_yaml<Scene>(text, "scene.yaml");
        finish_scene(scene, KeyPlaces("scene.yaml", text), "");
    } catch (const Error& error) {
        return error.what();
    }
    return "accepted";
}

/// Of a scene with these lines, of which the first is line 5, in its track section.
std::string refusal_of_track(const std::string& lines) {
    return refusal_of(
        "mesh: {file: block.h5}\n"
        "track:\n"
        "  source: press.igs.mha\n"
        "  registration: registration.json\n" +
        lines);
}

/// As the errors of single keys do.
TEST(Scene, ErrorsOfKeysThatDoNotGoTogetherNameLineAndUnit) {
    EXPECT_EQ(refusal_of_track("  ahead_ms: 40\n"), "accepted");
    EXPECT_EQ(refusal_of_track("  sensors:\n"
                               "    - tool: Sensor\n"
                               "      patch_radius_mm: 15\n"
                               "      patch_spread_mm: 20\n"),
              "track.sensors[0].patch_spread_mm = 20 mm must be less than patch_radius_mm = 15 mm "
              "(scene.yaml:8)");
    EXPECT_EQ(refusal_of_track("  smoothing_Hz: 0\n"
                               "  ahead_ms: 40\n"),
              "track.ahead_ms = 40 ms with track.smoothing_Hz = 0 Hz: poses as measured are not "
              "extrapolated, expected no smoothing_Hz, or ahead_ms: 0 (scene.yaml:6)");
    EXPECT_EQ(refusal_of_track("  display_ms: 20\n"),
              "track.display_ms = 20 ms without track.ahead_ms = auto: is not used, expected "
              "ahead_ms: auto, or no display_ms (scene.yaml:5)");
    EXPECT_EQ(refusal_of_track("  targets: [{point_mm: [1, 2, 3]}]\n"),
              "track.targets[0].name is missing (scene.yaml:5)");
}

/// Readers and meshers number nodes anew: a list would hold others than those of the file.
TEST(Scene, NodesAreListedOfHierarchiesAlone) {
    const auto scene = [](const char* file, const char* key, const char* selection) {
        return fmt::format("mesh: {{file: {}}}\n{}\n  - {{{}}}\n", file, key, selection);
    };
    const char* list = "nodes: [3]";
    for (const char* key : {"fix:", "drive:", "loads:"}) {
        EXPECT_EQ(refusal_of(scene("block.h5", key, list)), "accepted") << key;
        EXPECT_EQ(refusal_of(scene("block.msh", key, "group: end")), "accepted") << key;
        for (const char* file : {"block.msh", "block.vtu", "block.stl", "block.nrrd"}) {
            const std::string refused = refusal_of(scene(file, key, list));
            const std::string name(key, std::string_view(key).size() - 1);
            EXPECT_EQ(refused.rfind(name + "[0].nodes: the nodes of " + file, 0), 0u) << refused;
            EXPECT_NE(refused.find("(scene.yaml:3)"), std::string::npos) << refused;
        }
    }
    const std::string zone = "mesh: {file: block.msh}\ndeform: {forces: [{nodes: [3]}]}\n";
    EXPECT_EQ(refusal_of(zone).rfind("deform.forces[0].nodes: the nodes of block.msh", 0), 0u)
        << refusal_of(zone);
}

}  // namespace
}  // namespace livetet
