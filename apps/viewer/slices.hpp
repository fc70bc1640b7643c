#pragma once

#include <vtkImageData.h>
#include <vtkImageProperty.h>
#include <vtkImageSlice.h>
#include <vtkImageSliceMapper.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>

#include <array>
#include <memory>

#include "apps/viewer/body.hpp"
#include "image/image_slice.hpp"

namespace livetet {

/// One slice through the image, across axis 0 (sagittal), 1 (coronal) or 2 (axial): the patient's
/// right is on the left, as radiologists and 3D Slicer have it. Over it lie the organ's outline,
/// that at rest, the cross-hair, sensors, and fiducials.
class SliceView {
  public:
    /// `body` has to have an image and, as `sampler` and `table`, outlives it.
    SliceView(const ShownBody& body, const ImageSampler& sampler, int axis, vtkLookupTable* table,
              vtkRenderer* renderer);

    /// Draws the image as deformed at this moment, or at rest, through `cross`.
    void show(const ShownMoment& moment, bool deformed, const Vector3& cross);
    /// The point of the plane that is seen at these pixels of the window.
    Vector3 point_at(int x, int y) const;
    vtkRenderer* renderer() const { return renderer_; }
    int axis() const { return axis_; }
    /// The length of a pixel, m: what a turn of the wheel goes on.
    double spacing() const { return spacing_; }
    /// Makes all of the slice fill its renderer.
    void fit();

  private:
    void draw_lines(const ShownMoment& moment, const Vector3& cross);

    const ShownBody& body_;
    const ImageSampler& sampler_;
    int axis_;
    vtkRenderer* renderer_;
    double spacing_ = 0;
    std::vector<Triangle> skin_;
    std::vector<Vector3> at_rest_;  ///< no displacement
    SlicePlane plane_;
    BodySlice rest_, now_;
    std::optional<double> rest_at_;  ///< where rest_ was made
    std::vector<OutlinePiece> outline_, rest_outline_;
    vtkNew<vtkImageData> pixels_;
    vtkNew<vtkImageSliceMapper> mapper_;
    vtkNew<vtkImageSlice> slice_;
    vtkNew<vtkPolyData> lines_;
    vtkNew<vtkTextActor> title_;
};

/// The three slices, linked by a cross-hair.
class SliceViews {
  public:
    /// `renderers`: of the axial, the coronal and the sagittal slice.
    SliceViews(const ShownBody& body, const std::array<vtkRenderer*, 3>& renderers);

    void show(int view, const ShownMoment& moment);
    void set_cross(const Vector3& cross);
    const Vector3& cross() const { return cross_; }
    void set_window(double window, double level);
    double window() const { return window_; }
    double level() const { return level_; }
    void set_deformed(bool deformed) { deformed_ = deformed; }
    bool is_deformed() const { return deformed_; }
    /// The one that a renderer draws, or nullptr.
    SliceView* of(const vtkRenderer* renderer);
    void fit();

  private:
    const GreyImage& image_;
    ImageSampler sampler_;
    vtkNew<vtkLookupTable> table_;
    std::array<std::unique_ptr<SliceView>, 3> views_;
    Vector3 cross_ = Vector3::Zero();
    double window_ = 1, level_ = 0;
    bool deformed_ = true;
};

}  // namespace livetet
