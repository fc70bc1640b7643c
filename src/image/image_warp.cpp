#include "image/image_warp.hpp"

#include <Eigen/Dense>

#include "image/tet_raster.hpp"

namespace livetet {

namespace {

/// One thread's slabs: of the deformed body and of the body at rest.
struct Canvas {
    RasterSlab deformed, rest;
    WarpCounts counts;
};

template <class T, class Sample>
void warp_slab(const Image<T>& image, bool same_grid, const Eigen::Affine3d& source_from_voxel,
               const Eigen::Matrix3d& source_from_metres, const Sample& sample_at, T empty,
               Canvas& canvas, Image<T>& out) {
    std::size_t n = 0;
    for (int k = canvas.deformed.first; k < canvas.deformed.last; ++k)
        for (int j = 0; j < out.size[1]; ++j) {
            std::size_t at = out.index(0, j, k);
            for (int i = 0; i < out.size[0]; ++i, ++n, ++at) {
                const float rank = canvas.deformed.ranks[n];
                const bool carried = rank < uncovered;
                if (!carried && canvas.rest.ranks[n] < uncovered) {
                    out.values[at] = empty;
                    ++canvas.counts.left_empty;
                    continue;
                }
                canvas.counts.carried += carried;
                canvas.counts.inverted += carried && rank >= inverted_rank;
                if (!carried && same_grid) {
                    out.values[at] = image.values[at];
                    continue;
                }
                Eigen::Vector3d source = source_from_voxel * Eigen::Vector3d(i, j, k);
                if (carried)
                    source +=
                        source_from_metres * canvas.deformed.values[n].template cast<double>();
                const bool inside = is_inside(image, source);
                out.values[at] = inside ? sample_at(source) : empty;
                canvas.counts.beyond_image += !inside;
            }
        }
}

}  // namespace

template <class T>
Image<T> warp_image(const Image<T>& image, const ImageGrid& grid, const BodyMotion& motion,
                    Interpolation how, T empty, ThreadTeam& team, WarpCounts& counts) {
    const auto back = differences(motion.deformed, motion.rest);
    const TetRaster deformed(grid, motion.tets, motion.own, motion.deformed, back);
    const TetRaster rest(grid, motion.tets, motion.own, motion.rest, back);
    const bool same_grid = grid.size == image.size && grid.ras_from_voxel == image.ras_from_voxel;
    const Eigen::Matrix4d source_from_ras = image.ras_from_voxel.inverse();
    const Eigen::Affine3d source_from_voxel(
        same_grid ? Eigen::Matrix4d(Eigen::Matrix4d::Identity())
                  : Eigen::Matrix4d(source_from_ras * grid.ras_from_voxel));
    const Eigen::Matrix3d source_from_metres = source_from_ras.topLeftCorner<3, 3>();

    Image<T> out{grid.size, grid.ras_from_voxel, {}};
    out.values.resize(static_cast<std::size_t>(grid.size[0]) * grid.size[1] * grid.size[2]);
    std::vector<Canvas> canvases(team.size(), {deformed.make_slab(), rest.make_slab(), {}});
    const auto run = [&](const auto& sample_at) {
        for_each_slab(team, deformed.slab_count(), [&](int s, int thread) {
            Canvas& canvas = canvases[thread];
            deformed.draw(s, canvas.deformed);
            rest.draw(s, canvas.rest);
            warp_slab(image, same_grid, source_from_voxel, source_from_metres, sample_at, empty,
                      canvas, out);
        });
    };
    using Place = const Eigen::Vector3d&;
    switch (how) {
        case Interpolation::nearest:
            run([&](Place x) { return sample<Interpolation::nearest>(image, x); });
            break;
        case Interpolation::linear:
            run([&](Place x) { return sample<Interpolation::linear>(image, x); });
            break;
        case Interpolation::cubic:
            run([&](Place x) { return sample<Interpolation::cubic>(image, x); });
            break;
    }
    counts = {};
    for (const Canvas& c : canvases) {
        counts.carried += c.counts.carried;
        counts.left_empty += c.counts.left_empty;
        counts.inverted += c.counts.inverted;
        counts.beyond_image += c.counts.beyond_image;
    }
    return out;
}

template GreyImage warp_image(const GreyImage&, const ImageGrid&, const BodyMotion&, Interpolation,
                              float, ThreadTeam&, WarpCounts&);
template LabelImage warp_image(const LabelImage&, const ImageGrid&, const BodyMotion&,
                               Interpolation, std::int32_t, ThreadTeam&, WarpCounts&);

Image<Eigen::Vector3f> displacement_field(const ImageGrid& grid, const BodyMotion& motion,
                                          FieldDirection direction, ThreadTeam& team) {
    const bool inverse = direction == FieldDirection::inverse;
    const auto& from = inverse ? motion.deformed : motion.rest;
    const auto values = differences(from, inverse ? motion.rest : motion.deformed);
    const TetRaster raster(grid, motion.tets, motion.own, from, values);
    Image<Eigen::Vector3f> field{grid.size, grid.ras_from_voxel, {}};
    field.values.resize(static_cast<std::size_t>(grid.size[0]) * grid.size[1] * grid.size[2]);
    std::vector<RasterSlab> slabs(team.size(), raster.make_slab());
    for_each_slab(team, raster.slab_count(), [&](int s, int thread) {
        RasterSlab& slab = slabs[thread];
        raster.draw(s, slab);
        Eigen::Vector3f* out = field.values.data() + field.index(0, 0, slab.first);
        for (std::size_t n = 0; n < slab.ranks.size(); ++n)
            out[n] = slab.ranks[n] < uncovered ? slab.values[n]
                                               : Eigen::Vector3f(Eigen::Vector3f::Zero());
    });
    return field;
}

}  // namespace livetet
