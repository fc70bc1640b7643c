#include "io/dicom_slices.hpp"

namespace livetet::dicom {

Slices stack_slices(std::span<const Object> objects, const std::string& where) {
    std::vector<Plane> planes;
    std::vector<Slice> slices;  // one of each plane
    for (const Object& object : objects) {
        const PixelFormat format = pixel_format(object);
        const Frames frames = read_frames(object);
        for (int n = 0; n < object.frames; ++n) {
            planes.push_back(frames.planes[n]);
            slices.push_back({&object, n, frames.scales[n], format});
        }
    }
    const Stack stack = stack_image(planes, where);
    Slices sorted{stack.grid, std::vector<Slice>(slices.size())};
    for (std::size_t p = 0; p < slices.size(); ++p)
        sorted.slices[stack.slice_of_plane[p]] = slices[p];
    return sorted;
}

void SliceReader::read(const Slice& slice, std::vector<double>& values) {
    if (slice.object != object_) pixels_.emplace(*slice.object);
    object_ = slice.object;
    pixels_->read(slice.frame, values);
}

}  // namespace livetet::dicom
