#include "apps/commands/moved_targets.hpp"

#include <algorithm>
#include <limits>

#include "apps/live/statement_record.hpp"
#include "apps/scene/targets.hpp"
#include "config/yaml.hpp"
#include "io/result_file.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

std::vector<MovedTarget> moved_targets(const std::filesystem::path& result) {
    constexpr double tolerance_m = 1e-5;  // displacements are recorded in single precision
    const std::string source = result.string();
    const ResultReader reader(result);
    const StatementReader statements(reader, source);
    if (statements.names().empty() || reader.frame_count() == 0) return {};

    // A frame holds where each target is in the deformed organ: its place plus its displacement.
    const std::vector<TargetStatement> recorded = statements.read(0).targets;
    const TetMesh mesh = reader.mesh();
    const std::vector<Vector3> displacement = reader.displacement(0);
    std::vector<MovedTarget> moved;
    for (const Target& target : all_targets(read_yaml<Scene>(reader.scene_text(), source), mesh)) {
        const auto name = std::ranges::find(statements.names(), target.name);
        if (name == statements.names().end()) continue;
        const auto then = static_cast<std::size_t>(name - statements.names().begin());
        const PointSampler sampler(mesh, target.places);
        double distance = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < target.places.size(); ++i)
            distance = std::min(distance, (target.places[i] + sampler.sample(i, displacement) -
                                           recorded[then].position)
                                              .norm());
        if (distance > tolerance_m) moved.push_back({target.name, 1e3 * distance});
    }
    return moved;
}

}  // namespace livetet
