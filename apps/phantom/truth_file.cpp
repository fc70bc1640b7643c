#include "apps/phantom/truth_file.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "base/error.hpp"
#include "base/file.hpp"

namespace livetet {

namespace {

using Eigen::Vector3d;
using nlohmann::json;

constexpr const char* format_name = "livetet phantom truth 1";
constexpr const char* interpolation_rule =
    "piecewise linear in depth, from 0 at depth 0; constant beyond the deepest of press.depths_mm";

// A part of the document with its path, for messages.
struct Entry {
    const json& value;
    std::string file, key;

    [[noreturn]] void refuse(const std::string& expected) const {
        std::string found = value.dump();
        if (found.size() > 40) found = found.substr(0, 37) + "...";
        fail("{}: {} is {}, expected {}", file, key, found, expected);
    }
    Entry at(const char* name) const {
        const std::string path = key.empty() ? name : key + "." + name;
        if (!value.is_object())
            fail("{}: {} is no object, expected one with {}", file, key.empty() ? "it" : key, name);
        if (!value.contains(name))
            fail("{}: {} is missing, expected a truth of `livetet phantom`", file, path);
        return {value.at(name), file, path};
    }
    Entry at(std::size_t i) const { return {value[i], file, fmt::format("{}[{}]", key, i)}; }
    std::size_t size() const {
        if (!value.is_array()) refuse("a list");
        return value.size();
    }
    std::string text() const {
        if (!value.is_string()) refuse("a text");
        return value.get<std::string>();
    }
    double number() const {
        if (!value.is_number()) refuse("a number");
        return value.get<double>();
    }
    std::vector<double> numbers(std::size_t count) const {
        if (size() != count) refuse(fmt::format("a list of {} numbers", count));
        std::vector<double> all;
        for (std::size_t i = 0; i < count; ++i) all.push_back(at(i).number());
        return all;
    }
    Vector3d vector() const { return Vector3d(numbers(3).data()); }
    Vector3d vector_mm() const { return vector() / 1e3; }
};

json list_of(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
json list_mm(const Vector3d& v) { return list_of(1e3 * v); }

json matrix_mm(const RigidTransform<Tracker, ImageFrame>& t) {
    json rows = json::array();
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) rows.push_back(t.rotation(i, k));
        rows.push_back(1e3 * t.translation[i]);
    }
    for (const double last : {0, 0, 0, 1}) rows.push_back(last);
    return rows;
}

RigidTransform<Tracker, ImageFrame> transform_of(const Entry& entry) {
    const std::vector<double> m = entry.numbers(16);
    RigidTransform<Tracker, ImageFrame> t;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) t.rotation(i, k) = m[4 * i + k];
        t.translation[i] = m[4 * i + 3] / 1e3;
    }
    const bool is_rotation =
        (t.rotation * t.rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6 &&
        t.rotation.determinant() > 0;
    if (!is_rotation || m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
        entry.refuse("the 4 rows of a rigid transform");
    return t;
}

json to_json(const Truth& truth) {
    json depths = json::array(), targets = json::array(), samples = json::array();
    for (const double depth : truth.depths) depths.push_back(1e3 * depth);
    for (const TruthTarget& t : truth.targets) {
        json displacements = json::array();
        for (const Vector3d& u : t.displacement) displacements.push_back(list_mm(u));
        targets.push_back({{"name", t.name},
                           {"position_mm", list_mm(t.position)},
                           {"displacements_mm", displacements}});
    }
    for (const TruthSample& s : truth.samples)
        samples.push_back({{"time_s", s.time_s},
                           {"depth_mm", 1e3 * s.depth},
                           {"tracker_from_image_mm", matrix_mm(s.tracker_from_image)}});
    return {
        {"format", format_name},
        {"made_by", truth.provenance},
        {"interpolation", interpolation_rule},
        {"tool",
         {{"tip_mm", list_mm(truth.tip_in_tool)}, {"pivot_mm", list_mm(truth.pivot_in_tracker)}}},
        {"press",
         {{"sensor_rest_mm", list_mm(truth.sensor_rest)},
          {"direction", list_of(truth.press_direction)},
          {"patch_radius_mm", 1e3 * truth.patch_radius},
          {"depths_mm", depths}}},
        {"tracker",
         {{"reference_rest_mm", list_mm(truth.reference_rest)},
          {"position_noise_rms_mm", 1e3 * truth.position_noise},
          {"rotation_noise_rms_deg", 180 / std::numbers::pi * truth.rotation_noise}}},
        {"targets", targets},
        {"samples", samples}};
}

TruthTarget target_of(const Entry& entry) {
    TruthTarget target{entry.at("name").text(), entry.at("position_mm").vector_mm(), {}};
    const Entry displacements = entry.at("displacements_mm");
    for (std::size_t k = 0; k < displacements.size(); ++k)
        target.displacement.push_back(displacements.at(k).vector_mm());
    return target;
}

}  // namespace

