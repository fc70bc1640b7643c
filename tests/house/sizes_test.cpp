// No function is longer than 80 lines, no class has more than 25 data members.
#include "house/sizes.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "house/source_tree.hpp"

namespace livetet::house {
namespace {

constexpr int max_lines = 80;
constexpr int max_members = 25;

std::vector<std::string> too_large(std::vector<Size> Sizes::*kind, int limit, const char* unit) {
    std::vector<std::string> found;
    for (const auto& [file, text] : read_sources(tree_root())) {
        const auto sizes = measure(text);
        for (const auto& [head, line, size] : sizes.*kind) {
            if (size > limit) {
                found.push_back(fmt::format("{}:{}: {} ({} {}, at most {})", file, line, head, size,
                                            unit, limit));
            }
        }
    }
    return found;
}

TEST(Sizes, FunctionsOfTheTreeFitAScreenOrTwo) {
    const auto found = too_large(&Sizes::functions, max_lines, "lines");
    EXPECT_TRUE(found.empty()) << lines(found);
}

TEST(Sizes, ClassesOfTheTreeHaveFewMembers) {
    const auto found = too_large(&Sizes::classes, max_members, "data members");
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
