#include "io/sequence_file.hpp"

#include <cmath>

#include "files.hpp"

namespace livetet {
namespace {

using namespace testing_files;

const std::string identity = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";

std::string with_frames(const std::string& frames, int count) {
    return "ObjectType = Image\nNDims = 3\nDimSize = 0 0 " + std::to_string(count) +
           "   \nKinds = domain domain list\n" + frames + "ElementDataFile = LOCAL\n";
}

std::string frame(int k, const std::string& matrix, const std::string& time,
                  const std::string& status = "OK") {
    const std::string name = "Seq_Frame000" + std::to_string(k) + "_";
    return name + "StylusToTrackerTransform = " + matrix + " \n" + name +
           "StylusToTrackerTransformStatus = " + status + "\n" + name + "Timestamp = " + time +
           "\n" + name + "FrameNumber = 7\n";
}

Recording read_sequence_text(const std::string& text) {
    return read_sequence(write_bytes(fresh_folder() / "a.igs.mha", text));
}

TEST(SequenceFile, MillimetresBecomeMetresAndRowsStayRows) {
    const Recording r = read_sequence_text(
        with_frames(frame(0, "0 -1 0 10 1 0 0 -20 0 0 1 30.5 0 0 0 1", "1.5"), 1));
    ASSERT_EQ(r.tools, std::vector<std::string>{"Stylus"});
    ASSERT_EQ(r.samples.size(), 1u);
    EXPECT_EQ(r.samples[0].time_s, 1.5);
    const TrackedPose& pose = r.samples[0].poses.at(0);
    EXPECT_EQ(pose.status, PoseStatus::ok);
    EXPECT_LT((pose.translation - Eigen::Vector3d(0.010, -0.020, 0.0305)).norm(), 1e-15);
    EXPECT_NEAR(pose.rotation(1, 0), 1, 1e-15);
    EXPECT_NEAR(pose.rotation(0, 1), -1, 1e-15);
}

TEST(SequenceFile, WhatIsWrittenIsReadBack) {
    Recording r{{"Stylus", "Reference"}, {}};
    for (int k = 0; k < 12; ++k) {
        TrackerSample& sample = r.samples.emplace_back();
        sample.time_s = 280.4611428572264 + k / 15.0;
        for (const PoseStatus status :
             {PoseStatus::ok, k % 3 ? PoseStatus::missing : PoseStatus::invalid}) {
            TrackedPose pose{Eigen::AngleAxisd(0.1 + k, Eigen::Vector3d(1, 2, -3).normalized())
                                 .toRotationMatrix(),
                             Eigen::Vector3d(0.3 + k, -0.1, 1e-7), status};
            sample.poses.push_back(pose);
        }
    }
    const auto path = fresh_folder() / "written.igs.mha";
    write_sequence(path, r);
    const Recording back = read_sequence(path);
    ASSERT_EQ(back.tools, r.tools);
    ASSERT_EQ(back.samples.size(), r.samples.size());
    for (std::size_t k = 0; k < r.samples.size(); ++k) {
        EXPECT_EQ(back.samples[k].time_s, r.samples[k].time_s);
        for (std::size_t i = 0; i < 2; ++i) {
            EXPECT_EQ(back.samples[k].poses[i].status, r.samples[k].poses[i].status);
            EXPECT_LT((back.samples[k].poses[i].rotation - r.samples[k].poses[i].rotation).norm(),
                      1e-14);
            EXPECT_LT(
                (back.samples[k].poses[i].translation - r.samples[k].poses[i].translation).norm(),
                1e-14);
        }
    }
}

TEST(SequenceFile, RotationsAreMadeOrthonormal) {
    const Recording r = read_sequence_text(
        with_frames(frame(0, "1.0005 0.0003 0 0 0 0.9996 0 0 0 0 1 0 -0 0 0 1", "0"), 1));
    const Eigen::Matrix3d& m = r.samples[0].poses[0].rotation;
    EXPECT_EQ(r.samples[0].poses[0].status, PoseStatus::ok);
    EXPECT_LT((m.transpose() * m - Eigen::Matrix3d::Identity()).norm(), 1e-14);
}

TEST(SequenceFile, MatricesThatAreNoPoseAreBroken) {
    for (const char* matrix :
         {"nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "1 0 0 1e999 0 1 0 0 0 0 1 0 0 0 0 1",
          "-1.#IND 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
          "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 5 1",
          "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0"}) {
        const TrackedPose pose =
            read_sequence_text(with_frames(frame(0, matrix, "0"), 1)).samples[0].poses[0];
        EXPECT_EQ(pose.status, PoseStatus::broken) << matrix;
        EXPECT_TRUE(pose.translation.allFinite() && pose.rotation.allFinite()) << matrix;
    }
}

TEST(SequenceFile, StatusesAreMapped) {
    const std::pair<const char*, PoseStatus> cases[] = {
        {"OK ", PoseStatus::ok},
        {"INVALID", PoseStatus::invalid},
        {"MISSING", PoseStatus::missing},
        {"UNKNOWN", PoseStatus::invalid},
        {"OUT_OF_VIEW", PoseStatus::missing},
        {"OUT_OF_VOLUME", PoseStatus::out_of_volume},
        {"whatever", PoseStatus::invalid},
        {"REQ_TIMEOUT", PoseStatus::stale}};
    for (const auto& [word, status] : cases)
        EXPECT_EQ(read_sequence_text(with_frames(frame(0, identity, "0", word), 1))
                      .samples[0]
                      .poses[0]
                      .status,
                  status)
            << word;
}

TEST(SequenceFile, OtherTransformsAreSkippedAndAnAbsentToolIsMissing) {
    const std::string more =
        "Seq_Frame0001_ProbeToReferenceTransform = not even numbers\n"
        "Seq_Frame0001_NeedleToTrackerTransform = " +
        identity + "\n";
    const Recording r = read_sequence_text(
        with_frames(frame(0, identity, "0") + frame(1, identity, "0") + more, 2));
    ASSERT_EQ(r.tools, (std::vector<std::string>{"Stylus", "Needle"}));
    EXPECT_EQ(r.samples[0].poses[1].status, PoseStatus::missing);
    EXPECT_EQ(r.samples[1].poses[1].status, PoseStatus::ok);
}

TEST(SequenceFile, TimeDoesNotGoBackwards) {
    const std::string text = with_frames(frame(0, identity, "1") + frame(1, identity, "0.5"), 2);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(text); }),
                     {"a.igs.mha", "frame 1", "Timestamp", "0.5", "backwards"}));
}

