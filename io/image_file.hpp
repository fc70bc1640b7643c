#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "image/image.hpp"
#include "io/volume.hpp"

namespace livetet {

/// A voxel of a label image is not a label; most often the file is a grey image.
class NotALabel : public Error {
  public:
    using Error::Error;
};

/// Whether the path names an image: by the extension .nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd, or
/// as DICOM (see dicom_name).
bool is_image_name(const std::filesystem::path& path);

/// Digest of a file's bytes and, if it is an image header, of the file with its voxels; of DICOM,
/// of all files of the series. None if the voxels of an image header are in several files. Throws
/// Error as a reader of the header does.
std::optional<std::string> content_digest(const std::filesystem::path& path);

/// The file that an image header names for its voxels; none if they are in the same file, in
/// several files, or the header is invalid.
std::optional<std::filesystem::path> named_voxel_file(const std::filesystem::path& path);

/// Reads an image as metres, RAS; files are in mm unless they state another unit. Axes may be
/// oblique, sheared, left-handed, or flipped by a negative spacing.
/// - NIfTI (.nii, .nii.gz; versions 1 and 2, either byte order), with its intensity scaling. The
///   affine is the sform, else the qform, else the spacing alone.
/// - NRRD (.nrrd, .nhdr with its data file; raw, gzip or text), also Slicer's .seg.nrrd with one
///   layer. `space` may be RAS, LAS or LPS; without it the axes are LPS, as in ITK.
/// - MetaImage (.mha, .mhd with its data file; compressed or not): LPS, axes by TransformMatrix
///   (row i: axis i). AnatomicalOrientation is ignored, as in ITK and Slicer.
/// - DICOM: a folder, a file of a series, a multi-frame image, or a segmentation, whose labels are
///   its segments' numbers; a series or segments may be chosen after a '#' (see DicomName).
///
/// Throws Error if the file is missing, truncated or damaged, has more or less data than its header
/// states, has another extension, more than three dimensions, several values a voxel, no spacing
/// (NRRD, MetaImage), a singular affine, or a voxel that is not finite; for DICOM also if a folder
/// holds several series and none is chosen, if slices are missing, differ in size or orientation or
/// are shifted by a gantry tilt, or if segments overlap and none are chosen. A build without images
/// reads NIfTI only.
GreyImage read_grey_image(const std::filesystem::path& path);

/// The same for labels. Throws NotALabel unless every voxel is a 32-bit integer.
LabelImage read_label_image(const std::filesystem::path& path);

/// The same for a mask. Throws Error if it covers nothing, or looks like a grey image, all of whose
/// voxels would be in the mask.
LabelImage read_mask(const std::filesystem::path& path);

/// The two steps of these functions: the stored data of a file, and its values. `path`: of the
/// file, for messages.
Volume read_volume(const std::filesystem::path& path);
GreyImage grey_image(const Volume& volume, const std::filesystem::path& path);
/// Where values that are not finite, such as NaN outside a scanner's field of view, are kept.
GreyImage grey_image_with_gaps(const Volume& volume, const std::filesystem::path& path);
LabelImage label_image(const Volume& volume, const std::filesystem::path& path);

/// Writes a NIfTI 1 image (.nii, or compressed .nii.gz) in mm, with sform and, if the axes are
/// orthogonal, qform. Grey values are stored as float, labels as the smallest of 8, 16 and 32 bit
/// integers that fits.
void write_image(const std::filesystem::path& path, const GreyImage& image);
void write_image(const std::filesystem::path& path, const LabelImage& image);

/// The same with voxels of `type`: rounded and clamped for integers of up to 32 bits, else float.
void write_image(const std::filesystem::path& path, const GreyImage& image, ScalarType type);

/// Writes displacements (metres, RAS) as a displacement field for ITK, ANTs and 3D Slicer: a NIfTI
/// vector image (five-dimensional, intent 1007) of float, mm. The components are LPS although
/// NIfTI's world is RAS, because ITK does not convert vectors of that intent.
void write_displacement_field(const std::filesystem::path& path,
                              const Image<Eigen::Vector3f>& field);

}  // namespace livetet
