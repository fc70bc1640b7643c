#pragma once

#include "mechanics/hex_kernels.hpp"
#include "mechanics/materials/kinematics.hpp"
#include "solvers/assembly/level_assembler.hpp"

// The visits of LevelAssembler to its quadrature points, for who calls one.

namespace livetet {

template <class Shape, class Values>
double LevelAssembler::mean_pressure(const Configuration& at, std::size_t e,
                                     const TetElement& element, const Values& values) const {
    const ConstitutiveModel& model = *moduli(e).model;
    double theta = 0;
    for (int point = 0; point < Shape::points; ++point) {
        const Eigen::Matrix3d H = values * Shape::gradients(element, point).transpose();
        theta += model.volume_strain(H, rotation(at, e, point, Shape::points, H));
    }
    return element.lambda * theta / Shape::points;
}

template <class Visit>
void LevelAssembler::visit_points(const Configuration& at, Visit&& visit) const {
    const LocalValues u(at.u);
    std::optional<LocalValues> pressures;
    if (is_mixed()) pressures.emplace(at.p);
    with_shape([&](auto count) {
        constexpr int nodes = decltype(count)::value;
        using Shape = ElementShape<nodes>;
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            const TetElement element = this->element(e);
            const ConstitutiveModel& model = *moduli(e).model;
            const Nodal<nodes> values = values_at<nodes>(e, u.data());
            const double of_cell =
                has_mean_dilation_ ? mean_pressure<Shape>(at, e, element, values) : 0;
            for (int point = 0; point < Shape::points; ++point) {
                const auto g = Shape::gradients(element, point);
                const Eigen::Matrix3d H = values * g.transpose();
                const Eigen::Matrix3d R = rotation(at, e, point, Shape::points, H);
                const double p = has_mean_dilation_
                                     ? of_cell
                                     : pressure_at(model, Shape{}, e, element.lambda, point,
                                                   pressures ? pressures->data() : nullptr, H, R);
                visit(model, Shape{}, e, element, point, g, H, R, p);
            }
        }
    });
}

template <class Visit>
void LevelAssembler::visit_stress(const Configuration& at, Visit&& visit) const {
    visit_points(at, [&](const ConstitutiveModel& model, auto, std::size_t e,
                         const TetElement& element, int point, const auto&,
                         const Eigen::Matrix3d& H, const Eigen::Matrix3d& R, double p) {
        const Eigen::Matrix3d P = model.stress(element.mu, p, H, R);
        // Cauchy's stress is P F^T / J; at small strain it is P. That of flat elements is not
        // finite.
        visit(e, point,
              model.kinematics() == Kinematics::small_strain
                  ? P
                  : Eigen::Matrix3d(P * deformation_gradient(H).transpose() /
                                    away_from_zero(1 + dilation_of(H))));
    });
}

template <class Visit>
void LevelAssembler::visit_fields(const Configuration& at, Visit&& visit) const {
    TetFields fields;
    visit_points(at, [&](const ConstitutiveModel& model, auto shape, std::size_t e,
                         const TetElement& element, int point, const auto&,
                         const Eigen::Matrix3d& H, const Eigen::Matrix3d& R, double p) {
        constexpr int points = decltype(shape)::points;
        if (point == 0) fields = {};
        const double lambda = element.lambda;
        fields.volume_change +=
            (model.kinematics() == Kinematics::small_strain ? H.trace() : dilation_of(H)) / points;
        fields.strain_energy_J_per_m3 +=
            (model.shear_energy(element.mu, H, R) + (lambda != 0 ? p * p / (2 * lambda) : 0)) /
            points;
        if (point + 1 == points) visit(e, fields);
    });
}

template <class Visit>
void LevelAssembler::visit_volume_ratio(const Configuration& at, Visit&& visit) const {
    double ratio = 0;
    visit_points(
        at, [&](const ConstitutiveModel&, auto shape, std::size_t e, const TetElement&, int point,
                const auto&, const Eigen::Matrix3d& H, const Eigen::Matrix3d&, double) {
            constexpr int points = decltype(shape)::points;
            if (point == 0) ratio = 1;
            ratio += dilation_of(H) / points;
            if (point + 1 == points) visit(e, ratio);
        });
}

template <class Visit>
void LevelAssembler::visit_volume_strain(const Configuration& at, Visit&& visit) const {
    const LocalValues values(at.u);
    with_shape([&](auto count) {
        constexpr int nodes = decltype(count)::value;
        using Shape = ElementShape<nodes>;
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            const TetElement element = this->element(e);
            const ConstitutiveModel& model = *moduli(e).model;
            const Nodal<nodes> nodal = values_at<nodes>(e, values.data());
            for (int point = 0; point < Shape::points; ++point) {
                const auto g = Shape::gradients(element, point);
                const Eigen::Matrix3d H = nodal * g.transpose();
                const Eigen::Matrix3d R = rotation(at, e, point, Shape::points, H);
                visit(e, Shape::coordinates(point), element.volume / Shape::points,
                      model.volume_strain(H, R),
                      Nodal<nodes>(model.volume_strain_gradient(H, R) * g));
            }
        }
    });
}

}  // namespace livetet