TEST(SequenceFile, MalformedFieldsAreNamed) {
    const std::string short_row = with_frames(frame(0, "1 0 0", "1"), 1);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(short_row); }),
                     {"frame 0", "StylusToTrackerTransform", "found 3", "16"}));
    const std::string word = with_frames(frame(0, "1 0 0 0 0 one 0 0 0 0 1 0 0 0 0 1", "1"), 1);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(word); }),
                     {"frame 0", "StylusToTrackerTransform", "'one'"}));
    const std::string time = with_frames(frame(0, identity, "inf"), 1);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(time); }), {"frame 0", "Timestamp", "inf"}));
    const std::string index = with_frames("Seq_Framexx_Timestamp = 1\n", 1);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(index); }),
                     {"a.igs.mha:5", "Seq_Framexx_Timestamp"}));
    const std::string twice = with_frames(frame(0, identity, "1") + frame(0, identity, "1"), 1);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(twice); }), {"frame 0", "twice"}));
    const std::string no_matrix = with_frames(
        frame(0, identity, "1") +
            "Seq_Frame0001_StylusToTrackerTransformStatus = OK\nSeq_Frame0001_Timestamp = 2\n",
        2);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(no_matrix); }),
                     {"frame 1", "Status = OK", "16 numbers"}));
}

TEST(SequenceFile, FramesMustBeAllThere) {
    const std::string one = frame(0, identity, "1");
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(with_frames(one, 3)); }),
                     {"frame 1 is missing", "3"}));
    EXPECT_TRUE(
        says(error_of([&] { read_sequence_text(with_frames(one + frame(7, identity, "2"), 1)); }),
             {"found frame 7"}));
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(with_frames("", 3)); }),
                     {"no tool", "no transforms"}));
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(""); }), {"expected ObjectType"}));
    const std::string none =
        with_frames("Seq_Frame0000_ProbeToReferenceTransform = " + identity + "\n", 1);
    EXPECT_TRUE(says(error_of([&] { read_sequence_text(none); }), {"only ProbeToReference"}));
}

TEST(SequenceFile, EveryTruncationIsAnError) {
    Recording r{{"Stylus"}, {}};
    for (int k = 0; k < 5; ++k) r.samples.push_back({0.1 * k, {TrackedPose{}}});
    const auto path = fresh_folder() / "whole.igs.mha";
    write_sequence(path, r);
    const auto size = std::filesystem::file_size(path);
    const auto cut = path.parent_path() / "cut.igs.mha";
    for (std::uintmax_t n = 0; n + 10 < size; n += 7) {
        std::filesystem::copy_file(path, cut, std::filesystem::copy_options::overwrite_existing);
        std::filesystem::resize_file(cut, n);
        EXPECT_TRUE(says(error_of([&] { read_sequence(cut); }), {"cut.igs.mha"})) << n << " bytes";
    }
}

