#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "image/image.hpp"
#include "io/dicom_object.hpp"
#include "io/dicom_pixels.hpp"

namespace livetet::dicom {

/// A slice of an image: a frame of one of its objects.
struct Slice {
    const Object* object = nullptr;
    int frame = 0;
    Scale scale;
    PixelFormat format;
};

/// An image's grid and its slices along k.
struct Slices {
    ImageGrid grid;
    std::vector<Slice> slices;
};

/// Stacks the slices of one series, or the frames of one object. `where`: the series, for messages.
/// The objects must outlive what is returned. Throws Error as `stack_image` and `pixel_format` do.
Slices stack_slices(std::span<const Object> objects, const std::string& where);

/// Reads slices; consecutive ones of one object open its file once.
class SliceReader {
  public:
    /// The stored values of a slice, row by row.
    void read(const Slice& slice, std::vector<double>& values);

  private:
    std::optional<Pixels> pixels_;
    const Object* object_ = nullptr;  ///< of `pixels_`
};

}  // namespace livetet::dicom
