#include "mechanics/materials/registry.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.hpp"
#include "config/yaml.hpp"
#include "mechanics/material.hpp"
#include "mechanics/materials/mooney_rivlin.hpp"
#include "mechanics/materials/neohookean.hpp"

namespace livetet {
namespace {

/// Neo-Hookean with mu times `factor`: no more than a model has to have. By its default it is one
/// that the tests of all registered models hold for.
class Scaled : public ConstitutiveModel {
  public:
    double factor = 1;

    Names names() const override { return {"scaled", "scaled", "a test's own"}; }
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<Scaled>(*this);
    }
    void visit_keys(FieldVisitor& v) override {
        v.field("factor", factor, "1", "times mu", greater_than<0>());
    }
    double shear_energy(double mu, const Matrix3& H, const Matrix3& R) const override {
        return NeoHookean().shear_energy(factor * mu, H, R);
    }
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3& R) const override {
        return NeoHookean().shear_stress(factor * mu, H, R);
    }
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3& R,
                                   const Matrix3& dF) const override {
        return NeoHookean().shear_stress_increment(factor * mu, p, H, R, dF);
    }
};

struct Materials {
    std::vector<Material> materials;
};

template <class Visitor>
void visit_fields(Visitor& v, Materials& m) {
    v.list("materials", m.materials, "what it is made of");
}

Material read_material(const std::string& material) {
    return read_yaml<Materials>("materials:\n  - {" + material + "}\n", "liver.yaml")
        .materials.at(0);
}

std::string refused_material(const std::string& material) {
    try {
        read_material(material);
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

TEST(Registry, NamesEachModelOnce) {
    std::vector<std::string_view> names;
    for (const ConstitutiveModel* model : registered_materials()) {
        EXPECT_EQ(&registered_material(model->name()), model);
        EXPECT_EQ(std::count(names.begin(), names.end(), model->name()), 0);
        names.push_back(model->name());
    }
    EXPECT_THROW((void)registered_material("jelly"), Error);
}

TEST(Registry, AMaterialReadsTheKeysOfItsModelAndWritesThemBack) {
    EXPECT_FALSE(read_material("young_Pa: 2").model);
    const Material m = read_material("model: mooney_rivlin, c01_share: 0.7, region: 2");
    EXPECT_EQ(m.model.name(), "mooney_rivlin");
    EXPECT_EQ(dynamic_cast<const MooneyRivlin&>(*m.model).c01_share, 0.7);
    const Material back = read_yaml<Materials>(to_yaml(Materials{{m}}), "y").materials.at(0);
    EXPECT_EQ(dynamic_cast<const MooneyRivlin&>(*back.model).c01_share, 0.7);
    EXPECT_EQ(back.region, 2);
}

TEST(Registry, ACopyOfAMaterialHasParametersOfItsOwn) {
    MooneyRivlin rubber;
    rubber.c01_share = 0.4;
    Material a{.model = rubber};
    const Material b = a;
    a.model = "mooney_rivlin";
    EXPECT_EQ(dynamic_cast<const MooneyRivlin&>(*b.model).c01_share, 0.4);
    EXPECT_EQ(dynamic_cast<const MooneyRivlin&>(*a.model).c01_share, MooneyRivlin().c01_share);
}

TEST(Registry, BadInputIsOneLineWithItsPlace) {
    EXPECT_EQ(refused_material("model: mooney_rivlin, c01_share: 1.5"),
              "materials[0].c01_share = 1.5 must be from 0 to 1 (liver.yaml:2)");
    EXPECT_EQ(refused_material("c01_share: 0.5"),
              "materials[0].c01_share belongs to model: mooney_rivlin, found no model "
              "(liver.yaml:2)");
    EXPECT_EQ(refused_material("model: green, k2: 1"),
              "materials[0].k2 belongs to model: holzapfel_gasser_ogden, found model: green "
              "(liver.yaml:2)");
    EXPECT_EQ(refused_material("model: holzapfel_gasser_ogden, fibre_1: [0, 0, 0]"),
              "materials[0].fibre_1 = [0, 0, 0] must be a direction, not of length 0 "
              "(liver.yaml:2)");
    EXPECT_EQ(refused_material("model: holzapfel_gasser_ogden, dispersion: 0.5"),
              "materials[0].dispersion = 0.5 must be from 0 to 1/3 (liver.yaml:2)");
    EXPECT_EQ(refused_material("model: holzapfel_gasser_ogden, k_2: 1"),
              "unknown key materials[0].k_2, did you mean materials[0].k2? (liver.yaml:2)");
    EXPECT_TRUE(refused_material("model: jelly")
                    .starts_with("materials[0].model = jelly must be one of linear, corotated, "
                                 "green, neohookean, mooney_rivlin, holzapfel_gasser_ogden"));
}

TEST(Registry, TheReferenceHasTheKeysOfEveryModel) {
    const std::string reference = reference_of<Materials>();
    for (ModelChoice& model : ModelChoice::alternatives()) {
        EXPECT_NE(reference.find(fmt::format("{}: {}", model.name(), model.meaning())),
                  std::string::npos);
        for (const std::string& key : keys_of(model))
            EXPECT_NE(reference.find("\n  " + key + ": "), std::string::npos) << key;
    }
}

/// Hooke's law by the rotation, but of a model that has none: batches would compute it with R = I.
class Contradictory final : public Scaled {
  public:
    Names names() const override { return {"contradictory", "contradictory", "a test's own"}; }
    bool is_hooke_by_rotation() const override { return true; }
};

/// Corotated, without a tangent of its own.
class Unfinished final : public Scaled {
  public:
    Kinematics kinematics() const override { return Kinematics::corotated; }
};

TEST(Registry, TraitsThatWouldComputeAnotherMaterialAreRefused) {
    EXPECT_THROW(register_material(std::make_unique<Contradictory>()), Error);
    for (const ConstitutiveModel* model : registered_materials())
        EXPECT_NE(model->name(), "contradictory");
    EXPECT_THROW((void)Unfinished().shear_tangent(1, 0, Eigen::Matrix3d::Zero(), Tangent::exact),
                 std::logic_error);
}

TEST(Registry, AProgramAddsAModelOfItsOwn) {
    register_material(std::make_unique<Scaled>());
    EXPECT_EQ(registered_materials().back()->name(), "scaled");
    EXPECT_THROW(register_material(std::make_unique<Scaled>()), Error);
    const Material m = read_material("model: scaled, factor: 3");
    EXPECT_EQ(dynamic_cast<const Scaled&>(*m.model).factor, 3);
    EXPECT_NE(reference_of<Materials>().find("# with model: scaled"), std::string::npos);
    // It has no tangent of its own.
    const Eigen::Matrix3d H = Eigen::Vector3d(0.2, -0.4, 0.1).asDiagonal();
    for (const Tangent kind : {Tangent::exact, Tangent::positive})
        EXPECT_LT(
            (m.model->shear_tangent(2, -9, H, kind) - NeoHookean().shear_tangent(6, -9, H, kind))
                .norm(),
            1e-12);
}

}  // namespace
}  // namespace livetet