TEST(SequenceFile, WrongNamesAndFoldersAreErrors) {
    const auto folder = fresh_folder();
    EXPECT_TRUE(
        says(error_of([&] { read_sequence(folder / "a.csv"); }), {"a.csv", ".csv", ".mha"}));
    EXPECT_TRUE(
        says(error_of([&] { read_sequence(folder / "none.mha"); }), {"none.mha", "no such file"}));
    EXPECT_TRUE(says(error_of([&] { read_sequence(folder); }), {"expected a PLUS sequence"}));
    EXPECT_TRUE(says(error_of([&] {
                         write_sequence(folder / "no" / "a.mha", {{"A"}, {}});
                     }),
                     {"no folder"}));
    EXPECT_TRUE(says(error_of([&] {
                         write_sequence(folder / "a.nrrd", {{"A"}, {}});
                     }),
                     {".igs.mha"}));
    write_bytes(folder / "t.nrrd", "NRRD0005\nsizes: 1 1 1\nSeq_Frame0000_Timestamp:=1");
    EXPECT_TRUE(
        says(error_of([&] { read_sequence(folder / "t.nrrd"); }), {"frame 0", "truncated"}));
    write_bytes(folder / "s.nrrd", "NRRD0005\nsizes: 1 1 2\naxis 0 index values:=0 1\n\n");
    EXPECT_TRUE(says(error_of([&] { read_sequence(folder / "s.nrrd"); }), {"s.nrrd:3", "Slicer"}));
}

TEST(SequenceFile, RealRecordingOfAnElectromagneticTracker) {
    LIVETET_DATA_OR_SKIP(data);
    const auto path = data / "tracker" / "EightLandmarkPointsTrackedForPhantomRegistration.igs.mha";
    const Recording r = read_sequence(path);
    EXPECT_EQ(r.tools, (std::vector<std::string>{"Reference", "Stylus"}));
    ASSERT_EQ(r.samples.size(), 1000u);
    EXPECT_NEAR(r.samples.back().time_s - r.samples.front().time_s, 66.6, 0.05);
    EXPECT_NEAR(r.samples[0].poses[1].translation.x(), 0.31555283203125, 1e-12);
    EXPECT_NEAR(r.samples[0].poses[1].rotation(0, 2), -0.6342950669272663, 1e-3);
}

TEST(SequenceFile, RealRecordingsWithPixelsAgreeInBothFormats) {
    LIVETET_DATA_OR_SKIP(data);
    const Recording a = read_sequence(data / "tracker" / "NwirePhantomFreehand.igs.mha");
    const Recording b = read_sequence(data / "tracker" / "NwirePhantomFreehand.igs.nrrd");
    ASSERT_EQ(a.samples.size(), 97u);
    ASSERT_EQ(b.samples.size(), 97u);
    ASSERT_EQ(a.tools, b.tools);
    int invalid = 0;
    for (std::size_t k = 0; k < 97; ++k)
        for (std::size_t i = 0; i < a.tools.size(); ++i) {
            invalid += a.samples[k].poses[i].status == PoseStatus::invalid;
            EXPECT_EQ(a.samples[k].poses[i].status, b.samples[k].poses[i].status);
            EXPECT_EQ(a.samples[k].poses[i].translation, b.samples[k].poses[i].translation);
        }
    EXPECT_GE(invalid, 97);  // the stylus is out of view the whole time
}

TEST(SequenceFile, OldTrackerOnlyFilesWithPixelsOfOneAreRead) {
    LIVETET_DATA_OR_SKIP(data);
    const Recording r = read_sequence(data / "tracker" / "SyntheticTrackerBuffer20.igs.mha");
    ASSERT_EQ(r.samples.size(), 20u);
    EXPECT_NEAR(r.samples[2].poses[0].translation.z(), 0.032, 1e-15);
    EXPECT_EQ(read_sequence(data / "tracker" / "SlidingProbeTrackingData.igs.mha").samples.size(),
              85u);
    EXPECT_EQ(read_sequence(data / "tracker" / "ReferenceToRASCalibration.igs.mha").samples.size(),
              93u);
}

}  // namespace
}  // namespace livetet
