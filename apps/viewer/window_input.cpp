#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCellPicker.h>
#include <vtkGenericRenderWindowInteractor.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/viewer/window.hpp"
#include "base/log.hpp"

namespace livetet {

namespace {

/// The first of view_001.png, view_002.png ... that does not exist.
std::filesystem::path free_name() {
    for (int k = 1;; ++k)
        if (std::filesystem::path name = fmt::format("view_{:03}.png", k);
            !std::filesystem::exists(name))
            return name;
}

}  // namespace

/// Handles the mouse over slices and time line; over the organ it rotates VTK's camera.
class ViewWindow::Style : public vtkInteractorStyleTrackballCamera {
  public:
    static Style* New();
    vtkTypeMacro(Style, vtkInteractorStyleTrackballCamera);
    ViewWindow* window = nullptr;

    void OnLeftButtonDown() override { down(MouseButton::left); }
    void OnMiddleButtonDown() override { down(MouseButton::middle); }
    void OnRightButtonDown() override { down(MouseButton::right); }
    void OnLeftButtonUp() override {
        if (!window->mouse_up()) Superclass::OnLeftButtonUp();
    }
    void OnMiddleButtonUp() override {
        if (!window->mouse_up()) Superclass::OnMiddleButtonUp();
    }
    void OnRightButtonUp() override {
        if (!window->mouse_up()) Superclass::OnRightButtonUp();
    }
    void OnMouseMove() override {
        const int* at = Interactor->GetEventPosition();
        if (window->mouse_move(at[0], at[1])) return;
        Superclass::OnMouseMove();
        if (State != VTKIS_NONE) window->changed_ = true;
    }
    void OnMouseWheelForward() override { turn(1); }
    void OnMouseWheelBackward() override { turn(-1); }
    void OnKeyPress() override { window->press_key(Interactor->GetKeySym()); }
    void OnChar() override {}  // disables VTK's own keys

  private:
    void down(MouseButton button) {
        const int* at = Interactor->GetEventPosition();
        if (window->mouse_down(button, Interactor->GetShiftKey() != 0, at[0], at[1])) return;
        if (button == MouseButton::left) Superclass::OnLeftButtonDown();
        if (button == MouseButton::middle) Superclass::OnMiddleButtonDown();
        if (button == MouseButton::right) Superclass::OnRightButtonDown();
    }
    void turn(int steps) {
        const int* at = Interactor->GetEventPosition();
        if (window->wheel(steps, at[0], at[1])) return;
        if (steps > 0) Superclass::OnMouseWheelForward();
        if (steps < 0) Superclass::OnMouseWheelBackward();
        window->changed_ = true;
    }
};
vtkStandardNewMacro(ViewWindow::Style);

void ViewWindow::listen(Surface surface) {
    if (surface == Surface::on_screen)
        interactor_ = vtkSmartPointer<vtkRenderWindowInteractor>::New();
    else
        interactor_ = vtkSmartPointer<vtkGenericRenderWindowInteractor>::New();
    interactor_->SetRenderWindow(window_);
    vtkNew<Style> style;
    style->window = this;
    style->SetDefaultRenderer(organ_renderer_);
    interactor_->SetInteractorStyle(style);
    interactor_->EnableRenderOff();  // `draw` renders
    vtkNew<vtkCallbackCommand> redraw, close;
    redraw->SetClientData(this);
    redraw->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
        static_cast<ViewWindow*>(self)->changed_ = true;
    });
    close->SetClientData(this);
    close->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
        static_cast<ViewWindow*>(self)->closed_ = true;
    });
    interactor_->AddObserver(vtkCommand::ExposeEvent, redraw);
    interactor_->AddObserver(vtkCommand::ConfigureEvent, redraw);
    interactor_->AddObserver(vtkCommand::ExitEvent, close);
    if (surface == Surface::on_screen) interactor_->Initialize();
}

