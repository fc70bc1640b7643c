#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/interfaces.hpp"
#include "meshing/options.hpp"

namespace livetet {

/// Smoothing of the interfaces; use the values that `surface_of_labels` used for the outer surface.
struct LabelFieldOptions {
    std::vector<std::int32_t> labels;  ///< labels of the body; empty: all but 0
    /// Sample spacing; larger for bodies with more than 16 million samples.
    double voxel_mm = 1.5;
    /// Standard deviation of the Gaussian; at least 0.6 voxels along each axis.
    double smoothing_mm = 1.5;
    double iso_level = 0.5;  ///< sum of all votes on the body's boundary
    BodyChoice body{};
};

/// Label map with smooth interfaces. At each position the surrounding voxels vote with the weights
/// of a Gaussian, and the label with the most votes wins; if the sum of all votes is below the
/// iso-level, the position is outside. A label's votes are scaled up to compensate for the volume
/// that smoothing would take from it. Interfaces of any number of labels meet without gaps. The
/// body is that of `body_mask`; filled cavities take the labels next to them.
class LabelField {
  public:
    /// A material of the body.
    struct Material {
        std::int32_t label = 0;
        double voxels_m3 = 0;  ///< volume of its voxels in the body, filled cavities included
    };

    /// Throws Error as `body_mask` does.
    LabelField(const LabelImage& image, const LabelFieldOptions& options);

    /// The label at a position (metres, RAS); 0: outside.
    std::int32_t label_at(const Vector3& place) const;
    /// The materials in the order of their labels.
    const std::vector<Material>& materials() const { return materials_; }
    /// Volumes of the smallest part of the body and of the smallest cavity; infinite if there is
    /// one part, or no cavity.
    const KeptPieces& kept() const { return kept_; }
    /// Bounding box of the body (metres): low and high corner.
    const std::array<Vector3, 2>& bounds() const { return bounds_; }
    /// Positions on the interfaces (accurate to 1/100 of a sample) of each connected piece of a
    /// label, and of each cavity: at least `spacing_m` apart within a piece, closer in small
    /// pieces, at most `max_count` for each piece. Skips pieces smaller than `min_m3` if their
    /// label has a larger one.
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

    std::array<int, 3> size_{};  ///< number of samples
    Eigen::Matrix4d ras_from_sample_;
    Eigen::Matrix<double, 3, 4> sample_from_ras_;
    /// Votes of sample s: votes_[first_[s]] to votes_[first_[s + 1] - 1].
    std::vector<std::uint32_t> first_;
    std::vector<Vote> votes_;
    /// Material of the whole cell that starts at sample s, or `mixed`.
    std::vector<std::uint16_t> cells_;
    std::vector<Material> materials_;
    std::vector<float> weights_;  ///< weight of each material's votes
    KeptPieces kept_;
    std::array<Vector3, 2> bounds_;
    float iso_level_ = 0.5f;
};

}  // namespace livetet
