#include "meshing/body_mask.hpp"

#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <functional>
#include <set>

#include "base/error.hpp"

namespace livetet {

namespace {

enum Voxel : std::uint8_t { empty = 0, picked = 1, seen = 2, outside = 3 };

using Mask = Image<std::uint8_t>;

void check_image(const LabelImage& image) {
    const auto& n = image.size;
    if (n[0] < 1 || n[1] < 1 || n[2] < 1)
        fail("image: its size {} x {} x {} must be > 0", n[0], n[1], n[2]);
    const auto count = static_cast<std::size_t>(n[0]) * n[1] * n[2];
    if (image.values.size() != count)
        fail("image: it has {} voxels, expected {}", image.values.size(), count);
}

std::set<std::int32_t> labels_in(const LabelImage& image) {
    std::set<std::int32_t> found;
    std::int32_t last = 0;
    for (const std::int32_t v : image.values)
        if (v != last) found.insert(last = v);
    found.erase(0);
    return found;
}

Mask pick(const LabelImage& image, std::span<const std::int32_t> labels) {
    const std::set<std::int32_t> there = labels_in(image);
    if (there.empty()) fail("image: every voxel has label 0, expected a body");
    for (const std::int32_t label : labels) {
        if (label == 0)
            fail("image: label 0 is the background, expected one of {}", fmt::join(there, ", "));
        if (!there.contains(label))
            fail("image: label {} is not there, found {}", label, fmt::join(there, ", "));
    }
    Mask mask{image.size, image.ras_from_voxel,
              std::vector<std::uint8_t>(image.values.size(), empty)};
    for (std::size_t i = 0; i < image.values.size(); ++i)
        if (is_picked(image.values[i], labels)) mask.values[i] = picked;
    return mask;
}

/// Flood fill: changes the voxels of value `from` that are connected to `seed` by faces to `to`.
/// Returns their indices.
std::vector<std::size_t> flood(Mask& mask, std::size_t seed, Voxel from, Voxel to) {
    const auto nx = static_cast<std::size_t>(mask.size[0]),
               ny = static_cast<std::size_t>(mask.size[1]);
    std::vector<std::size_t> part{seed};
    mask.values[seed] = to;
    for (std::size_t next = 0; next < part.size(); ++next) {
        const std::size_t v = part[next];
        const auto visit = [&](bool exists, std::size_t neighbour) {
            if (!exists || mask.values[neighbour] != from) return;
            mask.values[neighbour] = to;
            part.push_back(neighbour);
        };
        const std::size_t i = v % nx, j = v / nx % ny, k = v / nx / ny;
        visit(i > 0, v - 1);
        visit(i + 1 < nx, v + 1);
        visit(j > 0, v - nx);
        visit(j + 1 < ny, v + nx);
        visit(k > 0, v - nx * ny);
        visit(k + 1 < static_cast<std::size_t>(mask.size[2]), v + nx * ny);
    }
    return part;
}

struct Component {
    std::size_t seed = 0;
    std::int64_t voxels = 0;
};

/// The parts of the picked voxels, the largest first. Marks them as seen.
std::vector<Component> components(Mask& mask) {
    std::vector<Component> parts;
    for (std::size_t v = 0; v < mask.values.size(); ++v)
        if (mask.values[v] == picked)
            parts.push_back({v, static_cast<std::int64_t>(flood(mask, v, picked, seen).size())});
    std::stable_sort(parts.begin(), parts.end(),
                     [](const Component& a, const Component& b) { return a.voxels > b.voxels; });
    return parts;
}

/// Crops to the given voxels plus a margin of one empty voxel. `corner` receives the image index of
/// the first voxel.
Mask cropped(const Mask& image, const std::vector<std::size_t>& voxels,
             std::array<int, 3>& corner) {
    Eigen::Array3i low = Eigen::Array3i::Constant(1 << 30), high = -low;
    const auto place = [&](std::size_t v) {
        const auto nx = static_cast<std::size_t>(image.size[0]),
                   ny = static_cast<std::size_t>(image.size[1]);
        return Eigen::Array3i(static_cast<int>(v % nx), static_cast<int>(v / nx % ny),
                              static_cast<int>(v / nx / ny));
    };
    for (const std::size_t v : voxels) {
        low = low.min(place(v));
        high = high.max(place(v));
    }
    low -= 1;
    corner = {low[0], low[1], low[2]};
    const Eigen::Array3i size = high - low + 2;
    Mask crop{{size[0], size[1], size[2]}, image.ras_from_voxel, {}};
    crop.ras_from_voxel.col(3) = image.ras_from_voxel * low.cast<double>().matrix().homogeneous();
    crop.values.assign(static_cast<std::size_t>(size[0]) * size[1] * size[2], empty);
    for (const std::size_t v : voxels) {
        const Eigen::Array3i at = place(v) - low;
        crop.at(at[0], at[1], at[2]) = picked;
    }
    return crop;
}

/// Fills the cavities of the mask, or those smaller than a speck, and records all of them. Leaves 1
/// in the body and 0 elsewhere.
void sort_cavities(BodyMask& body, Cavities cavities, double speck_voxels) {
    Mask& mask = body.mask;
    flood(mask, 0, empty, outside);  // the empty margin is connected
    for (std::size_t v = 0; v < mask.values.size(); ++v) {
        if (mask.values[v] != empty) continue;
        const std::vector<std::size_t> hollow = flood(mask, v, empty, seen);
        const auto size = static_cast<std::int64_t>(hollow.size());
        if (cavities == Cavities::keep && static_cast<double>(size) >= speck_voxels) {
            body.cavities.push_back(size);
            for (const std::size_t h : hollow) mask.values[h] = outside;
            continue;
        }
        ++body.filled.count;
        body.filled.voxels += size;
    }
    std::sort(body.cavities.begin(), body.cavities.end(), std::greater<>());
    for (std::uint8_t& v : mask.values) v = v == outside ? 0 : 1;
}

}  // namespace

BodyMask body_mask(const LabelImage& image, std::span<const std::int32_t> labels,
                   const BodyChoice& choice) {
    check_image(image);
    Mask all = pick(image, labels);
    BodyMask body;
    body.picked_voxels = std::count(all.values.begin(), all.values.end(), picked);
    const std::vector<Component> parts = components(all);
    const double voxel_m3 = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    const double speck =
        choice.speck_m3(voxel_m3 * static_cast<double>(parts[0].voxels)) / voxel_m3;
    std::vector<std::size_t> voxels, others;
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const bool is_speck = p > 0 && static_cast<double>(parts[p].voxels) < speck;
        if (is_speck) {
            ++body.specks.count;
            body.specks.voxels += parts[p].voxels;
            continue;
        }
        const bool kept = p == 0 || choice.parts == Parts::all;
        const std::vector<std::size_t> part = flood(all, parts[p].seed, seen, picked);
        if (kept) body.parts.push_back(parts[p].voxels);
        std::vector<std::size_t>& list = kept ? voxels : others;
        list.insert(list.end(), part.begin(), part.end());
    }
    body.mask = cropped(all, voxels, body.corner);
    sort_cavities(body, choice.cavities, speck);
    const auto in_body = [&](std::size_t v) {
        const auto nx = static_cast<std::size_t>(image.size[0]),
                   ny = static_cast<std::size_t>(image.size[1]);
        const std::array<std::size_t, 3> at{v % nx, v / nx % ny, v / nx / ny};
        std::array<int, 3> place{};
        for (int d = 0; d < 3; ++d) place[d] = static_cast<int>(at[d]) - body.corner[d];
        return body.mask.contains(place[0], place[1], place[2]) &&
               body.mask.at(place[0], place[1], place[2]) != 0;
    };
    for (const std::size_t v : others)  // a filled cavity takes what is in it into the body
        ++(in_body(v) ? body.label_voxels : body.left_out)[image.values[v]];
    for (const std::size_t v : voxels) ++body.label_voxels[image.values[v]];
    if (body.specks.count > 0)
        for (const std::int32_t label : labels_in(image))
            if (is_picked(label, labels) && !body.label_voxels.contains(label) &&
                !body.left_out.contains(label))
                body.lost_labels.push_back(label);
    body.body_voxels = std::count(body.mask.values.begin(), body.mask.values.end(), 1);
    return body;
}

