#pragma once

#include <Eigen/Core>

#include <filesystem>

#include "image/image.hpp"
#include "io/dicom_derived.hpp"

namespace livetet {

/// Writes a displacement field (metres, RAS) as a Deformable Spatial Registration object of the
/// study of `source` (DICOM PS3.3, A.39.2 and C.20.3). It tells how to resample the source's
/// images: the point x of the registered frame of reference, where the deformed image is, shows
/// what the source's images have at
///
///     M_post (M_pre x + D(x)),    both matrices being the identity,
///
/// D being the field. So `field` has to be the inverse one, defined on the deformed body and
/// pointing to the rest position (FieldDirection::inverse). Points and vectors are LPS, mm; the
/// grid has the field's voxels, k along row x column. Both frames of reference have the source's
/// UID: the surroundings do not move. `registered`: the series in the deformed state, which is
/// referred to if it has instances.
///
/// Throws Error if the source is no DICOM image or states no study or frame of reference; if the
/// grid's axes are not at right angles; if the field has more than 4 GiB; or if the file cannot be
/// written. The file is whole or not there.
void write_dicom_registration(const std::filesystem::path& file, const DicomName& source,
                              const Image<Eigen::Vector3f>& field,
                              const DicomDerivation& derivation, const DerivedSeries& registered);

/// Throws Error, naming `where`, unless the axes of a grid are at right angles.
void check_right_angles(const ImageGrid& grid, const std::string& where);

}  // namespace livetet
