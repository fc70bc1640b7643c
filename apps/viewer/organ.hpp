#pragma once

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>

#include "apps/viewer/body.hpp"
#include "mesh/barycentric_map.hpp"

namespace livetet {

enum class ColourBy { displacement, von_mises };

/// Draws the organ's surface, which is finer than the mesh: each of its points moves with the tet
/// that it lies in or is nearest to. Coloured by displacement (mm) or von Mises stress (Pa), with a
/// colour bar.
class OrganView {
  public:
    OrganView(const ShownBody& body, vtkRenderer* renderer);

    void show(const ShownMoment& moment);
    /// Sets the upper end of the colour range, in m or Pa.
    void set_range(ColourBy what, double largest);
    double range(ColourBy what) const { return largest_[static_cast<int>(what)]; }
    void set_colour(ColourBy what);
    ColourBy colour() const { return colour_; }
    /// Places the bar in a view of this width, with room for its title.
    void make_room(double width_pixels);
    vtkActor* actor() { return actor_; }

  private:
    void update_bar();

    const ShownBody& body_;
    BarycentricMap map_;
    double largest_[2] = {0.001, 1};
    ColourBy colour_ = ColourBy::displacement;
    vtkNew<vtkFloatArray> places_, normals_, values_;
    vtkNew<vtkPolyData> data_;
    vtkNew<vtkPolyDataMapper> mapper_;
    vtkNew<vtkActor> actor_;
    vtkNew<vtkScalarBarActor> bar_;
};

}  // namespace livetet
