#include "io/registration_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/covariance_json.hpp"

namespace livetet {

namespace {

using nlohmann::json;
constexpr const char* registration_format = "livetet registration 2";

json to_mm(const Eigen::Vector3d& v) { return {1e3 * v.x(), 1e3 * v.y(), 1e3 * v.z()}; }

Eigen::Vector3d from_mm(const json& j) {
    const auto v = j.get<std::vector<double>>();
    if (v.size() != 3) throw json::other_error::create(501, "three numbers", &j);
    return Eigen::Vector3d(v[0], v[1], v[2]) / 1e3;
}

const char* matrix_key(const FiducialRegistration& r) {
    return r.reference_tool.empty() ? "image_from_tracker_mm" : "image_from_reference_mm";
}

json matrix_mm(const SimilarityTransform<ImageFrame, Base>& t) {
    json rows = json::array();
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) rows.push_back(t.scale * t.rotation(i, k));
        rows.push_back(1e3 * t.translation[i]);
    }
    for (const double x : {0.0, 0.0, 0.0, 1.0}) rows.push_back(x);
    return rows;
}

SimilarityTransform<ImageFrame, Base> from_matrix_mm(const json& j) {
    const auto m = j.get<std::vector<double>>();
    if (m.size() != 16) throw json::other_error::create(501, "16 numbers", &j);
    SimilarityTransform<ImageFrame, Base> t;
    Eigen::Matrix3d A;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) A(i, k) = m[4 * i + k];
        t.translation[i] = m[4 * i + 3] / 1e3;
    }
    t.scale = std::cbrt(A.determinant());
    t.rotation = nearest_rotation(A);
    if (!(t.scale > 0) || !((A - t.scale * t.rotation).norm() < 1e-6 * t.scale))
        throw json::other_error::create(501, "a matrix of a turn, a scale and a shift", &j);
    return t;
}

/// JSON has no NaN; null is a number that could not be determined.
double number_or_nan_mm(const json& j) {
    return j.is_null() ? std::nan("") : j.get<double>() / 1e3;
}

RegisteredSurface surface_from(const json& j) {
    return {j.at("points").get<std::size_t>(),
            j.at("used").get<std::size_t>(),
            j.at("rms_before_mm").get<double>() / 1e3,
            j.at("rms_after_mm").get<double>() / 1e3,
            j.at("iterations").get<int>(),
            j.at("free_motions").get<std::size_t>()};
}

ExpectedRegistrationError expected_error_from(const json& j, const std::string& where) {
    if (!j.is_object())
        fail("{}: error: is of the type {}, expected an object", where, j.type_name());
    for (const char* key : {"covariance_mm_rad", "holds_tip"})
        if (!j.contains(key)) fail("{}: error.{} is missing", where, key);
    const json& holds_tip = j["holds_tip"];
    if (!holds_tip.is_boolean())
        fail("{}: error.holds_tip: is of the type {}, expected true or false", where,
             holds_tip.type_name());
    return {covariance_from_json<6>(j["covariance_mm_rad"], where + ": error.covariance_mm_rad"),
            holds_tip.get<bool>()};
}

}  // namespace

void write_registration(const std::filesystem::path& path,
                        const FiducialRegistration& registration) {
    json fiducials = json::array();
    for (const RegisteredFiducial& f : registration.fiducials) {
        json j{{"name", f.name},
               {"image_mm", to_mm(f.in_image)},
               {"tracker_mm", to_mm(f.in_tracker)},
               {"residual_mm", 1e3 * f.residual},
               {"leave_one_out_mm", 1e3 * f.leave_one_out},
               {"weight", f.weight}};
        if (!registration.reference_tool.empty()) j["reference_mm"] = to_mm(f.in_reference);
        fiducials.push_back(j);
    }
    json j{{"format", registration_format},
           {"reference_tool", registration.reference_tool},
           {matrix_key(registration), matrix_mm(registration.image_from_base)},
           {"scale", registration.image_from_base.scale},
           {"fre_mm", 1e3 * registration.fre},
           {"fle_mm", 1e3 * registration.fle},
           {"fiducials", fiducials}};
    if (registration.outlier) j["outlier"] = *registration.outlier;
    if (const auto& s = registration.surface)
        j["surface"] = {{"points", s->points},
                        {"used", s->used},
                        {"rms_before_mm", 1e3 * s->rms_before},
                        {"rms_after_mm", 1e3 * s->rms_after},
                        {"iterations", s->iterations},
                        {"free_motions", s->free_motions}};
    if (const auto& e = registration.expected_error)
        j["error"] = {{"covariance_mm_rad", covariance_to_json(e->covariance)},
                      {"holds_tip", e->holds_tip}};
    write_text_file(path, j.dump(2, ' ', false, json::error_handler_t::replace) +
                              "\n");  // names may be in Latin-1
}

FiducialRegistration read_registration(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    FiducialRegistration r;
    try {
        const json j = json::parse(text);
        if (j.value("format", "") != registration_format)
            fail("{}: format is \"{}\", expected \"{}\"", path.string(), j.value("format", ""),
                 registration_format);
        r.reference_tool = j.at("reference_tool").get<std::string>();
        r.image_from_base = from_matrix_mm(j.at(matrix_key(r)));
        r.fre = j.at("fre_mm").get<double>() / 1e3;
        r.fle = j.at("fle_mm").get<double>() / 1e3;
        for (const json& f : j.at("fiducials")) {
            RegisteredFiducial fiducial{f.at("name"),
                                        from_mm(f.at("image_mm")),
                                        from_mm(f.at("tracker_mm")),
                                        {},
                                        f.at("residual_mm").get<double>() / 1e3,
                                        number_or_nan_mm(f.at("leave_one_out_mm")),
                                        f.at("weight").get<double>()};
            if (!r.reference_tool.empty()) fiducial.in_reference = from_mm(f.at("reference_mm"));
            r.fiducials.push_back(fiducial);
        }
        if (j.contains("outlier")) r.outlier = j["outlier"].get<std::string>();
        if (j.contains("surface")) r.surface = surface_from(j["surface"]);
        if (j.contains("error")) r.expected_error = expected_error_from(j["error"], path.string());
    } catch (const json::exception& e) {
        fail("{}: not a registration that `livetet register` wrote: {}", path.string(), e.what());
    }
    return r;
}

}  // namespace livetet