std::string ViewWindow::state() const {
    const auto mm = [](const Vector3& x) {
        return nlohmann::json{1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z()};
    };
    double largest = 0;
    for (const Vector3& u : moment_.displacement) largest = std::max(largest, u.norm());
    nlohmann::json state{{"time_s", moment_.time_s},
                         {"largest_mm", 1e3 * largest},
                         {"deformed", slices_ && slices_->is_deformed()}};
    if (slices_)
        state.update({{"cross_mm", mm(slices_->cross())},
                      {"window", slices_->window()},
                      {"level", slices_->level()}});
    if (moment_.pull)
        state["pull"] = {{"base_mm", mm(moment_.pull->base)}, {"to_mm", mm(moment_.pull->to)}};
    for (const ShownSensor& s : moment_.sensors)
        if (s.base && s.now)
            state["sensors"][s.name] = {
                {"base_mm", mm(*s.base)}, {"now_mm", mm(*s.now)}, {"patch", s.patch.size()}};
    for (const ShownTarget& t : moment_.targets)
        state["targets"][t.name] = {{"at_mm", mm(t.position)}, {"radius_95_mm", 1e3 * t.radius_95}};
    if (const std::vector<double>& radii = moment_.stated.radius_95; !radii.empty()) {
        const auto [least, most] = std::ranges::minmax(radii);
        state["stated_error"] = {{"min_mm", 1e3 * least},
                                 {"max_mm", 1e3 * most},
                                 {"lacks_sources", !moment_.stated.missing.empty()}};
    }
    return state.dump();
}

bool ViewWindow::process_events() {
    interactor_->ProcessEvents();
    return !closed_;
}

bool ViewWindow::mouse_down(MouseButton button, bool shift, int x, int y) {
    if (drag_.doing == Doing::cutting) return true;  // another button, in the middle of a line
    const vtkRenderer* under = interactor_->FindPokedRenderer(x, y);
    drag_.last = {x, y};
    if (under == strip_) {
        drag_.doing = Doing::seeking;
        return mouse_move(x, y);
    }
    drag_.slice = slices_ ? slices_->of(under) : nullptr;
    if (hand_.has_knife && button == MouseButton::left) {
        drag_.doing = Doing::cutting;
        hand_.line.edges.clear();
        return mouse_move(x, y);
    }
    if (!drag_.slice) return false;
    if (button == MouseButton::right) {
        drag_.doing = Doing::windowing;
    } else if (button == MouseButton::left && !shift) {
        drag_.doing = Doing::crossing;
    } else {
        drag_.doing = Doing::pulling;
        hand_.pull =
            HandPull{++hand_.pulls, drag_.slice->point_at(x, y), drag_.slice->point_at(x, y)};
    }
    return mouse_move(x, y);
}

bool ViewWindow::mouse_move(int x, int y) {
    switch (drag_.doing) {
        case Doing::nothing:
            return false;
        case Doing::seeking: {
            const double share = static_cast<double>(x) / window_->GetSize()[0];
            if (handlers.seek)
                handlers.seek(std::clamp((share - line_left) / (line_right - line_left), 0.0, 1.0));
            break;
        }
        case Doing::crossing:
            set_cross(drag_.slice->point_at(x, y));
            break;
        case Doing::windowing: {  // scales the window by the motion over 200 pixels, and the level
                                  // likewise
            const double per_pixel = slices_->window() / 200;
            set_window(slices_->window() + per_pixel * (x - drag_.last[0]),
                       slices_->level() + per_pixel * (y - drag_.last[1]));
            break;
        }
        case Doing::pulling:
            hand_.pull->to = drag_.slice->point_at(x, y);
            if (handlers.pull) handlers.pull(hand_.pull);
            break;
        case Doing::cutting:
            draw_line_to(x, y);
            break;
    }
    drag_.last = {x, y};
    return true;
}

bool ViewWindow::mouse_up() {
    const bool ours = drag_.doing != Doing::nothing;
    if (drag_.doing == Doing::cutting) end_line();
    drag_.doing = Doing::nothing;
    return ours;
}

