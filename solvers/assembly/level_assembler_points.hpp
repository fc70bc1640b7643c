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
    if (is_mixed() || (has_mean_dilation_ && at.p)) pressures.emplace(at.p);
    with_shape([&](auto count) {
        constexpr int nodes = decltype(count)::value;
        using Shape = ElementShape<nodes>;
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            const auto element = shaped_element<nodes>(e);
            const ConstitutiveModel& model = *moduli(e).model;
            const Nodal<nodes> values = values_at<nodes>(e, u.data());
            double of_cell = 0;
            if constexpr (nodes == 8)
                if (has_mean_dilation_)
                    of_cell = pressures ? (*pressures).data()[e]
                                        : mean_pressure<Shape>(at, e, element, values);
            for (int point = 0; point < Shape::points; ++point) {
                const ElementPoint<nodes> of_point = element_point<nodes>(element, point);
                const Eigen::Matrix3d H = values * of_point.gradients.transpose();
                const Eigen::Matrix3d R = rotation(at, e, point, Shape::points, H);
                const double p =
                    has_mean_dilation_
                        ? of_cell
                        : pressure_at<nodes>(model, e, element, point,
                                             pressures ? pressures->data() : nullptr, H, R);
                visit(model, e, element, point, of_point, H, R, p);
            }
        }
    });
}

template <class Visit>
void LevelAssembler::visit_stress(const Configuration& at, Visit&& visit) const {
    visit_points(at, [&](const ConstitutiveModel& model, std::size_t e, const TetElement& element,
                         int number, const auto& point, const Eigen::Matrix3d& H,
                         const Eigen::Matrix3d& R, double p) {
        const Eigen::Matrix3d P = model.stress(element.mu, p, H, R);
        // Cauchy's stress is P F^T / J; at small strain it is P. That of flat elements is not
        // finite.
        visit(e, number, point.weight,
              model.kinematics() == Kinematics::small_strain
                  ? P
                  : Eigen::Matrix3d(P * deformation_gradient(H).transpose() /
                                    away_from_zero(1 + dilation_of(H))));
    });
}

template <class Visit>
void LevelAssembler::visit_fields(const Configuration& at, Visit&& visit) const {
    TetFields fields;
    visit_points(at, [&]<int nodes>(const ConstitutiveModel& model, std::size_t e,
                                    const TetElement& element, int number,
                                    const ElementPoint<nodes>& point, const Eigen::Matrix3d& H,
                                    const Eigen::Matrix3d& R, double p) {
        if (number == 0) fields = {};
        const double lambda = element.lambda, share = point.weight / element.volume;
        fields.volume_change +=
            share * (model.kinematics() == Kinematics::small_strain ? H.trace() : dilation_of(H));
        fields.strain_energy_J_per_m3 += share * (model.shear_energy(element.mu, H, R) +
                                                  (lambda != 0 ? p * p / (2 * lambda) : 0));
        if (number + 1 == ElementShape<nodes>::points) visit(e, fields);
    });
}

template <class Visit>
void LevelAssembler::visit_volume_ratio(const Configuration& at, Visit&& visit) const {
    double ratio = 0;
    visit_points(
        at, [&]<int nodes>(const ConstitutiveModel&, std::size_t e, const TetElement& element,
                           int number, const ElementPoint<nodes>& point, const Eigen::Matrix3d& H,
                           const Eigen::Matrix3d&, double) {
            if (number == 0) ratio = 1;
            ratio += point.weight / element.volume * dilation_of(H);
            if (number + 1 == ElementShape<nodes>::points) visit(e, ratio);
        });
}

template <class Visit>
void LevelAssembler::visit_volume_strain(const Configuration& at, Visit&& visit) const {
    const LocalValues values(at.u);
    with_shape([&](auto count) {
        constexpr int nodes = decltype(count)::value;
        using Shape = ElementShape<nodes>;
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            const auto element = shaped_element<nodes>(e);
            const ConstitutiveModel& model = *moduli(e).model;
            const Nodal<nodes> nodal = values_at<nodes>(e, values.data());
            for (int point = 0; point < Shape::points; ++point) {
                const auto [g, weight] = element_point<nodes>(element, point);
                const Eigen::Matrix3d H = nodal * g.transpose();
                const Eigen::Matrix3d R = rotation(at, e, point, Shape::points, H);
                visit(e, pressure_shape<nodes>(element, point), weight, model.volume_strain(H, R),
                      Nodal<nodes>(model.volume_strain_gradient(H, R) * g));
            }
        }
    });
}

}  // namespace livetet
