#include "geometry/registration_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/points.hpp"

namespace livetet {
namespace {

using namespace test;

TEST(RegistrationError, ExpectedErrorsAreThoseOfManyRegistrations) {
    Random random(7);
    const Points x{
        {0.05, 0, 0}, {-0.05, 0.02, 0}, {0, 0.06, 0.01}, {0.01, -0.05, 0.04}, {0, 0.01, -0.05}};
    const Vector3d target(0.02, 0.08, -0.03);
    const double fle = 1e-3;
    std::vector<double> fre, tre;
    for (int trial = 0; trial < 20000; ++trial) {
        Points p = x;
        for (Vector3d& point : p) point += random.gaussian(fle / std::sqrt(3));
        const PointFit fit = fit_points(p, x, Scaling::rigid);
        fre.push_back(fit.fre);
        tre.push_back((fit * target - target).norm());
    }
    EXPECT_NEAR(fle_from_fre(rms(fre), x.size()), fle, 0.01 * fle);
    const double expected = expected_tre(x, fle, target);
    EXPECT_NEAR(rms(tre), expected, 0.02 * expected);
    EXPECT_LT(expected_tre(x, fle, Vector3d(0, 0.01, 0)), expected);
}

TEST(RegistrationError, LeaveOneOutFindsTheDisplacedPoint) {
    Random random(8);
    const Points p = random.points(6, 0.1);
    Points x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
    x[3].z() += 0.02;
    const auto errors = leave_one_out(p, x, Scaling::rigid);
    EXPECT_NEAR(*errors[3], 0.02, 1e-12);
    for (const std::size_t i : {0, 1, 2, 4, 5}) EXPECT_GT(*errors[i], 1e-4);
}

TEST(RegistrationError, LeaveOneOutIsEmptyWhereTheOthersDetermineNothing) {
    const Points p{{0, 0, 0}, {0.1, 0, 0}, {0.2, 0, 0}, {0, 0.1, 0}};
    const auto errors = leave_one_out(p, p, Scaling::rigid);
    EXPECT_TRUE(errors[0] && errors[1] && errors[2]);
    EXPECT_FALSE(errors[3]);
    for (const auto& error :
         leave_one_out(Points{p[0], p[1], p[3]}, Points{p[0], p[1], p[3]}, Scaling::rigid))
        EXPECT_FALSE(error);
}

// Many registrations of fiducials with localisation errors of RMS length fle / sqrt(w): their FRE
// and TRE.
struct ManyRegistrations {
    double fre = 0, tre = 0;
    ManyRegistrations(const Points& x, double fle, const Vector3d& target, Scaling scaling,
                      const std::vector<double>& weights, unsigned seed) {
        Random random(seed);
        std::vector<double> fres, tres;
        for (int trial = 0; trial < 20000; ++trial) {
            Points p = x;
            for (std::size_t i = 0; i < p.size(); ++i)
                p[i] += random.gaussian(fle / std::sqrt(3 * (weights.empty() ? 1 : weights[i])));
            const PointFit fit = fit_points(p, x, scaling, weights);
            fres.push_back(fit.fre);
            tres.push_back((fit * target - target).norm());
        }
        fre = rms(fres);
        tre = rms(tres);
    }
};

const Points five{
    {0.05, 0, 0}, {-0.05, 0.02, 0}, {0, 0.06, 0.01}, {0.01, -0.05, 0.04}, {0, 0.01, -0.05}};

TEST(RegistrationError, OfWeightsAndOfAScaleIsThatOfManyRegistrations) {
    const Vector3d target(0.02, 0.08, -0.03);
    const double fle = 1e-3;
    const std::vector<double> weights{1, 4, 0.25, 1, 2};
    for (const Scaling scaling : {Scaling::rigid, Scaling::similarity})
        for (const auto& w : {std::vector<double>{}, weights}) {
            const ManyRegistrations many(five, fle, target, scaling, w, 21);
            EXPECT_NEAR(fle_from_fre(many.fre, 5, scaling, w), fle, 0.01 * fle);
            EXPECT_NEAR(expected_tre(five, fle, target, scaling, w), many.tre, 0.02 * many.tre);
        }
    EXPECT_GT(expected_tre(five, fle, target, Scaling::similarity),
              1.03 * expected_tre(five, fle, target));
}

TEST(RegistrationError, OfASquareIsTheClosedForm) {
    // Corners at distance a from the centre: f^2 = a^2 / 2 for both diagonals and a^2 for the
    // normal. At height h above the centre
    //
    //     <TRE^2> = FLE^2 / 4 (1 + (h^2 / (a^2/2) + h^2 / (a^2/2)) / 3)
    const double a = 0.05, h = 0.1, fle = 0.001;
    const Points square{{a, 0, 0}, {0, a, 0}, {-a, 0, 0}, {0, -a, 0}};
    EXPECT_NEAR(expected_tre(square, fle, {0, 0, h}),
                fle * std::sqrt((1 + 4 * h * h / (a * a) / 3) / 4), 1e-15);
    EXPECT_NEAR(expected_tre(square, fle, {0, 0, 0}), fle / 2, 1e-15);
    EXPECT_NEAR(fle_from_fre(0.001, 4), 0.001 * std::sqrt(2), 1e-15);
    EXPECT_THROW(fle_from_fre(0.001, 2), Error);
    EXPECT_THROW(fle_from_fre(0.001, 4, Scaling::rigid, std::vector<double>{1, 1, 0, 0}), Error);
    const Points line{{0, 0, 0}, {0.1, 1e-5, 0}, {0.2, 0, 1e-5}, {0.3, 0, 0}};
    EXPECT_THROW(expected_tre(line, 1e-3, Vector3d::Zero()), Error);
}

TEST(RegistrationError, WeightZeroCountsAsAFiducialLeftOut) {
    Random random(22);
    Points p = random.points(6, 0.1),
           x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
    for (Vector3d& point : x) point += random.gaussian(0.001);
    const std::vector<double> weights{1, 1, 0, 1, 1, 1};
    const PointFit with = fit_points(p, x, Scaling::rigid, weights);
    const auto left_out = leave_one_out(p, x, Scaling::rigid, weights);
    EXPECT_NEAR(*left_out[2], with.residuals[2].norm(), 1e-15);
    const double fle = fle_from_fre(with.fre, 6, Scaling::rigid, weights);
    p.erase(p.begin() + 2);
    x.erase(x.begin() + 2);
    EXPECT_NEAR(fle, fle_from_fre(fit_points(p, x, Scaling::rigid).fre, 5), 1e-15);
    EXPECT_NEAR(*left_out[3], *leave_one_out(p, x, Scaling::rigid)[2], 1e-14);
}

TEST(RegistrationError, SnedecorsDistributionIsThatOfTables) {
    // Upper critical values of F: P = 0.05 and 0.01 (any table).
    EXPECT_NEAR(f_survival(9.277, 3, 3), 0.05, 1e-4);
    EXPECT_NEAR(f_survival(9.780, 3, 6), 0.01, 1e-4);
    EXPECT_NEAR(f_survival(3.863, 3, 9), 0.05, 1e-4);
    EXPECT_NEAR(f_survival(4.938, 3, 20), 0.01, 1e-4);
    EXPECT_NEAR(f_survival(1, 7, 7), 0.5, 1e-9);
    EXPECT_EQ(f_survival(0, 3, 6), 1);
}

TEST(RegistrationError, NamesTheOutlierAndHowFarItIs) {
    Random random(23);
    for (const std::size_t count : {5, 6, 8})
        for (std::size_t wrong = 0; wrong < count; ++wrong) {
            const Points p = random.points(count, 0.1);
            Points x = mapped(Truth{1, random.rotation(), random.vector(0.5)}, p);
            for (Vector3d& point : x) point += random.gaussian(0.0003);
            const Vector3d off = 0.02 * Vector3d::Unit(static_cast<int>(wrong % 3));
            x[wrong] += off;
            const auto outlier = find_outlier(p, x, Scaling::rigid);
            ASSERT_TRUE(outlier) << count << " " << wrong;
            EXPECT_EQ(outlier->index, wrong);
            EXPECT_NEAR(outlier->leave_one_out, 0.02, 0.004);
            EXPECT_LT(outlier->without.fre, 0.001);
            EXPECT_GT(fit_points(p, x, Scaling::rigid).fre, 3 * outlier->without.fre);
        }
}

TEST(RegistrationError, NoiseAloneIsRarelyCalledAnOutlier) {
    Random random(24);
    int named = 0;
    constexpr int trials = 2000;
    for (int trial = 0; trial < trials; ++trial) {
        Points p = five;
        for (Vector3d& point : p) point += random.gaussian(0.002);
        named += find_outlier(p, five, Scaling::rigid).has_value();
    }
    // 1 % by construction (an upper bound by Bonferroni, up to the linearisation).
    EXPECT_GT(named, 4);
    EXPECT_LT(named, 36);
}

TEST(RegistrationError, NoOutlierIsNamedWhereTheOthersCannotTell) {
    const Points three(five.begin(), five.begin() + 3);
    EXPECT_FALSE(find_outlier(three, three, Scaling::rigid));
    Points off = five;
    off[2].x() += 0.0001;  // exact otherwise: statistically an outlier, but irrelevant
    EXPECT_FALSE(find_outlier(off, five, Scaling::rigid));
}

}  // namespace
}  // namespace livetet
