#include <pybind11/stl.h>

#include <cmath>
#include <optional>

#include "apps/live/expected_error.hpp"
#include "apps/python/arrays.hpp"
#include "apps/python/mesh.hpp"
#include "geometry/point_order.hpp"
#include "geometry/registration_covariance.hpp"
#include "geometry/registration_error.hpp"
#include "geometry/umeyama.hpp"

namespace livetet::python {

namespace {

/// A registration by points, with what its error estimates need.
struct Registration {
    std::vector<Vector3> from, to;
    std::vector<double> weights;
    Scaling scaling = Scaling::rigid;
    PointFit fit;
    double fle = 0;
    std::optional<Eigen::Matrix<double, 6, 6>> covariance;
};

/// Throws Error if another order of the points fits clearly better.
void refuse_wrong_order(const Registration& r) {
    const auto better = better_order(r.from, r.to);
    if (!better) return;
    fail("register: FRE is {:.2f} mm; the touched points in the order {} fit better, FRE {:.2f} mm",
         1e3 * better->given_fre, fmt::join(better->order, ", "), 1e3 * better->fre);
}

Registration register_points(const DoubleArray& touched, const DoubleArray& in_image,
                             const std::optional<DoubleArray>& weights, bool scale) {
    Registration r;
    const auto from = rows3(touched, "touched"), to = rows3(in_image, "in_image");
    r.from.assign(from.begin(), from.end());
    r.to.assign(to.begin(), to.end());
    if (weights) {
        const auto given = numbers(*weights, "weights");
        r.weights.assign(given.begin(), given.end());
    }
    r.scaling = scale ? Scaling::similarity : Scaling::rigid;
    r.fit = fit_points_cross_checked(r.from, r.to, r.scaling, r.weights);
    refuse_wrong_order(r);
    r.fle = fle_from_fre(r.fit.fre, r.from.size(), r.scaling, r.weights);
    if (scale) return r;
    CollectedFiducials fiducials;
    FiducialRegistration& f = fiducials.registration;
    f.fle = r.fle;
    f.image_from_base = {1, r.fit.rotation, r.fit.translation};
    for (std::size_t i = 0; i < r.from.size(); ++i)
        f.fiducials.push_back({.name = {},
                               .in_image = r.to[i],
                               .in_tracker = r.from[i],
                               .weight = r.weights.empty() ? 1 : r.weights[i]});
    r.covariance = expected_error(fiducials).covariance;
    return r;
}

py::array image_from_tracker(const Registration& r) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = r.fit.scale * r.fit.rotation;
    m.topRightCorner<3, 1>() = r.fit.translation;
    return matrix(m);
}

py::array left_out(const Registration& r) {
    std::vector<double> errors;
    for (const auto& e : leave_one_out(r.from, r.to, r.scaling, r.weights))
        errors.push_back(e.value_or(std::nan("")));
    const auto count = std::ssize(errors);
    return owned(std::move(errors), {count});
}

Vector3 point_of(const DoubleArray& point) {
    const auto p = numbers(point, "point");
    if (p.size() != 3) fail("point: found {} numbers, expected 3", p.size());
    return {p[0], p[1], p[2]};
}

py::array covariance_at(const Registration& r, const DoubleArray& point) {
    if (!r.covariance) fail("covariance: is not known of a registration with a scale");
    return matrix(point_covariance(*r.covariance, point_of(point) - r.fit.translation));
}

}  // namespace

void bind_registration(py::module_& module) {
    py::class_<Registration>(module, "Registration",
                             "A registration by fiducials, as of `livetet register`.")
        .def_property_readonly("image_from_tracker", &image_from_tracker,
                               "4 x 4, m: scale, rotation and translation. A copy.")
        .def_property_readonly(
            "scale", [](const Registration& r) { return r.fit.scale; }, "1 unless asked for.")
        .def_property_readonly(
            "fre", [](const Registration& r) { return r.fit.fre; },
            "Fiducial registration error, m, RMS. A small one is not a small "
            "error at a target.")
        .def_readonly("fle", &Registration::fle,
                      "Fiducial localisation error, m, RMS, estimated from FRE.")
        .def_property_readonly(
            "residuals",
            [](const py::object& self) {
                return view(self.cast<const Registration&>().fit.residuals, self);
            },
            "Fitted minus given points (n, 3), m. A view.")
        .def_property_readonly("leave_one_out", &left_out,
                               "Distance of each point, m, from its place by the fit of the "
                               "others; NaN if those determine none.")
        .def_property_readonly(
            "covariance",
            [](const Registration& r) -> py::object {
                return r.covariance ? py::object(matrix(*r.covariance)) : py::none();
            },
            "Of (d, a), (6, 6), m and rad, along the image's axes: the image of p errs by d + a x "
            "(R p). None with a scale. A copy.")
        .def("covariance_at", &covariance_at, py::arg("point"),
             "Covariance (3, 3), m^2, of the error at a point of the image, m.")
        .def(
            "expected_tre",
            [](const Registration& r, const DoubleArray& point) {
                return expected_tre(r.to, r.fle, point_of(point), r.scaling, r.weights);
            },
            py::arg("point"), "Expected target registration error, m, RMS (Fitzpatrick 1998).");
    module.def("register", &register_points, py::arg("touched"), py::arg("in_image"),
               py::arg("weights") = py::none(), py::arg("scale") = false,
               "Registers touched points (n, 3) to the image's points (n, 3), m, in the same order "
               "(Umeyama 1991, checked by Horn 1987). Raises Error for fewer than three points, "
               "points on a line, or an order that does not fit.");
}

}  // namespace livetet::python
