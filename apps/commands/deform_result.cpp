#include "apps/commands/deform_result.hpp"

#include <algorithm>

#include "apps/live/statement_record.hpp"
#include "apps/simulation/checkpoint.hpp"
#include "apps/simulation/result_fields.hpp"

namespace livetet {

FrameStatement statement_of(const DeformedOrgan& found, PointFrame frame) {
    FrameStatement statement;
    for (const TargetSpread& t : found.targets) {
        TargetStatement& s = statement.targets.emplace_back();
        s.position = t.position;
        s.covariance = t.covariance;
        s.radius_95 = t.radius_95;
        s.by_source[static_cast<std::size_t>(ErrorSource::fiducials)] = t.by_pose_m2;
        s.by_source[static_cast<std::size_t>(ErrorSource::law)] = t.by_model_m2;
    }
    // The model's error is stated as one share of the motion, not by what causes it.
    for (const ErrorSource source :
         {ErrorSource::materials, ErrorSource::fixed, ErrorSource::elements})
        statement.missing.add(source);
    if (std::ranges::all_of(found.targets, [](const auto& t) { return t.by_model_m2 == 0; }))
        statement.missing.add(ErrorSource::law);
    if (frame == PointFrame::fixed) statement.missing.add(ErrorSource::fiducials);
    if (!found.report.converged) statement.missing = ErrorSources::all();
    return statement;
}

std::vector<std::string> names_of_targets(const DeformedOrgan& found) {
    std::vector<std::string> names;
    for (const TargetSpread& t : found.targets) names.push_back(t.name);
    return names;
}

void append_found(ResultWriter& writer, const Scene& scene, const SceneBody& body,
                  const DeformedOrgan& found, double time_s) {
    append_frame(writer, {time_s, body.body->displacement(), result_fields(scene, *body.body)});
    append_statement(writer, statement_of(found, deform_options(scene).frame));
}

}  // namespace livetet
