#include "io/registration_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/file.hpp"

namespace livetet {

namespace {

using nlohmann::json;
constexpr const char* format_name = "livetet fiducial registration 1";

json to_mm(const Eigen::Vector3d& v) { return {1e3 * v.x(), 1e3 * v.y(), 1e3 * v.z()}; }

Eigen::Vector3d from_mm(const json& j) {
    const auto v = j.get<std::vector<double>>();
    if (v.size() != 3) throw json::other_error::create(501, "three numbers", &j);
    return Eigen::Vector3d(v[0], v[1], v[2]) / 1e3;
}

json matrix_mm(const SimilarityTransform<ImageFrame, Tracker>& t) {
    json rows = json::array();
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) rows.push_back(t.scale * t.rotation(i, k));
        rows.push_back(1e3 * t.translation[i]);
    }
    for (const double x : {0.0, 0.0, 0.0, 1.0}) rows.push_back(x);
    return rows;
}

SimilarityTransform<ImageFrame, Tracker> from_matrix_mm(const json& j) {
    const auto m = j.get<std::vector<double>>();
    if (m.size() != 16) throw json::other_error::create(501, "16 numbers", &j);
    SimilarityTransform<ImageFrame, Tracker> t;
    Eigen::Matrix3d A;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) A(i, k) = m[4 * i + k];
        t.translation[i] = m[4 * i + 3] / 1e3;
    }
    t.scale = std::cbrt(A.determinant());
    t.rotation = A / t.scale;
    return t;
}

/// JSON has no NaN: null stands for a number that could not be determined.
double number_or_nan_mm(const json& j) { return j.is_null() ? std::nan("") : j.get<double>() / 1e3; }

}  // namespace

void write_registration(const std::filesystem::path& path, const FiducialRegistration& registration) {
    json fiducials = json::array();
    for (const RegisteredFiducial& f : registration.fiducials) {
        json j{{"name", f.name},
               {"image_mm", to_mm(f.in_image)},
               {"tracker_mm", to_mm(f.in_tracker)},
               {"residual_mm", 1e3 * f.residual},
               {"leave_one_out_mm", 1e3 * f.leave_one_out}};
        if (!registration.reference_tool.empty()) j["reference_mm"] = to_mm(f.in_reference);
        fiducials.push_back(j);
    }
    const json j{{"format", format_name},
                 {"reference_tool", registration.reference_tool},
                 {"image_from_tracker_mm", matrix_mm(registration.image_from_tracker)},
                 {"scale", registration.image_from_tracker.scale},
                 {"fre_mm", 1e3 * registration.fre},
                 {"fle_mm", 1e3 * registration.fle},
                 {"fiducials", fiducials}};
    write_text_file(path, j.dump(2) + "\n");
}

FiducialRegistration read_registration(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    FiducialRegistration r;
    try {
        const json j = json::parse(text);
        if (j.value("format", "") != format_name)
            fail("{}: format is \"{}\", expected \"{}\"", path.string(), j.value("format", ""), format_name);
        r.reference_tool = j.at("reference_tool").get<std::string>();
        r.image_from_tracker = from_matrix_mm(j.at("image_from_tracker_mm"));
        r.fre = j.at("fre_mm").get<double>() / 1e3;
        r.fle = j.at("fle_mm").get<double>() / 1e3;
        for (const json& f : j.at("fiducials")) {
            RegisteredFiducial fiducial{f.at("name"),
                                        from_mm(f.at("image_mm")),
                                        from_mm(f.at("tracker_mm")),
                                        {},
                                        f.at("residual_mm").get<double>() / 1e3,
                                        number_or_nan_mm(f.at("leave_one_out_mm"))};
            if (!r.reference_tool.empty()) fiducial.in_reference = from_mm(f.at("reference_mm"));
            r.fiducials.push_back(fiducial);
        }
    } catch (const json::exception& e) {
        fail("{}: not a registration that `livetet register` wrote: {}", path.string(), e.what());
    }
    return r;
}

}  // namespace livetet
