#pragma once

#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>

#include <Eigen/Geometry>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "apps/viewer/marks.hpp"
#include "apps/viewer/organ.hpp"
#include "apps/viewer/regions.hpp"
#include "apps/viewer/slices.hpp"
#include "apps/viewer/volume.hpp"

namespace livetet {

enum class MouseButton { left, middle, right };
enum class Surface { on_screen, off_screen };

/// Side of the patient from which the organ is viewed.
enum class Look { front, back, left, right, above, below };

/// The window: the organ on the left, three slices of the image on the right, a time line below. It
/// shows the moments it is given, and passes requests of the user to its handlers. Needs an X
/// server, even off screen. All calls must come from the thread that created it.
class ViewWindow {
  public:
    /// Called for requests of the user; each may be empty.
    struct Handlers {
        std::function<void()> toggle_play;
        std::function<void(int)> step;     ///< by this number of frames
        std::function<void(double)> seek;  ///< to this share of the time line
        std::function<void(const std::optional<HandPull>&)>
            pull;                                 ///< a marker is pulled, or released
        std::function<void(const HandCut&)> cut;  ///< a line was drawn
    };

    /// `body` must outlive it; see change_body.
    ViewWindow(const ShownBody& body, Surface surface, std::array<int, 2> size = {1280, 800});
    ~ViewWindow();
    Handlers handlers;

    /// The body's mesh and surface have changed: `first` is shown on them.
    void change_body(ShownMoment first);
    void show(ShownMoment moment);
    /// Redraws the texts of a moment with keeps_numbers.
    void renew_texts();
    const ShownMoment& shown() const { return moment_; }
    /// Position on the time line; none: hides the line.
    void set_time(std::optional<double> share);
    void set_range(ColourBy what, double largest);
    /// Extends the ranges of displacements, in steps of 5 mm, and of stated errors, in steps of
    /// 1 mm, to include this moment.
    void grow_range();
    /// A run that states errors has none before its first frame, and shows displacements until
    /// then. Throws Error if this moment has no stresses, or the body no places of stated errors.
    void set_colour(ColourBy what);
    /// Colours by the next quantity that this moment has.
    void change_colour();
    void set_deformed(bool deformed);
    void set_cross(const Vector3& cross);
    void set_window(double window, double level);
    void set_volume(bool visible);
    void look_from(Look look);
    /// Draws one slice for each new moment, in turns, which saves two thirds of the work.
    void set_slices_in_turns(bool in_turns) { turns_.are_taken = in_turns; }
    void zoom(double factor);
    /// What fills the view after a reset, m; at first the organ at rest. Resets.
    void set_extent(const Eigen::AlignedBox3d& extent);
    /// Makes the extent and what is shown of the organ fill the view.
    void reset();
    /// Sets a marker as the mouse would: `base`, and where it is pulled to.
    void pull(const Vector3& base, const Vector3& to);
    void release();
    /// Lets the user draw lines that cut so deep, m; none: says that nothing can be cut.
    void set_cut_depth(std::optional<double> depth) { hand_.cut_depth = depth; }

    /// The shown state as JSON: time, largest displacement, cross-hair (mm), window and level,
    /// marker, sensors, targets, stated error over the surface.
    std::string state() const;
    /// Draws if something has changed. Returns whether it did.
    bool draw();
    void write_png(const std::filesystem::path& path);
    vtkRenderWindow* window() { return window_; }

    /// Handles mouse and keys. False once the window is closed.
    bool process_events();
    /// Mouse and key actions, in pixels from the lower left; used by scripts, too.
    void drag(MouseButton button, std::array<int, 2> from, std::array<int, 2> to);
    void press_key(const std::string& key);

  private:
    class Style;
    static constexpr double line_left = 0.02,
                            line_right = 0.98;  ///< ends of the time line, as shares of the width
    void listen(Surface surface);
    /// False if the mouse is over the organ, whose camera VTK's style rotates.
    bool mouse_down(MouseButton button, bool shift, int x, int y);
    bool mouse_move(int x, int y);
    bool mouse_up();
    void take_knife();
    /// The edge of a blade that cuts at these pixels, and the point that is drawn there.
    struct KnifePlace {
        BladeEdge edge;
        Vector3 shown;
    };
    std::optional<KnifePlace> knife_at(int x, int y);
    void draw_line_to(int x, int y);
    void end_line();
    bool wheel(int steps, int x, int y);
    void add_strip();
    /// Arranges the parts if the window has a new size.
    void arrange();

    const ShownBody& body_;
    ShownMoment moment_;
    Eigen::AlignedBox3d extent_;  ///< see set_extent
    vtkSmartPointer<vtkRenderWindow> window_;
    vtkNew<vtkRenderer> organ_renderer_, strip_;
    std::array<vtkNew<vtkRenderer>, 3> slice_renderers_;
    vtkSmartPointer<vtkRenderWindowInteractor> interactor_;
    std::unique_ptr<OrganView> organ_;
    std::unique_ptr<MarksView> marks_;
    std::unique_ptr<RegionsView> regions_;
    std::unique_ptr<SliceViews> slices_;
    std::unique_ptr<VolumeView> volume_;
    vtkNew<vtkPolyData> time_line_;
    vtkNew<vtkTextActor> text_, help_;
    void renew() { stale_ = changed_ = true; }
    bool stale_ = true, changed_ = true;  ///< the moment has changed; what is shown of it has
    bool closed_ = false;
    struct {
        bool are_taken = false;
        int slice = 0;  ///< whose turn it was
    } turns_;
    std::array<int, 2> arranged_{0, 0};  ///< the window's size, pixels

    enum class Doing { nothing, crossing, windowing, pulling, cutting, seeking };
    /// A drag of the mouse.
    struct Drag {
        Doing doing = Doing::nothing;
        SliceView* slice = nullptr;  ///< in which the button went down
        std::array<int, 2> last{0, 0};
    };
    Drag drag_;
    /// The marker that is pulled, and the knife.
    struct Hand {
        std::optional<HandPull> pull;
        int pulls = 0;
        std::optional<double> cut_depth{};  ///< m
        bool has_knife = false;             ///< the left button draws a line
        HandCut line{};                     ///< as far as it is drawn
    };
    Hand hand_;
};

}  // namespace livetet
