#include "apps/live/statement_record.hpp"

#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "io/meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;

FrameStatement two_targets() {
    FrameStatement statement;
    for (const double size : {1e-3, 2e-3}) {
        TargetStatement& t = statement.targets.emplace_back();
        t.position = {0.1, -0.02, 0.3};
        t.covariance << 3, 1, 0.5, 1, 2, 0.25, 0.5, 0.25, 1;
        t.covariance *= size * size;
        t.radius_95 = 3 * size;
        for (std::size_t q = 0; q < error_source_count; ++q)
            t.by_source[q] = static_cast<double>(q) * size * size;
    }
    statement.missing.add(ErrorSource::elements);
    statement.computed = 0.5;
    statement.surface.radius_95 = {4e-3, 5e-3, 7e-3};
    statement.surface.missing.add(ErrorSource::elements);
    statement.surface.missing.add(ErrorSource::law);
    return statement;
}

/// Three corners of the cube.
const std::vector<Vector3> cube_places{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0.1}};

/// A result of one frame with this statement. `targets`: the text about them.
std::filesystem::path written(const FrameStatement& statement,
                              const std::string& targets = text_of_targets({"Near", "Far"})) {
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, testing_meshes::cube(), "");
    if (!targets.empty()) writer.write_text("targets", targets);
    if (!statement.surface.radius_95.empty()) write_surface_places(writer, cube_places);
    writer.append(0, std::vector<Vector3>(8, Vector3::Zero()));
    append_statement(writer, statement);
    writer.close();
    return path;
}

TEST(StatementRecord, AStatementComesBackAsItWas) {
    const FrameStatement statement = two_targets();
    const ResultReader result(written(statement));
    const StatementReader reader(result, "r.h5");
    EXPECT_EQ(reader.names(), (std::vector<std::string>{"Near", "Far"}));
    const FrameStatement again = reader.read(0);
    ASSERT_EQ(again.targets.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
        const TargetStatement &a = again.targets[i], &b = statement.targets[i];
        EXPECT_LT((a.position - b.position).norm(), 1e-15);
        EXPECT_LT((a.covariance - b.covariance).norm(), 1e-18);
        EXPECT_NEAR(a.radius_95, b.radius_95, 1e-15);
        for (std::size_t q = 0; q < error_source_count; ++q)
            EXPECT_NEAR(a.by_source[q], b.by_source[q], 1e-18);
    }
    EXPECT_EQ(again.missing.bits(), statement.missing.bits());
    EXPECT_EQ(again.computed, 0.5);
    ASSERT_EQ(reader.surface_places().size(), 3u);
    ASSERT_EQ(again.surface.radius_95.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_LT((reader.surface_places()[i] - cube_places[i]).norm(), 1e-15);
        EXPECT_NEAR(again.surface.radius_95[i], statement.surface.radius_95[i], 1e-15);
    }
    EXPECT_EQ(again.surface.missing.bits(), statement.surface.missing.bits());
}

TEST(StatementRecord, AnyOtherBitIsAnotherStatement) {
    const ResultReader result(written(two_targets()));
    EXPECT_TRUE(holds_statement(result, 0, two_targets()));
    FrameStatement other = two_targets();
    other.targets[1].radius_95 = std::nextafter(other.targets[1].radius_95, 1);
    EXPECT_FALSE(holds_statement(result, 0, other));
    other = two_targets();
    other.missing.add(ErrorSource::law);
    EXPECT_FALSE(holds_statement(result, 0, other));
    other = two_targets();
    other.surface.radius_95[2] = std::nextafter(other.surface.radius_95[2], 1);
    EXPECT_FALSE(holds_statement(result, 0, other));
    other = two_targets();
    other.surface.missing = {};
    EXPECT_FALSE(holds_statement(result, 0, other));
    EXPECT_FALSE(holds_statement(result, 0, {})) << "the result has targets";
    const ResultReader without(written({}, ""));
    EXPECT_TRUE(holds_statement(without, 0, {}));
    EXPECT_FALSE(holds_statement(without, 0, two_targets()));
    EXPECT_TRUE(StatementReader(without, "r.h5").read(0).targets.empty());
}

