#pragma once

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Core>

#include "apps/plots/off_screen_window.hpp"

namespace livetet {

/// Collects coloured lines for a vtkPolyData.
class ColouredLines {
  public:
    ColouredLines() { colours_->SetNumberOfComponents(3); }

    void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const look::Colour& colour) {
        const vtkIdType ids[2] = {points_->InsertNextPoint(a.data()),
                                  points_->InsertNextPoint(b.data())};
        cells_->InsertNextCell(2, ids);
        unsigned char c[3];
        for (int k = 0; k < 3; ++k) c[k] = static_cast<unsigned char>(255 * colour[k]);
        colours_->InsertNextTypedTuple(c);
    }
    /// A cross with arms of this size along the first `axes` axes.
    void add_cross(const Eigen::Vector3d& at, double size, int axes, const look::Colour& colour) {
        for (int d = 0; d < axes; ++d) {
            const Eigen::Vector3d way = size * Eigen::Vector3d::Unit(d);
            add(at - way, at + way, colour);
        }
    }
    void put_into(vtkPolyData* data) {
        data->SetPoints(points_);
        data->SetLines(cells_);
        data->GetCellData()->SetScalars(colours_);
    }

  private:
    vtkNew<vtkPoints> points_;
    vtkNew<vtkCellArray> cells_;
    vtkNew<vtkUnsignedCharArray> colours_;
};

}  // namespace livetet
