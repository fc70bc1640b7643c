#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

#include "apps/plots/off_screen_window.hpp"
#include "apps/plots/pictures.hpp"
#include "base/error.hpp"

namespace livetet {

namespace {

constexpr double left = 330, right = look::width - 20.0, top = look::height - 150.0, bottom = 60;

look::Colour colour_of(MatrixCell cell) {
    switch (cell) {
        case MatrixCell::good:
            return {0.55, 0.78, 0.55};
        case MatrixCell::neither:
            return {0.95, 0.78, 0.35};
        case MatrixCell::bad:
            break;
    }
    return look::red;
}

class Sheet {
  public:
    Sheet() {
        renderer_->SetBackground(look::paper.data());
        window_->AddRenderer(renderer_);
        colours_->SetNumberOfComponents(3);
    }

    void box(double x, double y, double width, double height, const look::Colour& colour) {
        const vtkIdType first = points_->InsertNextPoint(x, y, 0);
        points_->InsertNextPoint(x + width, y, 0);
        points_->InsertNextPoint(x + width, y + height, 0);
        points_->InsertNextPoint(x, y + height, 0);
        quads_->InsertNextCell({first, first + 1, first + 2, first + 3});
        for (const double part : colour)
            colours_->InsertNextValue(static_cast<unsigned char>(255 * part));
    }

    void text(const std::string& words, int size, double x, double y,
              TextWeight weight = TextWeight::regular, double turned = 0) {
        vtkNew<vtkTextActor> actor;
        actor->SetInput(words.c_str());
        set_text(actor->GetTextProperty(), size, weight);
        actor->GetTextProperty()->SetOrientation(turned);
        actor->SetPosition(x, y);
        renderer_->AddActor2D(actor);
    }

    void write(const std::filesystem::path& path) {
        vtkNew<vtkPolyData> boxes;
        boxes->SetPoints(points_);
        boxes->SetPolys(quads_);
        boxes->GetCellData()->SetScalars(colours_);
        vtkNew<vtkPolyDataMapper2D> mapper;
        mapper->SetInputData(boxes);
        vtkNew<vtkActor2D> actor;
        actor->SetMapper(mapper);
        renderer_->AddActor2D(actor);
        write_window(window_, path);
    }

  private:
    vtkSmartPointer<vtkRenderWindow> window_ = make_window();
    vtkNew<vtkRenderer> renderer_;
    vtkNew<vtkPoints> points_;
    vtkNew<vtkCellArray> quads_;
    vtkNew<vtkUnsignedCharArray> colours_;
};

}  // namespace

void write_matrix_picture(const std::filesystem::path& path, const MatrixPicture& m) {
    if (m.rows.empty() || m.cells.size() != m.rows.size() * m.columns.size())
        fail("matrix picture: {} cells, expected {} rows of {}", m.cells.size(), m.rows.size(),
             m.columns.size());
    Sheet sheet;
    const double width = (right - left) / static_cast<double>(m.columns.size());
    const double height = std::min(30.0, (top - bottom) / static_cast<double>(m.rows.size()));
    sheet.text(m.title, 26, left, look::height - 40, TextWeight::bold);
    for (std::size_t k = 0; k < m.columns.size(); ++k) {
        const double x = left + width * static_cast<double>(k);
        if (k == 0 || m.columns[k][0] != m.columns[k - 1][0])
            sheet.text(m.columns[k][0], 18, x, look::height - 72, TextWeight::bold);
        if (k == 0 || m.columns[k][1] != m.columns[k - 1][1])
            sheet.text(m.columns[k][1], 15, x, look::height - 94);
        sheet.text(m.columns[k][2].substr(0, 7), 12, x + 0.65 * width, top + 6, TextWeight::regular,
                   90);
    }
    for (std::size_t r = 0; r < m.rows.size(); ++r) {
        const double y = top - height * static_cast<double>(r + 1);
        sheet.text(m.rows[r], std::clamp(static_cast<int>(0.72 * height), 8, 15), 20,
                   y + 0.2 * height);
        for (std::size_t k = 0; k < m.columns.size(); ++k) {
            const bool begins = k > 0 && m.columns[k][1] != m.columns[k - 1][1];
            const double gap = begins ? 3 : 1;
            sheet.box(left + width * static_cast<double>(k) + gap, y + 1, width - gap, height - 2,
                      colour_of(m.cells[r * m.columns.size() + k]));
        }
    }
    double x = left;
    for (const auto& [cell, words] : {std::pair{MatrixCell::good, "passes"},
                                      std::pair{MatrixCell::neither, "refused or left out"},
                                      std::pair{MatrixCell::bad, "fails, with its reason"}}) {
        sheet.box(x, 20, 22, 22, colour_of(cell));
        sheet.text(words, 16, x + 32, 22);
        x += 280;
    }
    sheet.write(path);
}

}  // namespace livetet
