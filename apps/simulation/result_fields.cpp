#include "apps/simulation/result_fields.hpp"

#include <algorithm>

#include "io/vector_table.hpp"
#include "mechanics/stress.hpp"

namespace livetet {

std::vector<ResultFrame::Field> result_fields(const Scene& scene, DeformableBody& body) {
    const auto& asked = scene.output.fields;
    const auto wanted = [&](const std::string& name) {
        return std::find(asked.begin(), asked.end(), name) != asked.end();
    };
    std::vector<ResultFrame::Field> fields;
    if (wanted("reactions")) {
        const std::vector<Vector3> reactions = body.reactions();
        const PartitionedMesh& share = body.linear_solver().fine().share();
        const auto own = flat(reactions).first(3 * static_cast<std::size_t>(share.owned));
        fields.push_back({"reactions", FieldPlace::node, 3, node_blocks(share).to_block(own, 3)});
    }
    if (std::all_of(asked.begin(), asked.end(),
                    [](const std::string& name) { return name == "reactions"; }))
        return fields;
    const std::vector<TetFields> of_tets = body.tet_fields();
    const auto add = [&](const std::string& name, int components, auto&& value_of) {
        if (!wanted(name)) return;
        std::vector<double> values;
        for (const TetFields& f : of_tets) {
            const auto v = value_of(f);
            values.insert(values.end(), v.data(), v.data() + v.size());
        }
        fields.push_back({name, FieldPlace::tet, components, std::move(values)});
    };
    using One = Eigen::Matrix<double, 1, 1>;
    add("stress", 9, [](const TetFields& f) { return f.cauchy_stress_Pa; });
    add("von_mises", 1, [](const TetFields& f) { return One(von_mises(f.cauchy_stress_Pa)); });
    add("strain_energy", 1, [](const TetFields& f) { return One(f.strain_energy_J_per_m3); });
    add("volume_change", 1, [](const TetFields& f) { return One(f.volume_change); });
    return fields;
}

}  // namespace livetet
