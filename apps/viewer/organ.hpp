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

#include <optional>

#include "apps/viewer/body.hpp"
#include "apps/viewer/text_layout.hpp"
#include "geometry/scattered_interpolation.hpp"
#include "mesh/barycentric_map.hpp"

namespace livetet {

enum class ColourBy { displacement, von_mises, stated_error };

/// Draws the organ's surface, which is finer than the mesh: each of its points moves with the tet
/// that it lies in or is nearest to. Coloured by displacement (mm), von Mises stress (Pa) or the
/// 95 % radius of the stated error (mm), with a colour bar. A stated error is interpolated between
/// its places; an asterisk in the bar's title says that it lacks sources.
class OrganView {
  public:
    OrganView(const ShownBody& body, vtkRenderer* renderer);

    /// The body's mesh and surface have changed: call it before the next `show`.
    void take_surface();
    void show(const ShownMoment& moment);
    /// Whether the moment has values for this colour. Without, displacements are shown.
    bool can_show(const ShownMoment& moment, ColourBy what) const;
    /// Sets the upper end of the colour range, in m or Pa.
    void set_range(ColourBy what, double largest);
    double range(ColourBy what) const { return largest_[static_cast<int>(what)]; }
    void set_colour(ColourBy what);
    ColourBy colour() const { return colour_; }
    /// Places the bar in a view of this width, with room for its title.
    void make_room(double width_pixels, const TextLayout& texts);
    vtkActor* actor() { return actor_; }

  private:
    void update_bar();
    /// In the unit of the bar.
    double value_at(std::size_t point, const Vector3& u, const ShownMoment& moment,
                    ColourBy what) const;

    const ShownBody& body_;
    BarycentricMap map_;
    std::optional<ScatteredInterpolation> stated_;  ///< from the places of stated errors
    bool lacks_sources_ = false;                    ///< the stated error does
    double largest_[3] = {0.001, 1, 0.001};
    ColourBy colour_ = ColourBy::displacement;
    vtkNew<vtkFloatArray> places_, normals_, values_;
    vtkNew<vtkPolyData> data_;
    vtkNew<vtkPolyDataMapper> mapper_;
    vtkNew<vtkActor> actor_;
    vtkNew<vtkScalarBarActor> bar_;
};

}  // namespace livetet
