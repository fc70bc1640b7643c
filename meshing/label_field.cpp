#include "meshing/label_field.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "base/error.hpp"
#include "image/axis_filter.hpp"
#include "meshing/body_mask.hpp"

namespace livetet {

namespace {

constexpr std::uint16_t off_body = 0xffff, mixed = 0xfffe;
constexpr double max_samples = 16e6;
constexpr float min_share = 2e-3f;  ///< smaller votes are dropped
constexpr int balance_rounds = 30;
constexpr double balance_aim = 2e-3;  ///< accepted relative error of each volume
/// Maximum weight of a label's votes; enough to keep the volume of a sheet one voxel thick.
constexpr double max_weight = 2.5;

constexpr int steps[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

/// Material numbers of the body's voxels, `off_body` elsewhere. Filled cavities take the nearest
/// label by steps through faces.
Image<std::uint16_t> materials_of(const BodyMask& body, const LabelImage& image,
                                  std::span<const std::int32_t> labels,
                                  std::vector<std::int32_t>& found) {
    const auto& mask = body.mask;
    const auto& low = body.corner;
    const auto label_of = [&](int i, int j, int k) {
        const std::int32_t label = image.contains(i + low[0], j + low[1], k + low[2])
                                       ? image.at(i + low[0], j + low[1], k + low[2])
                                       : 0;
        return mask.at(i, j, k) && is_picked(label, labels) ? label : 0;
    };
    std::map<std::int32_t, std::uint16_t> numbers;
    const auto visit_all = [&](const auto& visit) {
        for (int k = 0; k < mask.size[2]; ++k)
            for (int j = 0; j < mask.size[1]; ++j)
                for (int i = 0; i < mask.size[0]; ++i) visit(i, j, k);
    };
    std::int32_t last = 0;
    visit_all([&](int i, int j, int k) {
        if (const std::int32_t label = label_of(i, j, k); label != 0 && label != last)
            numbers[last = label] = 0;
    });
    if (numbers.size() >= mixed)
        fail("image: the body has {} labels, expected fewer than {}", numbers.size(), mixed);
    for (auto& [label, number] : numbers) {
        number = static_cast<std::uint16_t>(found.size());
        found.push_back(label);
    }
    Image<std::uint16_t> voxels{mask.size, mask.ras_from_voxel,
                                std::vector<std::uint16_t>(mask.values.size(), off_body)};
    std::vector<std::array<int, 3>> front;
    visit_all([&](int i, int j, int k) {
        const std::int32_t label = label_of(i, j, k);
        if (label == 0) return;
        voxels.at(i, j, k) = numbers[label];
        front.push_back({i, j, k});
    });
    for (std::size_t next = 0; next < front.size(); ++next) {
        const auto [i, j, k] = front[next];
        for (const auto& [di, dj, dk] : steps)
            if (mask.contains(i + di, j + dj, k + dk) && mask.at(i + di, j + dj, k + dk) &&
                voxels.at(i + di, j + dj, k + dk) == off_body) {
                voxels.at(i + di, j + dj, k + dk) = voxels.at(i, j, k);
                front.push_back({i + di, j + dj, k + dk});
            }
    }
    return voxels;
}

struct Box {
    std::array<int, 3> low{1 << 30, 1 << 30, 1 << 30}, high{-1, -1, -1};
};

/// Bounding box and number of voxels of each material.
std::vector<Box> boxes_of(const Image<std::uint16_t>& voxels, std::size_t materials,
                          std::vector<double>& counts) {
    std::vector<Box> boxes(materials);
    counts.assign(materials, 0);
    for (int k = 0; k < voxels.size[2]; ++k)
        for (int j = 0; j < voxels.size[1]; ++j)
            for (int i = 0; i < voxels.size[0]; ++i) {
                const std::uint16_t m = voxels.at(i, j, k);
                if (m == off_body) continue;
                ++counts[m];
                const int at[3] = {i, j, k};
                for (int d = 0; d < 3; ++d) {
                    boxes[m].low[d] = std::min(boxes[m].low[d], at[d]);
                    boxes[m].high[d] = std::max(boxes[m].high[d], at[d]);
                }
            }
    return boxes;
}

}  // namespace

LabelField::LabelField(const LabelImage& image, const LabelFieldOptions& options)
    : iso_level_(static_cast<float>(options.iso_level)) {
    const BodyMask body = body_mask(image, options.labels, options.body);
    const double voxel_m3 = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    if (body.parts.size() > 1)
        kept_.part_m3 = 0.5 * voxel_m3 * static_cast<double>(body.parts.back());
    if (!body.cavities.empty())
        kept_.cavity_m3 = 0.5 * voxel_m3 * static_cast<double>(body.cavities.back());
    std::vector<std::int32_t> labels;
    const Image<std::uint16_t> voxels = materials_of(body, image, options.labels, labels);
    for (const std::int32_t label : labels) materials_.push_back({label});
    vote(voxels, options);
    balance();
    settle_cells();
    bounds_ = {Vector3::Constant(1e300), Vector3::Constant(-1e300)};
    for (int corner = 0; corner < 8; ++corner) {
        const Vector3 sample((corner & 1) * (size_[0] - 1.), (corner >> 1 & 1) * (size_[1] - 1.),
                             (corner >> 2) * (size_[2] - 1.));
        const Vector3 x = (ras_from_sample_ * sample.homogeneous()).head<3>();
        bounds_ = {bounds_[0].cwiseMin(x), bounds_[1].cwiseMax(x)};
    }
}

void LabelField::vote(const Image<std::uint16_t>& voxels, const LabelFieldOptions& options) {
    std::array<AxisFilter, 3> filters;
    Eigen::Matrix4d voxel_from_sample = Eigen::Matrix4d::Identity();
    const double voxel_m3 = std::abs(voxels.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    const double step_m =
        std::max(1e-3 * options.voxel_mm, std::cbrt(voxel_m3 * voxels.values.size() / max_samples));
    for (int axis = 0; axis < 3; ++axis) {
        const double spacing = voxels.ras_from_voxel.col(axis).head<3>().norm();
        const double sigma = std::max(1e-3 * options.smoothing_mm / spacing, min_smoothing_voxels);
        filters[axis] = gaussian_beyond(voxels.size[axis], sigma, step_m / spacing);
        size_[axis] = filters[axis].size();
        voxel_from_sample(axis, axis) = filters[axis].step;
        voxel_from_sample(axis, 3) = filters[axis].origin;
    }
    ras_from_sample_ = voxels.ras_from_voxel * voxel_from_sample;
    sample_from_ras_ = ras_from_sample_.inverse().topRows<3>();

    struct Entry {
        std::uint32_t sample;
        Vote vote;
    };
    std::vector<Entry> entries;
    std::vector<double> counts;
    const std::vector<Box> boxes = boxes_of(voxels, materials_.size(), counts);
    for (std::uint16_t m = 0; m < materials_.size(); ++m) {
        materials_[m].voxels_m3 = counts[m] * voxel_m3;
        const auto& [low, high] = boxes[m];
        std::vector<float> values;
        std::array<int, 3> size{high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1},
            start{};
        for (int k = low[2]; k <= high[2]; ++k)
            for (int j = low[1]; j <= high[1]; ++j)
                for (int i = low[0]; i <= high[0]; ++i)
                    values.push_back(voxels.at(i, j, k) == m ? 1.0f : 0.0f);
        for (const int axis : {2, 1, 0})
            values = apply(restricted(filters[axis], low[axis], high[axis], start[axis]), values,
                           size, axis);
        std::size_t at = 0;
        for (int k = 0; k < size[2]; ++k)
            for (int j = 0; j < size[1]; ++j)
                for (int i = 0; i < size[0]; ++i, ++at)
                    if (values[at] > min_share)
                        entries.push_back({static_cast<std::uint32_t>(
                                               index(i + start[0], j + start[1], k + start[2])),
                                           {m, values[at]}});
    }
    first_.assign(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2] + 1, 0);
    for (const Entry& e : entries) ++first_[e.sample + 1];
    for (std::size_t s = 1; s < first_.size(); ++s) first_[s] += first_[s - 1];
    votes_.resize(entries.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (const Entry& e : entries) votes_[next[e.sample]++] = e.vote;
}

std::uint16_t LabelField::winner(std::size_t sample) const {
    float total = 0, max_votes = 0;
    std::uint16_t best = off_body;
    for (std::uint32_t v = first_[sample]; v < first_[sample + 1]; ++v) {
        total += votes_[v].share;
        if (const float weighted = votes_[v].share * weights_[votes_[v].material];
            weighted > max_votes) {
            max_votes = weighted;
            best = votes_[v].material;
        }
    }
    return total < iso_level_ ? off_body : best;
}

/// Adjusts the weights of the votes until each material has as many samples as the volume of its
/// voxels requires.
void LabelField::balance() {
    weights_.assign(materials_.size(), 1.0f);
    std::vector<std::uint32_t> contested;  // samples whose winner depends on the weights
    std::vector<double> sure(materials_.size(), 0);
    double inside = 0, body = 0;
    for (std::size_t s = 0; s + 1 < first_.size(); ++s) {
        const std::uint16_t m = winner(s);
        if (m == off_body) continue;
        ++inside;
        if (first_[s + 1] - first_[s] > 1)
            contested.push_back(static_cast<std::uint32_t>(s));
        else
            ++sure[m];
    }
    for (const Material& m : materials_) body += m.voxels_m3;
    std::vector<double> now;
    for (int round = 0; round < balance_rounds; ++round) {
        now = sure;
        for (const std::uint32_t s : contested) ++now[winner(s)];
        double worst = 0;
        for (std::size_t m = 0; m < materials_.size(); ++m) {
            const double ratio = materials_[m].voxels_m3 / body / std::max(now[m] / inside, 1e-12);
            worst = std::max(worst, std::abs(ratio - 1));
            const double factor = std::clamp(std::sqrt(ratio), 0.8, 1.25);
            if (round + 1 < balance_rounds)
                weights_[m] = static_cast<float>(
                    std::clamp(weights_[m] * factor, 1 / max_weight, max_weight));
        }
        if (worst < balance_aim) break;
    }
}

void LabelField::settle_cells() {
    std::vector<std::uint16_t> at(first_.size() -
                                  1);  // the only material with votes at a sample, or `mixed`
    for (std::size_t s = 0; s < at.size(); ++s) {
        const std::uint32_t votes = first_[s + 1] - first_[s];
        at[s] = votes == 0                            ? off_body
                : votes == 1 && winner(s) != off_body ? votes_[first_[s]].material
                                                      : mixed;
    }
    cells_.assign(at.size(), mixed);
    for (int k = 0; k + 1 < size_[2]; ++k)
        for (int j = 0; j + 1 < size_[1]; ++j)
            for (int i = 0; i + 1 < size_[0]; ++i) {
                const std::uint16_t all = at[index(i, j, k)];
                bool same = true;
                for (int corner = 1; corner < 8 && same; ++corner)
                    same = at[index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))] ==
                           all;
                if (same) cells_[index(i, j, k)] = all;
            }
}

std::uint16_t LabelField::material_at(const Vector3& sample) const {
    int cell[3];
    float t[3];
    for (int d = 0; d < 3; ++d) {
        if (!(sample[d] >= 0 && sample[d] < size_[d] - 1)) return off_body;
        cell[d] = static_cast<int>(sample[d]);
        t[d] = static_cast<float>(sample[d] - cell[d]);
    }
    if (const std::uint16_t all = cells_[index(cell[0], cell[1], cell[2])]; all != mixed)
        return all;
    constexpr int max_labels = 24;
    std::uint16_t who[max_labels];
    float sum[max_labels], total = 0;
    int count = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
        const float weight = (a ? t[0] : 1 - t[0]) * (b ? t[1] : 1 - t[1]) * (c ? t[2] : 1 - t[2]);
        const std::size_t s = index(cell[0] + a, cell[1] + b, cell[2] + c);
        for (std::uint32_t v = first_[s]; v < first_[s + 1]; ++v) {
            const float share = weight * votes_[v].share;
            total += share;
            int m = 0;
            while (m < count && who[m] != votes_[v].material) ++m;
            if (m == max_labels) continue;
            if (m == count) {
                who[count] = votes_[v].material;
                sum[count++] = 0;
            }
            sum[m] += share * weights_[votes_[v].material];
        }
    }
    if (total < iso_level_ || count == 0) return off_body;
    return who[std::max_element(sum, sum + count) - sum];
}

