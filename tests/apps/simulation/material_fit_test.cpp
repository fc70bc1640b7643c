// Materials found from landmarks of a loaded block, against the values of the truth.

#include "apps/simulation/material_fit.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "apps/scene/scene_forces.hpp"
#include "base/error.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

constexpr double young_1 = 3000, young_2 = 9000, noise_m = 0.0002;

/// A block of 80 x 40 x 40 mm on a fixed or soft floor, its halves along x of two materials, that
/// is pulled sideways and up at its top.
struct TwoMaterials {
    MeshHierarchy hierarchy;
    Scene scene;
    std::vector<MeasuredLandmark> landmarks;  ///< 33 nodes of the surface, measured without noise

    explicit TwoMaterials(const char* strain = "neohookean", bool soft = false) {
        TetMesh mesh = test::block({8, 4, 4}, {0.08, 0.04, 0.04});
        for (const Tet& t : mesh.tets) {
            double x = 0;
            for (const std::int32_t n : t) x += mesh.nodes[n].x() / 4;
            mesh.regions.push_back(x < 0.04 ? 1 : 2);
        }
        hierarchy = make_hierarchy({mesh}, "two materials");
        scene.strain = strain;
        scene.solver.kind = SolverKind::direct;
        scene.solver.newton_tolerance = 1e-8;
        FixOptions floor;
        floor.half_space_mm = {0, 0, 0.1, 0, 0, 1};
        if (soft) floor.stiffness_N_per_m = 400;
        scene.fix = {floor};
        for (const double x : {20.0, 60.0}) {
            LoadOptions load;
            load.box_mm = {x - 21, -1, 39, x + 21, 41, 41};
            load.force_N = {0.6, 0.2, 0.4};
            scene.loads.push_back(load);
        }
        DeformOptions deform;
        deform.landmark_error_mm = 1e3 * noise_m;
        scene.deform = deform;
        set_materials(young_1, young_2, 0.4);
        measure();
        Material one{.young_Pa = {5000, 4000}, .poisson = 0.4, .region = 1}, two = one;
        two.region = 2;
        scene.materials = {one, two};
    }
    void set_materials(double one, double two, double poisson) {
        scene.materials = {{.young_Pa = one, .poisson = poisson, .region = 1},
                           {.young_Pa = two, .poisson = poisson, .region = 2}};
    }
    void measure() {
        SceneBody body = make_body(PETSC_COMM_SELF, scene, MeshHierarchy(hierarchy), Use::solve);
        SceneConstraints constraints(scene, body.mesh());
        EXPECT_TRUE(run_scene(scene, *body.body, constraints, scene_forces(scene, body.mesh()), {})
                        .converged);
        const std::vector<Vector3> u = body.body->displacement();
        std::vector<std::int32_t> surface = surface_nodes(body.mesh());
        std::erase_if(surface, [&](std::int32_t n) { return body.mesh().nodes[n].z() < 0.001; });
        landmarks.clear();
        for (std::size_t k = 0; k < 33; ++k) {
            const std::int32_t n = surface[k * surface.size() / 33];
            const Vector3& x = body.mesh().nodes[n];
            landmarks.push_back({fmt::format("P{}", k), x, x + u[n]});
        }
    }
    std::vector<MeasuredLandmark> noisy(unsigned seed) const {
        std::mt19937_64 engine(seed);
        std::normal_distribution<double> normal(0, noise_m);
        std::vector<MeasuredLandmark> measured = landmarks;
        for (MeasuredLandmark& l : measured)
            for (double& x : l.measured) x += normal(engine);
        return measured;
    }
    MaterialFit fit(const std::vector<MeasuredLandmark>& measured, bool support = false) const {
        return fit_materials(scene, hierarchy, measured, sought_values(scene, support));
    }
};

TEST(MaterialFit, FindsTheModuliOfTwoRegionsFromExactPointsInEveryModel) {
    for (const char* strain : {"linear", "corotated", "neohookean"}) {
        const TwoMaterials block(strain);
        const MaterialFit fit = block.fit(block.landmarks);
        ASSERT_TRUE(fit.converged) << strain << ": " << fit.reason;
        ASSERT_EQ(fit.values.size(), 2U);
        EXPECT_GT(fit.rms_before_m, 0.0005) << "else there is nothing to find";
        // The prior pulls a little.
        EXPECT_NEAR(fit.values[0].value, young_1, 0.01 * young_1) << strain;
        EXPECT_NEAR(fit.values[1].value, young_2, 0.01 * young_2) << strain;
        EXPECT_EQ(fit.scene.materials[1].young_Pa.value, fit.values[1].value);
    }
}

