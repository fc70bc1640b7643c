#include "apps/viewer/slices.hpp"

#include <vtkCamera.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>

#include "apps/plots/off_screen_window.hpp"
#include "apps/viewer/colours.hpp"
#include "apps/viewer/lines.hpp"

namespace livetet {

namespace {

constexpr int max_pixels = 320;  // along a side of a slice
constexpr int title_font = 13;
constexpr double near_plane = 0.01;  // m: points this near to a slice are drawn in it

/// Screen directions, in RAS, of slices across x, y and z.
struct Axes {
    const char* name;
    char letter;
    Vector3 right, up;
};
const Axes axes_of[3] = {{"sagittal", 'x', -Vector3::UnitY(), Vector3::UnitZ()},
                         {"coronal", 'y', -Vector3::UnitX(), Vector3::UnitZ()},
                         {"axial", 'z', -Vector3::UnitX(), Vector3::UnitY()}};

/// The 1 % and 99 % quantiles of an image's voxels.
std::pair<double, double> usual_values(const GreyImage& image) {
    std::vector<float> some;
    for (std::size_t i = 0; i < image.values.size();
         i += std::max<std::size_t>(1, image.values.size() / 100000))
        some.push_back(image.values[i]);
    std::sort(some.begin(), some.end());
    return {some[some.size() / 100], some[some.size() * 99 / 100]};
}

}  // namespace

SliceView::SliceView(const ShownBody& body, const ImageSampler& sampler, int axis,
                     vtkLookupTable* table, vtkRenderer* renderer)
    : body_(body), sampler_(sampler), axis_(axis), renderer_(renderer) {
    take_mesh();
    const Eigen::AlignedBox3d box = box_of(grid_of(*body.image));
    const Axes& axes = axes_of[axis];
    const double width = std::abs(axes.right.dot(box.sizes())),
                 height = std::abs(axes.up.dot(box.sizes()));
    const double finest =
        ImageGrid{body.image->size, body.image->ras_from_voxel}.spacing().minCoeff();
    spacing_ = std::max(finest, std::max(width, height) / (max_pixels - 1));
    plane_.right = spacing_ * axes.right;
    plane_.up = spacing_ * axes.up;
    plane_.width = static_cast<int>(width / spacing_) + 1;
    plane_.height = static_cast<int>(height / spacing_) + 1;
    for (int d = 0; d < 3; ++d)
        plane_.origin[d] = (axes.right + axes.up)[d] < 0 ? box.max()[d] : box.min()[d];

    pixels_->SetDimensions(plane_.width, plane_.height, 1);
    pixels_->AllocateScalars(VTK_FLOAT, 1);
    mapper_->SetInputData(pixels_);
    slice_->SetMapper(mapper_);
    slice_->GetProperty()->SetLookupTable(table);
    slice_->GetProperty()->UseLookupTableScalarRangeOn();
    slice_->GetProperty()->SetInterpolationTypeToLinear();
    renderer->AddViewProp(slice_);

    vtkNew<vtkPolyDataMapper> line_mapper;
    line_mapper->SetInputData(lines_);
    line_mapper->SetScalarModeToUseCellData();
    vtkNew<vtkActor> line_actor;
    line_actor->SetMapper(line_mapper);
    line_actor->SetPosition(0, 0, 1);
    line_actor->GetProperty()->SetLineWidth(1.5);
    line_actor->GetProperty()->LightingOff();
    renderer->AddActor(line_actor);

    set_text(title_->GetTextProperty(), title_font);
    title_->GetTextProperty()->SetColor(1, 1, 1);
    title_->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
    title_->SetPosition(0.02, 0.02);
    renderer->AddViewProp(title_);
    renderer->SetBackground(0, 0, 0);
    renderer->GetActiveCamera()->ParallelProjectionOn();
}

void SliceView::take_mesh() {
    const TetMesh& whole = body_.mesh;
    clipped_.reset();
    if (!whole.shares.empty()) {
        ClippedTets tets = clipped_grid(whole);
        TetMesh mesh;
        mesh.nodes = tets.at_nodes(whole.nodes);
        mesh.tets = tets.tets;
        clipped_.emplace(std::move(tets), std::move(mesh));
    }
    skin_ = boundary_triangles(sliced().tets);
    at_rest_.assign(sliced().nodes.size(), Vector3::Zero());
    rest_at_.reset();
}

void SliceView::fit() {
    const double x = 0.5 * (plane_.width - 1), y = 0.5 * (plane_.height - 1);
    vtkCamera* camera = renderer_->GetActiveCamera();
    camera->SetFocalPoint(x, y, 0);
    camera->SetPosition(x, y, 100);
    camera->SetViewUp(0, 1, 0);
    const double aspect = renderer_->GetTiledAspectRatio();
    camera->SetParallelScale(
        0.5 * std::max<double>(plane_.height, aspect > 0 ? plane_.width / aspect : plane_.height));
    camera->SetClippingRange(1, 200);
}

Vector3 SliceView::point_at(int x, int y) const {
    double view[3] = {static_cast<double>(x), static_cast<double>(y), 0}, world[4];
    renderer_->SetDisplayPoint(view[0], view[1], 0);
    renderer_->DisplayToWorld();
    renderer_->GetWorldPoint(world);
    return plane_.at(world[0] / world[3], world[1] / world[3]);
}

void SliceView::show(const ShownMoment& moment, bool deformed, const Vector3& cross) {
    plane_.origin[axis_] = cross[axis_];
    if (rest_at_ != cross[axis_]) {
        slice_body(sliced(), at_rest_, plane_, rest_);
        slice_outline(sliced().nodes, at_rest_, skin_, plane_, rest_outline_);
        rest_at_ = cross[axis_];
    }
    const std::vector<Vector3> displacement = !deformed ? at_rest_
                                              : clipped_
                                                  ? clipped_->first.at_nodes(moment.displacement)
                                                  : moment.displacement;
    if (deformed) slice_body(sliced(), displacement, plane_, now_);
    slice_outline(sliced().nodes, displacement, skin_, plane_, outline_);
    sample_slice(sampler_, plane_, rest_, deformed ? now_ : rest_,
                 {static_cast<float*>(pixels_->GetScalarPointer()), plane_.size()});
    pixels_->GetPointData()->GetScalars()->Modified();
    pixels_->Modified();
    cut_regions(moment, deformed);
    draw_lines(moment, cross);
    const Axes& axes = axes_of[axis_];
    title_->SetInput(fmt::format("{}{} = {:.1f} mm{}",
                                 texts_.is_small ? "" : std::string(axes.name) + " ", axes.letter,
                                 1e3 * cross[axis_], deformed ? "" : ", at rest")
                         .c_str());
}

void SliceView::set_texts(const TextLayout& texts) {
    texts_ = texts;
    title_->GetTextProperty()->SetFontSize(texts.font_size(title_font));
}

/// Finds the outlines of the targets' ellipsoids. Their places are in the deformed organ: an image
/// at rest gets none.
void SliceView::cut_regions(const ShownMoment& moment, bool deformed) {
    regions_.clear();
    if (!deformed) return;
    std::vector<OutlinePiece> outline;
    for (const ShownTarget& target : moment.targets) {
        const auto& [nodes, triangles] = target.region;
        const std::vector<Vector3> unmoved(nodes.size(), Vector3::Zero());
        slice_outline(nodes, unmoved, triangles, plane_, outline);
        regions_.insert(regions_.end(), outline.begin(), outline.end());
    }
}

void SliceView::draw_lines(const ShownMoment& moment, const Vector3& cross) {
    ColouredLines lines;
    const auto pixel = [&](const Vector3& x) -> Vector3 {
        const Vector3 way = x - plane_.origin;
        return Vector3(way.dot(plane_.right), way.dot(plane_.up), 0) / (spacing_ * spacing_);
    };
    const auto add_outline = [&](const std::vector<OutlinePiece>& outline,
                                 const look::Colour& colour) {
        for (const auto& [a, b] : outline) lines.add({a.x(), a.y(), 0}, {b.x(), b.y(), 0}, colour);
    };
    const auto is_near = [&](const Vector3& x) {
        return std::abs(x[axis_] - cross[axis_]) < near_plane;
    };
    add_outline(rest_outline_, mark_colour::rest);
    add_outline(outline_, mark_colour::outline);
    add_outline(regions_, mark_colour::target);
    const Vector3 middle = pixel(cross);
    lines.add({0, middle.y(), 0}, {plane_.width - 1.0, middle.y(), 0}, mark_colour::cross);
    lines.add({middle.x(), 0, 0}, {middle.x(), plane_.height - 1.0, 0}, mark_colour::cross);
    const double size = 0.004 / spacing_;
    for (const ShownFiducial& f : body_.fiducials)
        if (is_near(f.in_image)) lines.add_cross(pixel(f.in_image), size, 2, mark_colour::fiducial);
    for (const ShownSensor& s : moment.sensors)
        if (s.base && s.now && is_near(*s.base)) {
            lines.add_cross(pixel(*s.base), size, 2, mark_colour::base);
            lines.add(pixel(*s.base), pixel(*s.now), mark_colour::sensor);
        }
    if (moment.pull && is_near(moment.pull->base)) {
        lines.add_cross(pixel(moment.pull->base), size, 2, mark_colour::pull);
        lines.add(pixel(moment.pull->base), pixel(moment.pull->to), mark_colour::pull);
    }
    for (std::size_t k = 1; k < moment.drawn.size(); ++k)
        if (is_near(moment.drawn[k - 1]) && is_near(moment.drawn[k]))
            lines.add(pixel(moment.drawn[k - 1]), pixel(moment.drawn[k]), mark_colour::pull);
    lines.put_into(lines_);
}

SliceViews::SliceViews(const ShownBody& body, const std::array<vtkRenderer*, 3>& renderers)
    : image_(*body.image), sampler_(image_) {
    table_->SetNumberOfTableValues(256);
    for (int i = 0; i < 256; ++i) table_->SetTableValue(i, i / 255.0, i / 255.0, i / 255.0);
    table_->SetNanColor(mark_colour::unknown[0], mark_colour::unknown[1], mark_colour::unknown[2],
                        1);
    const auto [low, high] = usual_values(image_);
    set_window(std::max(high - low, 1e-6), 0.5 * (low + high));
    for (int i = 0; i < 3; ++i)
        views_[i] = std::make_unique<SliceView>(body, sampler_, 2 - i, table_, renderers[i]);
    Eigen::AlignedBox3d box;
    for (const Vector3& x : body.mesh.nodes) box.extend(x);
    set_cross(box.center());
    fit();
}

void SliceViews::take_mesh() {
    for (const auto& view : views_) view->take_mesh();
}

void SliceViews::show(int view, const ShownMoment& moment) {
    views_[view]->show(moment, deformed_, cross_);
}

void SliceViews::set_cross(const Vector3& cross) {
    const Eigen::AlignedBox3d box = box_of(grid_of(image_));
    cross_ = cross.cwiseMax(box.min()).cwiseMin(box.max());
}

void SliceViews::set_window(double window, double level) {
    window_ = std::max(window, 1e-6);
    level_ = level;
    table_->SetTableRange(level_ - window_ / 2, level_ + window_ / 2);
}

SliceView* SliceViews::of(const vtkRenderer* renderer) {
    for (const auto& view : views_)
        if (view->renderer() == renderer) return view.get();
    return nullptr;
}

void SliceViews::set_texts(const TextLayout& texts) {
    for (const auto& view : views_) view->set_texts(texts);
}

void SliceViews::fit() {
    for (const auto& view : views_) view->fit();
}

}  // namespace livetet
