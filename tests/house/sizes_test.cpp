// No function is longer than 80 lines, no class has more than 25 data members.
#include "house/sizes.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "house/source_tree.hpp"

namespace livetet::house {
namespace {

constexpr int max_lines = 80;
constexpr int max_members = 25;

/// `file: head` of what is to be cut yet; an entry that is no longer needed fails the test.
const std::set<std::string> allowed_functions{
    "apps/bench/convergence_bench.cpp: int bench_convergence(const ConvergenceArguments& a)",
    "apps/bench/latency_bench.cpp: int bench_latency(const LatencyArguments& arguments)",
    "apps/bench/realtime_phantom.cpp: WorkPrecisionChart measure_methods(const PhantomSize& size, "
    "const MeshHierarchy& hierarchy, int threads, ProgressLine& progress)",
    "apps/bench/scaling_bench.cpp: int bench_scaling(const ScalingArguments& a)",
    "apps/commands/bench.cpp: void add_bench_command(CLI::App& app, ExitStatus& status)",
    "apps/commands/main.cpp: int main(int argc, char** argv)",
    "apps/commands/mesh.cpp: void add_mesh_command(CLI::App& app)",
    "apps/commands/solve.cpp: int solve(const SolveArguments& arguments, const std::vector<>& "
    "petsc)",
    "apps/commands/track.cpp: int run_track(const TrackArguments& arguments, const std::vector<>& "
    "petsc, const GuestMaker& make_guest)",
    "apps/commands/warp.cpp: void run(const WarpArguments& a)",
    "apps/scene/scene.cpp: void finish_scene(Scene& scene, const std::string& file, const "
    "std::filesystem::path& folder)",
    "apps/simulation/scene_run.cpp: RunHistory run_dynamic(const Scene& scene, SceneBody& "
    "scene_body, SceneConstraints& constraints, const RunHooks& hooks)",
    "apps/study/study_store.cpp: void write_study(const Study& study, const StudyStore& store, "
    "const ProgressCallback& progress)",
};
const std::set<std::string> allowed_classes{
    "apps/bench/realtime_result.hpp: struct RealtimeResult",
    "apps/viewer/window.hpp: class ViewWindow",
};

std::vector<std::string> too_large(std::vector<Size> Sizes::*kind, int limit, const char* unit,
                                   std::set<std::string> allowed) {
    std::vector<std::string> found;
    for (const auto& [file, text] : read_sources(tree_root())) {
        const auto sizes = measure(text);
        for (const auto& [head, line, size] : sizes.*kind) {
            if (size > limit && !allowed.erase(fmt::format("{}: {}", file, head))) {
                found.push_back(fmt::format("{}:{}: {} ({} {}, at most {})", file, line, head, size,
                                            unit, limit));
            }
        }
    }
    for (const auto& entry : allowed) {
        found.push_back("allowed without need: " + entry);
    }
    return found;
}

TEST(Sizes, FunctionsOfTheTreeFitAScreenOrTwo) {
    const auto found = too_large(&Sizes::functions, max_lines, "lines", allowed_functions);
    EXPECT_TRUE(found.empty()) << lines(found);
}

TEST(Sizes, ClassesOfTheTreeHaveFewMembers) {
    const auto found = too_large(&Sizes::classes, max_members, "data members", allowed_classes);
    EXPECT_TRUE(found.empty()) << lines(found);
}

std::string told(const std::vector<Size>& sizes) {
    std::string text;
    for (const auto& [head, line, size] : sizes) {
        text += fmt::format("{}|{}|{}\n", line, size, head);
    }
    return text;
}

TEST(Sizes, FunctionsAreCountedFromTheirDeclarationToTheirBrace) {
    EXPECT_EQ(told(measure(R"(// a {
#include "b"
namespace a::b {
namespace {
template <class T, int n = 3>
T sum(std::span<const T> values,
      int start) {
    for (auto v : values) {
        start += v;
    }
    return start;
}
}  // namespace
Foo::Foo(int a, std::vector<int> b)
    : a_{a}, b_(std::move(b)), c_{} {
    run([&] { return '}'; });
}
bool operator<(const Foo& a, const Foo& b) { return a.a_ < b.a_; }
const std::map<int, std::string> table{
    {1, "}"},
    {2, "{"},
};
const auto lambda = [](int a) {
    return a;
};
auto f(Options options = {}) -> std::vector<int> {
    return {};
}
TEST(Group, Name) {
    const char* raw = R"_(})_";
    const int big = 1'000'000;
}
}  // namespace a::b
)")
                       .functions),
              "5|8|T sum(std::span<> values, int start)\n"
              "14|4|Foo::Foo(int a, std::vector<> b) : a_{}, b_(std::move(b)), c_{}\n"
              "18|1|bool operator<(const Foo& a, const Foo& b)\n"
              "23|3|const auto lambda = [](int a)\n"
              "26|3|auto f(Options options = {}) -> std::vector<>\n"
              "29|4|TEST(Group, Name)\n");
}

TEST(Sizes, DataMembersAreCountedAndNothingElse) {
    EXPECT_EQ(told(measure(R"(
template <class T>
class [[nodiscard]] Many : public Base<T> {
  public:
    enum class Mode { one, two };
    struct Inner {
        int a, b = 2;
        double c[3]{};
    };
    using X = int;
    Many(int a) : a_{a}, b_(a) {}
    std::vector<int> get(int a, int b) const;
    int run() override;
    bool operator==(const Many&) const = default;
    friend class Other;
    static constexpr int n = 3;

  private:
    int a_, b_ = 1, c_{2};
    std::function<void(int, int)> callback_;
    std::map<int, std::vector<int>> map_ = make(1, 2);
    void (*pointer_)(int) = nullptr;
    PetscHandle<Vec> u_, v_;  // two, three, four
    std::array<double, 2> pair_{{1, 2}};
};
)")
                       .classes),
              "6|3|struct Inner\n"
              "2|9|class Many : public Base<>\n");
}

}  // namespace
}  // namespace livetet::house
