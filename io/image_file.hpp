#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "image/image.hpp"
#include "io/volume.hpp"

namespace livetet {

/// A label image's voxel that is no label: a grey image, most often.
class NotALabel : public Error {
  public:
    using Error::Error;
};

/// Whether the name is that of an image file: .nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd.
bool is_image_name(const std::filesystem::path& path);

/// What a file holds, as a digest: of its bytes and, where it is an image's header, of those of the
/// file that its voxels lie in. None where they lie in several. Throws Error as a reader of the
/// header would.
std::optional<std::string> content_digest(const std::filesystem::path& path);

/// The file that an image's header names for its voxels; none where they lie in itself or in
/// several, and where the header is none that its reader would take.
std::optional<std::filesystem::path> named_voxel_file(const std::filesystem::path& path);

/// Reads an image; millimetres (or the unit that the file states) become metres, its world RAS.
///   NIfTI (.nii, .nii.gz; versions 1 and 2, either byte order), with its intensity scaling: the
///   affine is the sform,
///     else the qform, else the spacing alone.
///   NRRD (.nrrd, .nhdr with its data file; raw, gzip or text), Slicer's .seg.nrrd of one layer
///   too: `space` RAS, LAS
///     or LPS; axes that no `space` names lie along LPS, as ITK takes them.
///   MetaImage (.mha, .mhd with its data file; compressed or not): LPS, axes by TransformMatrix
///   (row i: axis i). Like
///     ITK and Slicer we take nothing from AnatomicalOrientation.
/// Axes may be oblique, sheared, left-handed, or flipped by a negative spacing. Throws Error where
/// the file is missing, truncated, damaged, holds less or more than its header says, has another
/// ending, more than three dimensions, several values a voxel, no spacing (NRRD, MetaImage), an
/// affine that flattens space, or a voxel that is not finite. A build without images reads NIfTI
/// alone.
GreyImage read_grey_image(const std::filesystem::path& path);

/// The same for labels: every voxel must be a whole number of 32 bits, else NotALabel.
LabelImage read_label_image(const std::filesystem::path& path);

/// The same for a mask: an Error where it looks like a grey image, whose every voxel would be in
/// it.
LabelImage read_mask(const std::filesystem::path& path);

/// The two steps of these: what a file holds, as it is stored; and its values. `path`: of the file,
/// for messages.
Volume read_volume(const std::filesystem::path& path);
GreyImage grey_image(const Volume& volume, const std::filesystem::path& path);
LabelImage label_image(const Volume& volume, const std::filesystem::path& path);

/// Writes a NIfTI 1 image (.nii, or compressed .nii.gz) in mm, with sform and, where axes are
/// square to each other, qform. Grey values as float; labels as 8, 16 or 32 bit integers, the
/// smallest that fits.
void write_image(const std::filesystem::path& path, const GreyImage& image);
void write_image(const std::filesystem::path& path, const LabelImage& image);

/// Grey values as voxels of `type`: rounded and clipped where those are integers of up to 32 bits,
/// else as float.
void write_image(const std::filesystem::path& path, const GreyImage& image, ScalarType type);

/// Displacements (metres, RAS) as ITK, and so ANTs and 3D Slicer, read a displacement field from
/// NIfTI: a vector image (five-dimensional, intent 1007) of float, mm. NIfTI's world is RAS, but
/// ITK turns no vectors of that intent: their components are LPS.
void write_displacement_field(const std::filesystem::path& path,
                              const Image<Eigen::Vector3f>& field);

}  // namespace livetet