std::int32_t LabelField::label_at(const Vector3& place) const {
    const std::uint16_t m = material_at(sample_from_ras_ * place.homogeneous());
    return m == off_body ? 0 : materials_[m].label;
}

std::vector<Vector3> LabelField::interface_places(double spacing_m, std::size_t max_count,
                                                  double min_m3) const {
    std::vector<std::uint16_t> at(first_.size() - 1);
    for (std::size_t s = 0; s < at.size(); ++s) at[s] = winner(s);
    const double sample_m3 = std::abs(ras_from_sample_.topLeftCorner<3, 3>().determinant());
    struct Piece {
        std::uint16_t material;
        double m3;
        /// Pairs of neighbouring samples: one in the piece, one in another material.
        std::vector<std::array<Place, 2>> edges;
    };
    std::vector<Piece> pieces;
    std::vector<double> largest(materials_.size(), 0);
    std::vector<bool> seen(at.size(), false);
    for (int k = 0; k < size_[2]; ++k)
        for (int j = 0; j < size_[1]; ++j)
            for (int i = 0; i < size_[0]; ++i) {
                const std::uint16_t m = at[index(i, j, k)];
                if (seen[index(i, j, k)]) continue;
                Piece piece{m, 0, {}};
                bool at_border = false;
                std::vector<Place> front{{i, j, k}};
                seen[index(i, j, k)] = true;
                for (std::size_t next = 0; next < front.size(); ++next) {
                    const Place here = front[next];
                    for (const auto& step : steps) {
                        const Place there{here[0] + step[0], here[1] + step[1], here[2] + step[2]};
                        bool in = true;
                        for (int d = 0; d < 3; ++d) in = in && there[d] >= 0 && there[d] < size_[d];
                        at_border |= !in;
                        if (!in) continue;
                        const std::size_t s = index(there[0], there[1], there[2]);
                        if (at[s] != m) piece.edges.push_back({here, there});
                        if (at[s] != m || seen[s]) continue;
                        seen[s] = true;
                        front.push_back(there);
                    }
                }
                piece.m3 = sample_m3 * static_cast<double>(front.size());
                if (m == off_body && at_border) continue;  // the outside
                if (m != off_body) largest[m] = std::max(largest[m], piece.m3);
                pieces.push_back(std::move(piece));
            }
    const auto on_interface = [&](const std::array<Place, 2>& edge) {
        Vector3 in(edge[0][0], edge[0][1], edge[0][2]), out(edge[1][0], edge[1][1], edge[1][2]);
        const std::uint16_t m = material_at(in);
        for (int halving = 0; halving < 7; ++halving) {
            const Vector3 middle = (in + out) / 2;
            (material_at(middle) == m ? in : out) = middle;
        }
        return Vector3((ras_from_sample_ * Vector3((in + out) / 2).homogeneous()).head<3>());
    };
    std::vector<Vector3> places;
    std::mt19937 random(1);
    for (Piece& piece : pieces) {
        const bool cavity = piece.material == off_body;
        if (piece.m3 < (cavity ? min_m3 : std::min(min_m3, largest[piece.material]))) continue;
        const double apart = std::min(spacing_m, 0.5 * std::cbrt(piece.m3));
        const std::size_t before = places.size();
        std::size_t left = std::min<std::size_t>(piece.edges.size(), 50 * max_count);
        for (std::size_t e = 0; e < left && places.size() < before + max_count; ++e) {
            std::swap(piece.edges[e], piece.edges[e + random() % (piece.edges.size() - e)]);
            const Vector3 x = on_interface(piece.edges[e]);
            if (std::all_of(places.begin(), places.end(),
                            [&](const Vector3& p) { return (p - x).norm() >= apart; }))
                places.push_back(x);
        }
    }
    return places;
}

}  // namespace livetet