TEST(StatementRecord, NumbersThatCannotBeAreRefused) {
    const auto refusal = [](const FrameStatement& statement,
                            const std::string& targets = text_of_targets({"Near", "Far"})) {
        const ResultReader result(written(statement, targets));
        return error_of([&] { (void)StatementReader(result, "r.h5").read(0); });
    };
    EXPECT_EQ(refusal(two_targets()), "");
    FrameStatement wrong = two_targets();
    wrong.targets[0].radius_95 = -1e-3;
    EXPECT_TRUE(says(refusal(wrong), {"r.h5", "target_radius_95_mm", "-1", "at least 0"}));
    wrong = two_targets();
    wrong.targets[0].position.x() = std::nan("");
    EXPECT_TRUE(says(refusal(wrong), {"target_position_mm", "not finite"}));
    wrong = two_targets();
    wrong.missing = ErrorSources::of_bits(512);
    EXPECT_TRUE(says(refusal(wrong), {"512", "below 512"}));
    wrong = two_targets();
    wrong.surface.radius_95[1] = -1e-3;
    EXPECT_TRUE(says(refusal(wrong), {"r.h5", "surface_radius_95_mm", "-1", "at least 0"}));
    wrong = two_targets();
    wrong.surface.missing = ErrorSources::of_bits(600);
    EXPECT_TRUE(says(refusal(wrong), {"600", "below 512"}));
    wrong = two_targets();
    wrong.computed = 1.5;
    EXPECT_TRUE(says(refusal(wrong), {"r.h5", "1.5", "0 to 1"}));
    wrong = two_targets();
    wrong.targets[1].covariance(2, 2) *= -1;
    EXPECT_TRUE(says(refusal(wrong), {"r.h5", "Far", "frame 0", "eigenvalue", "none below 0"}));
    wrong = two_targets();
    wrong.targets[1].by_source[2] = -1e-6;
    EXPECT_TRUE(says(refusal(wrong), {"r.h5", "target_by_source_mm2", "-1", "at least 0"}));
    wrong = two_targets();
    wrong.surface.radius_95.pop_back();
    EXPECT_NE(refusal(wrong), "") << "fewer radii than places";
    {
        const auto path = fresh_folder() / "many.h5";
        ResultWriter writer(path, testing_meshes::cube(), "");
        writer.write_text("targets", text_of_targets({"Near", "Far"}));
        write_surface_places(writer, std::vector<Vector3>(97, Vector3::Zero()));
        writer.append(0, std::vector<Vector3>(8, Vector3::Zero()));
        append_statement(writer, two_targets());
        writer.close();
        const ResultReader result(path);
        EXPECT_TRUE(says(error_of([&] { StatementReader(result, "many.h5"); }),
                         {"many.h5", "97 places", "1 to 96"}));
    }
    EXPECT_TRUE(says(refusal(two_targets(), "{\"a\": 1}"), {"not a list of names"}));
    EXPECT_NE(refusal(two_targets(), text_of_targets({"Near"})), "") << "fewer names than numbers";
}

TEST(StatementRecord, IsToldInWordsAndAsJson) {
    const std::vector<std::string> names{"Near", "Far"};
    EXPECT_EQ(statement_text(two_targets(), names),
              "error within 6.0 mm (Far), without elements (50 % computed)");
    FrameStatement whole = two_targets();
    whole.missing = {};
    whole.computed = 1;
    EXPECT_EQ(statement_text(whole, names), "error within 6.0 mm (Far)");
    EXPECT_EQ(statement_text({}, names), "");
    const nlohmann::json json = json_of(two_targets(), names);
    EXPECT_EQ(json["missing"], nlohmann::json({"elements"}));
    EXPECT_EQ(json["targets"][0]["name"], "Near");
    EXPECT_NEAR(json["targets"][1]["radius_95_mm"].get<double>(), 6, 1e-12);
    EXPECT_NEAR(json["targets"][0]["position_mm"][1].get<double>(), -20, 1e-12);
    EXPECT_NEAR(json["targets"][0]["rms_by_source_mm"]["patches"].get<double>(), std::sqrt(3.0),
                1e-12);
}

}  // namespace
}  // namespace livetet
