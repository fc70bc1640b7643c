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
#include <optional>
#include <utility>

#include "apps/viewer/body.hpp"
#include "apps/viewer/text_layout.hpp"
#include "image/image_slice.hpp"
#include "mesh/clipped_grid.hpp"

namespace livetet {

/// A slice through the image, across axis 0 (sagittal), 1 (coronal) or 2 (axial), in radiological
/// orientation (the patient's right is on the left). Overlays: the organ's outline, deformed and at
/// rest, the cross-hair, sensors and fiducials; in a deformed image also the targets' ellipsoids.
class SliceView {
  public:
    /// `body` must have an image and, like `sampler` and `table`, outlive it.
    SliceView(const ShownBody& body, const ImageSampler& sampler, int axis, vtkLookupTable* table,
              vtkRenderer* renderer);

    /// The body's mesh has changed: call it before the next `show`.
    void take_mesh();
    /// Draws the image deformed as at this moment, or at rest, through `cross`.
    void show(const ShownMoment& moment, bool deformed, const Vector3& cross);
    /// The point of the slice at these pixels of the window.
    Vector3 point_at(int x, int y) const;
    vtkRenderer* renderer() const { return renderer_; }
    int axis() const { return axis_; }
    /// Size of a pixel, m: the step of the mouse wheel.
    double spacing() const { return spacing_; }
    /// Fits the whole slice into its renderer.
    void fit();
    /// Takes effect on the title at the next `show`.
    void set_texts(const TextLayout& texts);

  private:
    void draw_lines(const ShownMoment& moment, const Vector3& cross);
    void cut_regions(const ShownMoment& moment, bool deformed);
    /// The mesh that is sliced: a grid clipped at the body's surface, others as they are.
    const TetMesh& sliced() const { return clipped_ ? clipped_->second : body_.mesh; }

    const ShownBody& body_;
    const ImageSampler& sampler_;
    int axis_;
    vtkRenderer* renderer_;
    double spacing_ = 0;
    /// Of a grid; its nodes and tets as a mesh.
    std::optional<std::pair<ClippedTets, TetMesh>> clipped_;
    std::vector<Triangle> skin_;
    std::vector<Vector3> at_rest_;  ///< zero displacement
    SlicePlane plane_;
    BodySlice rest_, now_;
    std::optional<double> rest_at_;  ///< position of the slice that rest_ was computed for
    std::vector<OutlinePiece> outline_, rest_outline_, regions_;
    vtkNew<vtkImageData> pixels_;
    vtkNew<vtkImageSliceMapper> mapper_;
    vtkNew<vtkImageSlice> slice_;
    vtkNew<vtkPolyData> lines_;
    vtkNew<vtkTextActor> title_;
    TextLayout texts_;
};

/// Three slices linked by a cross-hair.
class SliceViews {
  public:
    /// `renderers`: of the axial, coronal and sagittal slice.
    SliceViews(const ShownBody& body, const std::array<vtkRenderer*, 3>& renderers);

    /// The body's mesh has changed: call it before the next `show`.
    void take_mesh();
    void show(int view, const ShownMoment& moment);
    void set_cross(const Vector3& cross);
    const Vector3& cross() const { return cross_; }
    void set_window(double window, double level);
    double window() const { return window_; }
    double level() const { return level_; }
    void set_deformed(bool deformed) { deformed_ = deformed; }
    bool is_deformed() const { return deformed_; }
    /// The slice of a renderer, or nullptr.
    SliceView* of(const vtkRenderer* renderer);
    void fit();
    void set_texts(const TextLayout& texts);

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
