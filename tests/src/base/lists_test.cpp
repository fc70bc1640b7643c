#include "base/lists.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

std::vector<std::int32_t> list_of(const Lists& lists, std::size_t list) {
    const auto items = lists[list];
    return {items.begin(), items.end()};
}

TEST(MakeLists, KeepsTheOrderWithinEachListHoweverTheListsAreMixed) {
    using Items = std::vector<std::int32_t>;
    const Lists lists = make_lists(4, [](auto&& add) {
        add(2, 7);
        add(0, 5);
        add(2, 3);
        add(3, 7);
        add(2, 9);
    });
    EXPECT_EQ(lists.start, (Items{0, 1, 1, 4, 5}));
    EXPECT_EQ(list_of(lists, 0), Items{5});
    EXPECT_EQ(list_of(lists, 1), Items{});
    EXPECT_EQ(list_of(lists, 2), (Items{7, 3, 9}));
    EXPECT_EQ(list_of(lists, 3), Items{7});
}

TEST(MakeLists, TakesNoListsAndNoItems) {
    EXPECT_EQ(make_lists(0, [](auto&&) {}).start, std::vector<std::int32_t>{0});
    const Lists empty = make_lists(2, [](auto&&) {});
    EXPECT_TRUE(empty.items.empty());
    EXPECT_TRUE(empty[0].empty() && empty[1].empty());
}

}  // namespace
}  // namespace livetet
