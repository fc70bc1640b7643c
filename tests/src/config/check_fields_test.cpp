#include "config/check_fields.hpp"

#include <gtest/gtest.h>

#include "mechanics/material.hpp"
#include "mechanics/materials/registry.hpp"
#include "mechanics/time_scheme.hpp"

namespace livetet {
namespace {

template <class S>
std::string table_refusal(const S& table) {
    try {
        check_fields(table, "table.");
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

TEST(CheckFields, AcceptsDefaults) {
    EXPECT_EQ(table_refusal(Material{}), "accepted");
    EXPECT_EQ(table_refusal(TimeOptions{}), "accepted");
}

TEST(CheckFields, SaysKeyValueAndLimit) {
    EXPECT_EQ(table_refusal(Material{.young_Pa = -1}),
              "table.young_Pa = -1 Pa must be greater than 0");
    EXPECT_EQ(table_refusal(Material{.young_Pa = std::nan("")}),
              "table.young_Pa = nan Pa must be greater than 0");
    EXPECT_EQ(table_refusal(Material{.young_Pa = HUGE_VAL}),
              "table.young_Pa = inf Pa must be greater than 0");
    EXPECT_EQ(table_refusal(Material{.young_Pa = {100, 100}}),
              "table.young_Pa = 100 +- 100 Pa must be greater than 0, from value - spread = 0 to "
              "value + spread = 200");
    EXPECT_EQ(table_refusal(Material{.region = -2}), "table.region = -2 must be at least 0");
}

TEST(CheckFields, RefusesWhatIsNoValueOfAnEnumeration) {
    EXPECT_EQ(table_refusal(TimeOptions{.scheme = static_cast<TimeScheme>(17)}),
              "table.scheme must be one of static, euler, newmark, generalized_alpha");
}

/// The parameters of a constitutive model are fields of its own.
TEST(CheckFields, ChecksTheKeysOfAVariant) {
    struct Spoiler {
        std::string key;
        void field(std::string_view k, double& value, std::string_view, std::string_view,
                   Check<double>) {
            if (key.empty()) key = k, value = std::nan("");
        }
        void field(std::string_view, Eigen::Vector3d&, std::string_view, std::string_view,
                   Check<Eigen::Vector3d>) {}
        void field(std::string_view, std::optional<Eigen::Vector3d>&, std::string_view,
                   std::string_view, Check<Eigen::Vector3d>) {}
    } spoiler;
    Material material{.model = "holzapfel_gasser_ogden"};
    EXPECT_EQ(table_refusal(material), "accepted");
    visit_keys(spoiler, material.model);
    EXPECT_EQ(table_refusal(material).find("table." + spoiler.key + " = nan"), 0u)
        << table_refusal(material);
}

}  // namespace
}  // namespace livetet