Vector3d displacement_of(const Truth& truth, const TruthTarget& target, double depth) {
    double shallower = 0;
    Vector3d before = Vector3d::Zero();
    for (std::size_t k = 0; k < truth.depths.size(); ++k) {
        if (depth < truth.depths[k]) {
            const double share = std::max(0.0, (depth - shallower) / (truth.depths[k] - shallower));
            return before + share * (target.displacement[k] - before);
        }
        shallower = truth.depths[k];
        before = target.displacement[k];
    }
    return before;
}

void check_truth(const Truth& truth, const std::string& where) {
    if (truth.targets.empty()) fail("{}: targets is empty, expected at least one", where);
    if (truth.samples.empty()) fail("{}: samples is empty, expected at least one", where);
    if (truth.depths.empty()) fail("{}: press.depths_mm is empty, expected at least one", where);
    for (std::size_t k = 0; k < truth.depths.size(); ++k)
        if (!(truth.depths[k] > (k > 0 ? truth.depths[k - 1] : 0)) ||
            !std::isfinite(truth.depths[k]))
            fail("{}: press.depths_mm[{}] = {}, expected depths above 0 that rise", where, k,
                 1e3 * truth.depths[k]);
    if (!(truth.patch_radius > 0))
        fail("{}: press.patch_radius_mm = {} must be > 0", where, 1e3 * truth.patch_radius);
    if (!(std::abs(truth.press_direction.norm() - 1) < 1e-6))
        fail("{}: press.direction has length {}, expected 1", where, truth.press_direction.norm());
    if (!truth.tip_in_tool.allFinite() || !truth.pivot_in_tracker.allFinite() ||
        !truth.sensor_rest.allFinite() || !truth.reference_rest.allFinite())
        fail("{}: tool, press.sensor_rest_mm and tracker.reference_rest_mm must be finite", where);
    if (!(truth.position_noise >= 0 && truth.rotation_noise >= 0))
        fail("{}: tracker: noise of {} mm and {} rad, expected at least 0", where,
             1e3 * truth.position_noise, truth.rotation_noise);
    std::set<std::string> names;
    for (const TruthTarget& t : truth.targets) {
        if (!names.insert(t.name).second) fail("{}: target {} occurs twice", where, t.name);
        if (t.displacement.size() != truth.depths.size())
            fail("{}: target {} has {} displacements, expected one for each of {} depths", where,
                 t.name, t.displacement.size(), truth.depths.size());
        for (const Vector3d& u : t.displacement)
            if (!u.allFinite() || !t.position.allFinite())
                fail("{}: target {} is not finite", where, t.name);
    }
    for (std::size_t i = 0; i < truth.samples.size(); ++i) {
        const TruthSample& s = truth.samples[i];
        if (!std::isfinite(s.time_s) || !std::isfinite(s.depth) ||
            !s.tracker_from_image.translation.allFinite() ||
            !s.tracker_from_image.rotation.allFinite())
            fail("{}: samples[{}] is not finite", where, i);
        if (i > 0 && !(s.time_s > truth.samples[i - 1].time_s))
            fail("{}: samples[{}].time_s = {} must be later than the {} before it", where, i,
                 s.time_s, truth.samples[i - 1].time_s);
    }
}

void write_truth(const std::filesystem::path& path, const Truth& truth) {
    check_truth(truth, path.string());
    write_text_file(path, to_json(truth).dump(1) + "\n");
}

Truth read_truth(const std::filesystem::path& path) {
    const json document = json::parse(read_text_file(path), nullptr, false);
    if (document.is_discarded())
        fail("{}: is no JSON, expected a phantom's truth.json", path.string());
    const Entry root{document, path.string(), ""};
    if (root.at("format").text() != format_name)
        root.at("format").refuse(fmt::format("\"{}\"", format_name));
    Truth truth;
    truth.provenance = root.at("made_by").text();
    truth.tip_in_tool = root.at("tool").at("tip_mm").vector_mm();
    truth.pivot_in_tracker = root.at("tool").at("pivot_mm").vector_mm();
    const Entry press = root.at("press");
    truth.sensor_rest = press.at("sensor_rest_mm").vector_mm();
    truth.press_direction = press.at("direction").vector();
    truth.patch_radius = press.at("patch_radius_mm").number() / 1e3;
    const Entry tracker = root.at("tracker");
    truth.reference_rest = tracker.at("reference_rest_mm").vector_mm();
    truth.position_noise = tracker.at("position_noise_rms_mm").number() / 1e3;
    truth.rotation_noise = tracker.at("rotation_noise_rms_deg").number() * std::numbers::pi / 180;
    const Entry depths = press.at("depths_mm"), targets = root.at("targets"),
                samples = root.at("samples");
    for (std::size_t k = 0; k < depths.size(); ++k)
        truth.depths.push_back(depths.at(k).number() / 1e3);
    for (std::size_t i = 0; i < targets.size(); ++i)
        truth.targets.push_back(target_of(targets.at(i)));
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Entry s = samples.at(i);
        truth.samples.push_back({s.at("time_s").number(), s.at("depth_mm").number() / 1e3,
                                 transform_of(s.at("tracker_from_image_mm"))});
    }
    check_truth(truth, path.string());
    return truth;
}

}  // namespace livetet
