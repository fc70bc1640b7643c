#include "mesh/label_regions.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace livetet {

std::vector<std::int32_t> regions_by_label(const TetMesh& mesh, const LabelImage& image,
                                           std::span<const std::int32_t> labels) {
    const auto is_body = [&](std::int32_t label) {
        return label != 0 && (labels.empty() || std::find(labels.begin(), labels.end(), label) != labels.end());
    };
    std::map<std::int32_t, std::size_t> counts;
    for (const std::int32_t label : image.values)
        if (is_body(label)) ++counts[label];
    if (counts.empty()) return {};
    if (counts.size() == 1) return std::vector<std::int32_t>(mesh.tets.size(), counts.begin()->first);
    const std::int32_t frequent =
        std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; })
            ->first;

    const Eigen::Matrix4d voxel_from_ras = image.ras_from_voxel.inverse();
    std::vector<std::int32_t> regions;
    regions.reserve(mesh.tets.size());
    for (const Tet& t : mesh.tets) {
        Vector3 centre = Vector3::Zero();
        for (const std::int32_t n : t) centre += mesh.nodes[n] / 4;
        const Vector3 place = (voxel_from_ras * centre.homogeneous()).head<3>();
        const int i0 = static_cast<int>(std::lround(place[0])), j0 = static_cast<int>(std::lround(place[1])),
                  k0 = static_cast<int>(std::lround(place[2]));
        std::int32_t region = frequent;
        for (int reach = 0; reach <= 5; ++reach) {
            double nearest = std::numeric_limits<double>::infinity();
            for (int k = k0 - reach; k <= k0 + reach; ++k)
                for (int j = j0 - reach; j <= j0 + reach; ++j)
                    for (int i = i0 - reach; i <= i0 + reach; ++i) {
                        const bool on_shell =
                            std::max({std::abs(i - i0), std::abs(j - j0), std::abs(k - k0)}) == reach;
                        if (!on_shell || !image.contains(i, j, k) || !is_body(image.at(i, j, k))) continue;
                        const double distance = (Vector3(i, j, k) - place).squaredNorm();
                        if (distance < nearest) {
                            nearest = distance;
                            region = image.at(i, j, k);
                        }
                    }
            if (std::isfinite(nearest)) break;
        }
        regions.push_back(region);
    }
    return regions;
}

}  // namespace livetet