/// 1 : 3 from 33 points with noise: within 5 %, and within the interval as often as that says. More
/// seeds by the environment: LIVETET_MATERIAL_SEEDS.
TEST(MaterialFit, TheIntervalHoldsTheTruthAsOftenAsItSays) {
    const char* asked = std::getenv("LIVETET_MATERIAL_SEEDS");
    const unsigned seeds = asked ? static_cast<unsigned>(std::atoi(asked)) : 20;
    const TwoMaterials block;
    unsigned within = 0, near = 0;
    for (unsigned seed = 1; seed <= seeds; ++seed) {
        const MaterialFit fit = block.fit(block.noisy(seed));
        ASSERT_TRUE(fit.converged) << "seed " << seed << ": " << fit.reason;
        const double truth[] = {young_1, young_2};
        for (std::size_t j = 0; j < 2; ++j) {
            const FoundValue& v = fit.values[j];
            EXPECT_TRUE(v.is_determined());
            within += v.low_95 <= truth[j] && truth[j] <= v.high_95;
            near += std::abs(v.value - truth[j]) <= 0.05 * truth[j];
        }
    }
    std::printf("%u of %u intervals hold the truth, %u values are within 5 %%\n", within, 2 * seeds,
                near);
    EXPECT_GE(within, 2 * seeds * 85 / 100);
    EXPECT_GE(near, 2 * seeds * 95 / 100);
}

TEST(MaterialFit, FindsPoissonsRatioAndTheStiffnessOfTheSupport) {
    TwoMaterials block("neohookean", true);
    block.scene.materials[0].poisson = {0.35, 0.05};
    const MaterialFit fit = block.fit(block.landmarks, true);
    ASSERT_TRUE(fit.converged) << fit.reason;
    ASSERT_EQ(fit.values.size(), 4U);
    EXPECT_EQ(fit.values[1].sought.key, "materials[0].poisson");
    EXPECT_NEAR(fit.values[1].value, 0.4, 0.01);
    EXPECT_EQ(fit.values[3].sought.key, "fix[0].stiffness_N_per_m");
    EXPECT_NEAR(fit.values[3].value, 400, 40);
}

/// A body driven by displacements alone shows the ratio of its moduli, not the moduli.
TEST(MaterialFit, SaysWhatDisplacementsAloneDoNotTell) {
    TwoMaterials block;
    block.scene.loads.clear();
    DriveOptions drive;
    drive.half_space_mm = {0, 0, 39.9, 0, 0, -1};
    drive.displacement_mm = {4, 0, 2};
    block.scene.drive = {drive};
    const std::vector<Material> before = block.scene.materials;
    block.set_materials(young_1, young_2, 0.4);
    block.measure();
    block.scene.materials = before;
    const MaterialFit fit = block.fit(block.landmarks);
    ASSERT_TRUE(fit.converged) << fit.reason;
    // The prior pulls a ratio towards 1 that the points know to some ten per cent.
    EXPECT_NEAR(fit.values[1].value / fit.values[0].value, 3, 0.4);
    // The ratio is known, so that each keeps most of what both share: 1 / sqrt(2) of the spread.
    for (const FoundValue& v : fit.values) EXPECT_GT(v.spread_ratio, 0.65);

    Material one{.young_Pa = {5000, 4000}, .poisson = 0.4};
    block.scene.materials = {one};
    const MaterialFit alone = block.fit(block.landmarks);
    ASSERT_EQ(alone.values.size(), 1U);
    EXPECT_FALSE(alone.values[0].is_determined());
    EXPECT_NEAR(alone.values[0].value, 5000, 500) << "what the scene says";
}

TEST(MaterialFit, RefusesWhatItCannotFind) {
    TwoMaterials block;
    EXPECT_THROW((void)block.fit({}), Error) << "too few landmarks";
    Scene scene = block.scene;
    scene.loads.clear();
    EXPECT_THROW(
        (void)fit_materials(scene, block.hierarchy, block.landmarks, sought_values(scene, false)),
        Error)
        << "nothing moves it";
    scene = block.scene;
    scene.time.scheme = TimeScheme::newmark;
    EXPECT_THROW(
        (void)fit_materials(scene, block.hierarchy, block.landmarks, sought_values(scene, false)),
        Error);
    scene = block.scene;
    scene.materials[0].poisson = 0.495;
    EXPECT_THROW(
        (void)fit_materials(scene, block.hierarchy, block.landmarks, sought_values(scene, false)),
        Error)
        << "the mixed form";
    for (Material& m : scene.materials) m.young_Pa = 3000;
    EXPECT_THROW((void)sought_values(scene, false), Error) << "no value has a spread";
}

}  // namespace
}  // namespace livetet
