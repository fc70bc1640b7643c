#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/plots/off_screen_window.hpp"
#include "apps/plots/pictures.hpp"
#include "base/error.hpp"

namespace livetet {

namespace {

constexpr double left = 330, right = look::width - 20.0, bottom = 60;

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

/// Where a matrix's boxes are.
struct Layout {
    double width, top, height;  ///< width and height of a cell
    bool is_narrow;             ///< names of the second part stand upright, of the third letters

    explicit Layout(const MatrixPicture& m) {
        constexpr double least_width = 14, turned_head = 250, head = 150;
        width = (right - left) / static_cast<double>(m.columns.size());
        is_narrow = width < least_width;
        top = look::height - (is_narrow ? turned_head : head);
        height = std::min(30.0, (top - bottom) / static_cast<double>(m.rows.size()));
    }
    double x(std::size_t column) const { return left + width * static_cast<double>(column); }
};

bool begins(const MatrixPicture& m, std::size_t column, std::size_t part) {
    return column == 0 || m.columns[column][part] != m.columns[column - 1][part] ||
           (part > 0 && begins(m, column, part - 1));
}

void add_heads(Sheet& sheet, const MatrixPicture& m, const Layout& at) {
    sheet.text(m.title, 26, left, look::height - 40, TextWeight::bold);
    for (std::size_t k = 0; k < m.columns.size(); ++k) {
        const auto& [first, second, third] = m.columns[k];
        if (begins(m, k, 0))
            sheet.text(first, at.is_narrow ? 13 : 18, at.x(k), look::height - 72, TextWeight::bold);
        if (at.is_narrow) {
            if (begins(m, k, 1))
                sheet.text(second, 12, at.x(k) + 1.7 * at.width, at.top + 20, TextWeight::regular,
                           90);
            sheet.text(third.substr(0, 1), 10, at.x(k) + 0.2 * at.width, at.top + 5);
            continue;
        }
        if (begins(m, k, 1)) sheet.text(second, 15, at.x(k), look::height - 94);
        sheet.text(third.substr(0, 7), 12, at.x(k) + 0.65 * at.width, at.top + 6,
                   TextWeight::regular, 90);
    }
}

void add_key(Sheet& sheet, const MatrixPicture& m, const Layout& at) {
    double x = left;
    for (const auto& [cell, words] : {std::pair{MatrixCell::good, "passes"},
                                      std::pair{MatrixCell::neither, "refused or left out"},
                                      std::pair{MatrixCell::bad, "fails, with its reason"}}) {
        sheet.box(x, 20, 22, 22, colour_of(cell));
        sheet.text(words, 16, x + 32, 22);
        x += 250;
    }
    if (!at.is_narrow) return;
    std::vector<std::string> thirds;
    for (const auto& column : m.columns)
        if (std::ranges::find(thirds, column[2]) == thirds.end()) thirds.push_back(column[2]);
    std::string letters;
    for (const std::string& name : thirds)
        letters += (letters.empty() ? "" : ", ") + name.substr(0, 1) + " " + name;
    sheet.text(letters, 16, x, 22);
}

}  // namespace

void write_matrix_picture(const std::filesystem::path& path, const MatrixPicture& m) {
    if (m.rows.empty() || m.cells.size() != m.rows.size() * m.columns.size())
        fail("matrix picture: {} cells, expected {} rows of {}", m.cells.size(), m.rows.size(),
             m.columns.size());
    Sheet sheet;
    const Layout at(m);
    add_heads(sheet, m, at);
    for (std::size_t r = 0; r < m.rows.size(); ++r) {
        const double y = at.top - at.height * static_cast<double>(r + 1);
        sheet.text(m.rows[r], std::clamp(static_cast<int>(0.72 * at.height), 8, 15), 20,
                   y + 0.2 * at.height);
        for (std::size_t k = 0; k < m.columns.size(); ++k) {
            const double gap = k > 0 && begins(m, k, 1) ? 3 : 1;
            sheet.box(at.x(k) + gap, y + 1, at.width - gap, at.height - 2,
                      colour_of(m.cells[r * m.columns.size() + k]));
        }
    }
    add_key(sheet, m, at);
    sheet.write(path);
}

}  // namespace livetet