TriangleMesh voxel_faces(const Image<std::uint8_t>& mask) {
    TriangleMesh faces;
    const auto add = [&](const Vector3& voxel, int axis, double side) {
        const auto first = static_cast<std::int32_t>(faces.nodes.size());
        constexpr double corners[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
        for (const auto& [p, q] : corners) {
            Vector3 corner = voxel;
            corner[axis] += side;
            corner[(axis + 1) % 3] += p;
            corner[(axis + 2) % 3] += q;
            faces.nodes.push_back((mask.ras_from_voxel * corner.homogeneous()).head<3>());
        }
        faces.triangles.push_back({first, first + 1, first + 2});
        faces.triangles.push_back({first, first + 2, first + 3});
    };
    for (int k = 1; k + 1 < mask.size[2]; ++k)
        for (int j = 1; j + 1 < mask.size[1]; ++j)
            for (int i = 1; i + 1 < mask.size[0]; ++i) {
                if (!mask.at(i, j, k)) continue;
                const std::array<int, 3> at{i, j, k};
                for (int axis = 0; axis < 3; ++axis)
                    for (const int side : {-1, 1}) {
                        std::array<int, 3> next = at;
                        next[axis] += side;
                        if (!mask.at(next[0], next[1], next[2]))
                            add(Vector3(i, j, k), axis, 0.5 * side);
                    }
            }
    return faces;
}

TriangleMesh mask_faces(const LabelImage& image) {
    check_image(image);
    Mask mask = pick(image, {});
    std::vector<std::size_t> voxels;
    for (std::size_t v = 0; v < mask.values.size(); ++v)
        if (mask.values[v] == picked) voxels.push_back(v);
    std::array<int, 3> corner;
    return voxel_faces(cropped(mask, voxels, corner));
}

}  // namespace livetet
