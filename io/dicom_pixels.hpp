#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/dicom_object.hpp"
#include "io/volume.hpp"

namespace livetet::dicom {

/// The stored pixels of an object, all frames, decompressed.
class Pixels {
  public:
    /// Reads and checks them. Throws Error if they are missing, compressed in a way that cannot be
    /// decoded, or more or less than the header states.
    explicit Pixels(const Object& object);

    /// The stored values of a frame (counted from 0), row by row.
    void read(int frame, std::vector<double>& values) const;

  private:
    PixelFormat format_;
    std::size_t frame_pixels_;
    std::vector<char> bytes_;  ///< little-endian words, or bits from the lowest on
};

/// The smallest type of 8 to 32 bits that holds every value that pixels of these formats and scales
/// (one of each for a slice) can have; float if a value may be no integer, or larger.
ScalarType type_for(std::span<const PixelFormat> formats, std::span<const Scale> scales);

/// Appends slope * value + intercept to the voxels of `type`.
void append_values(std::span<const double> values, const Scale& scale, ScalarType type,
                   std::vector<char>& bytes);

}  // namespace livetet::dicom