/// In a slice the edge is across it. Over the organ it begins a little above the surface, where the
/// ray of sight meets it, and goes along the ray.
std::optional<ViewWindow::KnifePlace> ViewWindow::knife_at(int x, int y) {
    constexpr double above = 0.002;
    const double depth = *hand_.cut_depth;
    if (drag_.slice) {
        const Vector3 at = drag_.slice->point_at(x, y);
        const Vector3 half = 0.5 * depth * Vector3::Unit(drag_.slice->axis());
        return KnifePlace{{at - half, at + half}, at};
    }
    vtkNew<vtkCellPicker> picker;
    picker->AddPickList(organ_->actor());
    picker->PickFromListOn();
    if (picker->Pick(x, y, 0, organ_renderer_) == 0) return {};
    const Vector3 at = 1e-3 * Vector3(picker->GetPickPosition());
    const Vector3 eye = 1e-3 * Vector3(organ_renderer_->GetActiveCamera()->GetPosition());
    const Vector3 ahead = (at - eye).normalized(), begin = at - above * ahead;
    return KnifePlace{{begin, at + depth * ahead}, begin};
}

void ViewWindow::draw_line_to(int x, int y) {
    constexpr double shortest_step = 5e-4;
    const auto at = knife_at(x, y);
    if (!at) return;
    if (!moment_.drawn.empty() && (at->shown - moment_.drawn.back()).norm() < shortest_step) return;
    hand_.line.edges.push_back(at->edge);
    moment_.drawn.push_back(at->shown);
    renew();
}

void ViewWindow::end_line() {
    if (slices_ && drag_.slice && !slices_->is_deformed())
        log_warning("slices at rest cannot be cut, expected deformed ones (d)");
    else if (hand_.line.edges.size() > 1 && handlers.cut)
        handlers.cut(hand_.line);
    hand_.line.edges.clear();
    moment_.drawn.clear();
    renew();
}

bool ViewWindow::wheel(int steps, int x, int y) {
    SliceView* slice = slices_ ? slices_->of(interactor_->FindPokedRenderer(x, y)) : nullptr;
    if (!slice) return false;
    set_cross(slices_->cross() + steps * slice->spacing() * Vector3::Unit(slice->axis()));
    return true;
}

void ViewWindow::pull(const Vector3& base, const Vector3& to) {
    if (!hand_.pull || hand_.pull->base != base) hand_.pull = HandPull{++hand_.pulls, base, base};
    hand_.pull->to = to;
    if (handlers.pull) handlers.pull(hand_.pull);
}

void ViewWindow::release() {
    hand_.pull.reset();
    if (handlers.pull) handlers.pull(hand_.pull);
}

void ViewWindow::drag(MouseButton button, std::array<int, 2> from, std::array<int, 2> to) {
    static constexpr unsigned long down[] = {vtkCommand::LeftButtonPressEvent,
                                             vtkCommand::MiddleButtonPressEvent,
                                             vtkCommand::RightButtonPressEvent};
    static constexpr unsigned long up[] = {vtkCommand::LeftButtonReleaseEvent,
                                           vtkCommand::MiddleButtonReleaseEvent,
                                           vtkCommand::RightButtonReleaseEvent};
    constexpr int steps = 8;
    draw();  // positions are only known once drawn
    for (int k = 0; k <= steps; ++k) {
        interactor_->SetEventInformation(from[0] + (to[0] - from[0]) * k / steps,
                                         from[1] + (to[1] - from[1]) * k / steps);
        interactor_->InvokeEvent(k == 0 ? down[static_cast<int>(button)]
                                        : static_cast<unsigned long>(vtkCommand::MouseMoveEvent));
    }
    interactor_->InvokeEvent(up[static_cast<int>(button)]);
    changed_ = true;
}

void ViewWindow::press_key(const std::string& key) {
    if (key == "space" && handlers.toggle_play) handlers.toggle_play();
    if ((key == "Left" || key == "Right") && handlers.step) handlers.step(key == "Left" ? -1 : 1);
    if (key == "c") change_colour();
    if (key == "d") set_deformed(slices_ && !slices_->is_deformed());
    if (key == "v") set_volume(volume_ && !volume_->is_visible());
    if (key == "r") reset();
    if (key == "x") release();
    if (key == "k") take_knife();
    if (key == "q" || key == "Escape") closed_ = true;
    if (key == "s") {
        const auto file = free_name();
        write_png(file);
        log_info("written " + file.string());
    }
}

}  // namespace livetet
