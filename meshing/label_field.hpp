#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// How the field's interfaces are smoothed; as `surface_of_labels` did with the body's outer
/// surface.
struct LabelFieldOptions {
    std::vector<std::int32_t> labels;  ///< of the body; empty: all but 0
    double voxel_mm =
        1.5;  ///< spacing of the votes; greater for bodies of more than 16 million of them
    double smoothing_mm =
        1.5;  ///< Gaussian's standard deviation; at least 0.6 voxels along each axis is taken
    double iso_level = 0.5;  ///< of all votes together on the body's outer surface
};

/// Materials with smooth interfaces: at each place the voxels around it vote, weighted by a
/// Gaussian, and the label with the most votes has it; where all labels together have less than the
/// iso-level it lies outside. Votes of a label count the more the more of its voxels' volume the
/// smoothing would take away. Interfaces of any number of labels meet without gaps. The body is
/// that of `largest_component`; its filled holes go to the labels next to them.
class LabelField {
  public:
    /// A material of the body.
    struct Material {
        std::int32_t label = 0;
        double voxels_m3 = 0;  ///< of its voxels in the body, filled holes among them
    };

    /// Throws Error as `largest_component` does.
    LabelField(const LabelImage& image, const LabelFieldOptions& options);

    /// The label at a place (metres, RAS); 0: outside.
    std::int32_t label_at(const Vector3& place) const;
    /// In the order of their labels.
    const std::vector<Material>& materials() const { return materials_; }
    /// A box of eight corners around all of the body (metres): low and high corner.
    const std::array<Vector3, 2>& bounds() const { return bounds_; }
    /// Places on the interfaces (to within a hundredth of a sample) of each connected piece of a
    /// label, at least `spacing_m` apart within a piece, or nearer where the piece is small; at
    /// most `max_count` for each piece. Pieces of less than `min_m3` are left out where their label
    /// has a larger one.
    std::vector<Vector3> interface_places(double spacing_m, std::size_t max_count,
                                          double min_m3) const;

  private:
    struct Vote {
        std::uint16_t material;
        float share;
    };
    using Place = std::array<int, 3>;

    void vote(const Image<std::uint16_t>& voxels, const LabelFieldOptions& options);
    void balance();
    void settle_cells();
    std::size_t index(int i, int j, int k) const {
        return i +
               static_cast<std::size_t>(size_[0]) * (j + static_cast<std::size_t>(size_[1]) * k);
    }
    std::uint16_t winner(std::size_t sample) const;
    std::uint16_t material_at(const Vector3& sample) const;

    std::array<int, 3> size_{};  ///< samples
    Eigen::Matrix4d ras_from_sample_;
    Eigen::Matrix<double, 3, 4> sample_from_ras_;
    std::vector<std::uint32_t>
        first_;  ///< votes of sample s: votes_[first_[s]] to votes_[first_[s + 1]]
    std::vector<Vote> votes_;
    std::vector<std::uint16_t>
        cells_;  ///< whose all places of the cell from sample s on are, or `mixed`
    std::vector<Material> materials_;
    std::vector<float> weights_;  ///< of each material's votes
    std::array<Vector3, 2> bounds_;
    float iso_level_ = 0.5f;
};

}  // namespace livetet
