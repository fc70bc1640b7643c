#include "io/fiducial_file.hpp"

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "files.hpp"
#include "io/points_csv.hpp"

namespace livetet {
namespace {

using namespace testing_files;

std::vector<NamedPoint> read_markups(const std::string& text) {
    return read_fiducials(write_bytes(fresh_folder() / "f.mrk.json", text));
}
std::vector<NamedPoint> read_fcsv(const std::string& text) {
    return read_fiducials(write_bytes(fresh_folder() / "f.fcsv", text));
}
std::string markups(const std::string& points, const std::string& more = "") {
    return R"({"markups":[{"type":"Fiducial",)" + more + R"("controlPoints":[)" + points + "]}]}";
}
void expect_at(const NamedPoint& point, const std::string& name, double x, double y, double z) {
    EXPECT_EQ(point.name, name);
    EXPECT_LT((point.position - Eigen::Vector3d(x, y, z)).norm(), 1e-15)
        << point.position.transpose();
}

TEST(FiducialFile, MarkupsAreLpsUnlessTheySayRas) {
    const std::string point = R"({"label":"F-1","position":[10,20,-30.5]})";
    expect_at(read_markups(markups(point)).at(0), "F-1", -0.010, -0.020, -0.0305);
    expect_at(read_markups(markups(point, R"("coordinateSystem":"LPS",)")).at(0), "F-1", -0.010,
              -0.020, -0.0305);
    expect_at(read_markups(markups(point, R"("coordinateSystem":"RAS",)")).at(0), "F-1", 0.010,
              0.020, -0.0305);
    EXPECT_TRUE(
        says(error_of([&] { read_markups(markups(point, R"("coordinateSystem":"XYZ",)")); }),
             {"'XYZ'", "LPS"}));
}

TEST(FiducialFile, PointsThatAreNotPlacedAreSkipped) {
    const auto points =
        read_markups(markups(R"({"label":"a","positionStatus":"undefined","position":[]},
        {"label":"b","positionStatus":"defined","position":[0,0,1]},{"label":"c","positionStatus":"preview"})"));
    ASSERT_EQ(points.size(), 1u);
    expect_at(points[0], "b", 0, 0, 1e-3);
}

TEST(FiducialFile, MalformedMarkupsAreErrors) {
    const auto refuses = [](const std::string& text, std::initializer_list<const char*> words) {
        EXPECT_TRUE(says(error_of([&] { read_markups(text); }), words)) << text;
    };
    refuses("", {"f.mrk.json", "not JSON"});
    refuses(markups(R"({"label":"F","position":[1,2,3]})").substr(0, 60),
            {"not JSON", "truncated"});
    refuses("[]", {"\"markups\""});
    refuses(R"({"markups":[3]})", {"\"controlPoints\""});
    refuses(markups(""), {"no placed point"});
    refuses(markups("7"), {"control point 1", "not an object"});
    refuses(markups(R"({"label":"F","position":[1,2]})"), {"control point 1 ('F')", "three"});
    refuses(markups(R"({"label":"F","position":[1,2,null]})"), {"control point 1 ('F')", "null"});
    refuses(markups(R"({"label":8,"position":[1,2,3]})"), {"control point 1", "\"label\" is 8"});
    refuses(markups(R"({"label":"F","position":[1,2,1e999]})"), {"f.mrk.json"});
}

TEST(FiducialFile, FcsvOfBothStylesAreRead) {
    const auto recent = read_fcsv(
        "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
        "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
        "1,10.5,-20,30,0,0,0,1,1,1,0,\"F \"\"one\"\", left\",,\r\n2,1,2,3,0,0,0,1,1,1,0,,,\n");
    ASSERT_EQ(recent.size(), 2u);
    expect_at(recent[0], "F \"one\", left", -0.0105, 0.020, 0.030);
    expect_at(recent[1], "2", -0.001, -0.002, 0.003);
    expect_at(read_fcsv("# CoordinateSystem = 0\n# columns = id,x,y,z,label\n1,1,2,3,A\n").at(0),
              "A", .001, .002, .003);
    expect_at(read_fcsv("# CoordinateSystem = 1\n# columns = id,x,y,z,label\n1,1,2,3,A\n").at(0),
              "A", -.001, -.002, .003);
    expect_at(read_fcsv("# numPoints = 1\nA,1,2,3,1,1\n").at(0), "A", 0.001, 0.002, 0.003);
}

TEST(FiducialFile, MalformedFcsvAreErrorsWithTheirLine) {
    const auto refuses = [](const std::string& text, std::initializer_list<const char*> words) {
        EXPECT_TRUE(says(error_of([&] { read_fcsv(text); }), words)) << text;
    };
    refuses("# numPoints = 1\nA,1,2\n", {"f.fcsv:2", "3 cells"});
    refuses("A,1,x,3\n", {"f.fcsv:1", "'x'"});
    refuses("A,1,nan,3\n", {"f.fcsv:1", "not finite"});
    refuses("\"A,1,2,3\n", {"f.fcsv:1", "quote"});
    refuses("# columns = id,x,z,y,label\n", {"f.fcsv:1", "x,y,z"});
    refuses("# columns = id,x,z,label\n", {"f.fcsv:1", "expected y"});
    refuses("# nothing\n", {"no placed point"});
}

TEST(FiducialFile, WhatIsWrittenIsReadBackAndIsLps) {
    const std::vector<NamedPoint> points{{"F-1", {0.01, -0.02, 0.03}},
                                         {"with \"quotes\"", {1e-9, 0.1, -7}}};
    const auto path = fresh_folder() / "p.mrk.json";
    write_fiducials(path, points);
    const auto back = read_fiducials(path);
    ASSERT_EQ(back.size(), 2u);
    for (int i = 0; i < 2; ++i)
        expect_at(back[i], points[i].name, points[i].position.x(), points[i].position.y(),
                  points[i].position.z());
    const auto json = nlohmann::json::parse(read_text_file(path));
    EXPECT_TRUE(json["@schema"].get<std::string>().ends_with("markups-schema-v1.0.3.json#"));
    EXPECT_EQ(json["markups"][0]["coordinateSystem"], "LPS");
    EXPECT_NEAR(json["markups"][0]["controlPoints"][0]["position"][1].get<double>(), 20, 1e-12);
    EXPECT_TRUE(says(error_of([&] { write_fiducials(path.parent_path() / "p.json", points); }),
                     {".mrk.json"}));
    EXPECT_TRUE(says(error_of([&] {
                         write_fiducials(path, {{"n", {0, NAN, 0}}});
                     }),
                     {"'n'", "finite"}));
    EXPECT_EQ(read_fiducials(path).size(), 2u) << "a failed write leaves the old file";
}

TEST(FiducialFile, RealFcsv) {
    LIVETET_DATA_OR_SKIP(data);
    const auto points = read_fiducials(data / "tracker" / "FcsvReaderTest1.fcsv");
    ASSERT_EQ(points.size(), 18u);
    expect_at(points[0], "L-P", -0.209934, -0.223544, 0.077);
}

TEST(PointsCsv, PointsAreReadBackWithTheirNames) {
    const std::vector<NamedPoint> points{{"a", {0.01, -0.02, 0.03}},
                                         {"b, \"the other\"", {0, 0, 1}}};
    const auto path = fresh_folder() / "p.csv";
    write_points_csv(path, points);
    const auto back = read_points_csv(path);
    ASSERT_EQ(back.size(), 2u);
    expect_at(back[0], "a", 0.01, -0.02, 0.03);
    expect_at(back[1], "b, \"the other\"", 0, 0, 1);
    EXPECT_EQ(read_text_file(path).substr(0, 31), "name,x_mm,y_mm,z_mm\na,10,-20,30");
}

TEST(PointsCsv, DisplacementsStandBesideTheirPoints) {
    const auto path = fresh_folder() / "u.csv";
    const std::vector<NamedPoint> points{{"a", {0.5, 0, 0}}};
    write_displacements_csv(path, points, std::vector<Eigen::Vector3d>{{0.001, -0.002, 0.25}});
    EXPECT_EQ(read_text_file(path), "name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm\na,500,0,0,1,-2,250\n");
    EXPECT_EQ(read_points_csv(path).size(), 1u) << "more columns are ignored";
    EXPECT_TRUE(says(error_of([&] { write_displacements_csv(path, points, {}); }),
                     {"0 displacements for 1"}));
}

TEST(PointsCsv, MalformedLinesAreNamed) {
    const auto refuses = [](const std::string& text, std::initializer_list<const char*> words) {
        const auto path = write_bytes(fresh_folder() / "p.csv", text);
        EXPECT_TRUE(says(error_of([&] { read_points_csv(path); }), words)) << text;
    };
    const std::string head = "\xEF\xBB\xBFname, x_mm, y_mm, z_mm\r\n# a comment\n";
    refuses("a,1,2,3\n", {"p.csv:1", "expected the header", "add this line above"});
    refuses("id,x_mm,y_mm,z_mm\na,1,2,3\n", {"p.csv:1", "rename 'id' to 'name'"});
    refuses("label,x,y,z\na,1,2,3\n", {"rename 'label' to 'name', 'x' to 'x_mm'"});
    refuses(head, {"no point"});
    refuses(head + "a,1,2\n", {"p.csv:3", "3 cells"});
    refuses(head + "a,1,2,inf\n", {"p.csv:3", "'inf'"});
    refuses(head + "a,1,2,3 mm\n", {"p.csv:3", "'3 mm'"});
    refuses(head + "a,1,2,3\na,1,2,4\n", {"p.csv:4", "'a' twice"});
}

}  // namespace
}  // namespace livetet
