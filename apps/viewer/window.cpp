#include "apps/viewer/window.hpp"

#include <vtkActor2D.h>
#include <vtkCamera.h>
#include <vtkCoordinate.h>
#include <vtkLight.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkProperty2D.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/plots/off_screen_window.hpp"
#include "apps/plots/zoom_to_fill.hpp"
#include "apps/viewer/colours.hpp"
#include "apps/viewer/lines.hpp"
#include "base/error.hpp"
#include "base/log.hpp"

namespace livetet {

namespace {

constexpr double organ_width = 0.66;
constexpr int strip_pixels = 60;  ///< pixels: two lines of text and the time line
constexpr double line_height = 0.78;
constexpr int text_font = 14, help_font = 11;  ///< pixels

constexpr const char* help_text =
    "space play   left/right step   c colour   d rest/deformed   v volume   r reset   s screenshot "
    "  x let go   k knife   q quit      "
    "slices: left cross-hair, right window and level, wheel through, shift+left (or middle) pull";
constexpr const char* knife_text =
    "knife: the left button draws a line, over the organ or a slice, along which the organ is cut; "
    "k puts the knife away";

}  // namespace

ViewWindow::ViewWindow(const ShownBody& body, Surface surface, std::array<int, 2> size)
    : body_(body) {
    route_messages();
    window_ = vtkSmartPointer<vtkRenderWindow>::New();
    window_->SetOffScreenRendering(surface == Surface::off_screen);
    window_->SetMultiSamples(0);
    window_->SetSize(size[0], size[1]);
    window_->SetWindowName("Livetet");
    const bool has_slices = body.image.has_value();
    organ_renderer_->SetBackground(look::paper.data());
    window_->AddRenderer(organ_renderer_);
    vtkNew<vtkLight> light;  // one light, over the camera's left shoulder: in software each costs
                             // as much as the rest
    light->SetLightTypeToCameraLight();
    light->SetPosition(-0.5, 0.6, 1);
    organ_renderer_->AddLight(light);
    organ_ = std::make_unique<OrganView>(body, organ_renderer_);
    marks_ = std::make_unique<MarksView>(body, organ_renderer_);
    regions_ = std::make_unique<RegionsView>(window_, organ_renderer_);
    if (has_slices) {
        for (const auto& renderer : slice_renderers_) window_->AddRenderer(renderer);
        slices_ = std::make_unique<SliceViews>(
            body, std::array<vtkRenderer*, 3>{slice_renderers_[0], slice_renderers_[1],
                                              slice_renderers_[2]});
        volume_ = std::make_unique<VolumeView>(body, organ_renderer_);
    }
    add_strip();

    organ_renderer_->GetActiveCamera()->SetPosition(-0.35, 1,
                                                    0.45);  // from the front, left and above
    organ_renderer_->GetActiveCamera()->SetViewUp(0, 0, 1);
    moment_.displacement.assign(body.mesh.nodes.size(), Vector3::Zero());
    for (const Vector3& x : body.mesh.nodes) extent_.extend(x);
    listen(surface);
    arrange();
    reset();
}

ViewWindow::~ViewWindow() = default;

void ViewWindow::arrange() {
    const int* size = window_->GetSize();
    if (arranged_ == std::array{size[0], size[1]}) return;
    arranged_ = {size[0], size[1]};
    const double strip = std::min(0.4, static_cast<double>(strip_pixels) / std::max(size[1], 1));
    strip_->SetViewport(0, 0, 1, strip);
    organ_renderer_->SetViewport(0, strip, slices_ ? organ_width : 1, 1);
    const TextLayout texts = text_layout(arranged_);
    organ_->make_room((slices_ ? organ_width : 1) * size[0], texts);
    marks_->set_texts(texts);
    regions_->set_font_size(texts.font_size(13));
    if (slices_) slices_->set_texts(texts);
    text_->GetTextProperty()->SetFontSize(texts.font_size(text_font));
    help_->SetVisibility(!texts.is_small);
    help_->GetTextProperty()->SetFontSize(texts.font_size(help_font));
    for (int i = 0; i < 3; ++i) {
        const double height = (1 - strip) / 3, bottom = strip + (2 - i) * height;
        slice_renderers_[i]->SetViewport(organ_width + 0.002, bottom, 1, bottom + height - 0.004);
    }
    if (slices_) slices_->fit();
    renew();
}

void ViewWindow::add_strip() {
    strip_->SetBackground(0.94, 0.94, 0.95);
    window_->AddRenderer(strip_);
    vtkNew<vtkCoordinate> share;
    share->SetCoordinateSystemToNormalizedViewport();
    vtkNew<vtkPolyDataMapper2D> mapper;
    mapper->SetInputData(time_line_);
    mapper->SetTransformCoordinate(share);
    vtkNew<vtkActor2D> line;
    line->SetMapper(mapper);
    line->GetProperty()->SetLineWidth(4);
    strip_->AddViewProp(line);
    for (const auto& [actor, y, size] :
         {std::tuple(text_.Get(), 0.36, text_font), {help_.Get(), 0.06, help_font}}) {
        set_text(actor->GetTextProperty(), size);
        actor->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
        actor->SetPosition(line_left, y);
        strip_->AddViewProp(actor);
    }
    help_->SetInput(help_text);
    help_->GetTextProperty()->SetColor(look::grey[0], look::grey[1], look::grey[2]);
    set_time({});
}

void ViewWindow::set_time(std::optional<double> share) {
    ColouredLines lines;
    if (share) {
        const double x = line_left + std::clamp(*share, 0.0, 1.0) * (line_right - line_left);
        lines.add({line_left, line_height, 0}, {line_right, line_height, 0}, {0.78, 0.78, 0.80});
        lines.add({line_left, line_height, 0}, {x, line_height, 0}, look::blue);
        lines.add({x, line_height - 0.14, 0}, {x, line_height + 0.14, 0}, look::blue);
    }
    lines.put_into(time_line_);
    changed_ = true;
}

void ViewWindow::change_body(ShownMoment first) {
    organ_->take_surface();
    if (slices_) slices_->take_mesh();
    show(std::move(first));
}

void ViewWindow::take_knife() {
    if (!hand_.cut_depth) {
        log_warning(
            "nothing is cut here, expected livetet view SCENE, and track.cut_by_hand_mm in the "
            "scene");
        return;
    }
    hand_.has_knife = !hand_.has_knife;
    help_->SetInput(hand_.has_knife ? knife_text : help_text);
    changed_ = true;
}

void ViewWindow::show(ShownMoment moment) {
    moment.drawn = std::move(moment_.drawn);
    moment_ = std::move(moment);
    stale_ = true;
}

void ViewWindow::renew_texts() {
    stale_ = stale_ || moment_.keeps_numbers;
    moment_.keeps_numbers = false;
}

void ViewWindow::set_range(ColourBy what, double largest) {
    organ_->set_range(what, largest);
    renew();
}

void ViewWindow::grow_range() {
    const auto grow = [&](ColourBy what, double largest, double step) {
        if (largest > organ_->range(what)) set_range(what, step * std::ceil(largest / step));
    };
    double largest = 0;
    for (const Vector3& u : moment_.displacement) largest = std::max(largest, u.squaredNorm());
    grow(ColourBy::displacement, std::sqrt(largest), 0.005);
    if (!moment_.stated.radius_95.empty())
        grow(ColourBy::stated_error, std::ranges::max(moment_.stated.radius_95), 0.001);
}

void ViewWindow::set_colour(ColourBy what) {
    if (what == ColourBy::von_mises && !organ_->can_show(moment_, what))
        fail(
            "there are no stresses, expected the result of a solve with output: {{fields: "
            "[von_mises]}}");
    if (what == ColourBy::stated_error && body_.stated_places.empty())
        fail("no error over the surface is stated, expected a scene with track.targets");
    organ_->set_colour(what);
    renew();
}

void ViewWindow::change_colour() {
    constexpr std::array order{ColourBy::displacement, ColourBy::von_mises, ColourBy::stated_error};
    auto next = std::ranges::find(order, organ_->colour());
    do {
        if (++next == order.end()) next = order.begin();
    } while (!organ_->can_show(moment_, *next));
    set_colour(*next);
}

void ViewWindow::set_deformed(bool deformed) {
    if (slices_) slices_->set_deformed(deformed);
    renew();
}

void ViewWindow::set_cross(const Vector3& cross) {
    if (slices_) slices_->set_cross(cross);
    renew();
}

void ViewWindow::set_window(double window, double level) {
    if (slices_) slices_->set_window(window, level);
    changed_ = true;
}

void ViewWindow::set_volume(bool visible) {
    if (!volume_) return;
    volume_->set_visible(visible);
    organ_->actor()->SetVisibility(!visible);
    renew();
}

void ViewWindow::look_from(Look look) {
    const Vector3 towards[] = {Vector3::UnitY(), -Vector3::UnitY(), -Vector3::UnitX(),
                               Vector3::UnitX(), Vector3::UnitZ(),  -Vector3::UnitZ()};
    const Vector3 from = towards[static_cast<int>(look)];
    const bool upright = look != Look::above && look != Look::below;
    vtkCamera* camera = organ_renderer_->GetActiveCamera();
    camera->SetFocalPoint(0, 0, 0);
    camera->SetPosition(from.x(), from.y(), from.z());
    camera->SetViewUp(0, upright ? 0 : 1, upright ? 1 : 0);
    reset();
}

void ViewWindow::zoom(double factor) {
    organ_renderer_->GetActiveCamera()->Zoom(factor);
    changed_ = true;
}

void ViewWindow::set_extent(const Eigen::AlignedBox3d& extent) {
    extent_ = extent;
    reset();
}

void ViewWindow::reset() {
    Eigen::AlignedBox3d box = extent_;
    for (std::size_t n = 0; n < body_.mesh.nodes.size(); ++n)
        box.extend(body_.mesh.nodes[n] + moment_.displacement[n]);
    box.min() *= 1e3;  // mm
    box.max() *= 1e3;
    const double bounds[6] = {box.min().x(), box.max().x(), box.min().y(),
                              box.max().y(), box.min().z(), box.max().z()};
    organ_renderer_->GetActiveCamera()->SetViewAngle(30);
    organ_renderer_->ResetCamera(bounds);
    // Leaves a margin; long bodies fit as well.
    std::vector<Vector3> corners;
    for (int corner = 0; corner < 8; ++corner)
        corners.push_back(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
    constexpr double max_zoom = 1.1, extent = 0.85;
    organ_renderer_->GetActiveCamera()->Zoom(
        std::min(max_zoom, zoom_to_fill(organ_renderer_, corners, extent, extent)));
    if (slices_) slices_->fit();
    changed_ = true;
}

bool ViewWindow::draw() {
    arrange();
    if (!stale_ && !changed_) return false;
    const bool in_turn = turns_.are_taken && !changed_;
    if (in_turn) turns_.slice = (turns_.slice + 1) % 3;
    const auto is_drawn = [&](int slice) { return !in_turn || slice == turns_.slice; };
    if (stale_) {
        organ_->show(moment_);
        marks_->show(moment_);
        regions_->show(moment_);
        for (int i = 0; slices_ && i < 3; ++i)
            if (is_drawn(i)) slices_->show(i, moment_);
        if (volume_) volume_->show(moment_);
        if (!moment_.keeps_numbers) text_->SetInput(moment_.text.c_str());
    }
    stale_ = changed_ = false;
    regions_->fit_clipping_range();
    regions_->spread_labels(marks_->label_boxes());
    for (int i = 0; i < 3; ++i)
        slice_renderers_[i]->SetDraw(is_drawn(i));  // otherwise the old picture stays
    window_->Render();
    for (const auto& renderer : slice_renderers_) renderer->DrawOn();
    return true;
}

void ViewWindow::write_png(const std::filesystem::path& path) {
    renew_texts();
    if (turns_.are_taken) renew();
    draw();
    write_window(window_, path);
}

}  // namespace livetet
