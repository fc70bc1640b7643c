#pragma once

#include <memory>
#include <optional>
#include <string>

#include "apps/live/frame_publisher.hpp"
#include "apps/live/registration_input.hpp"
#include "apps/simulation/deforming_registration.hpp"
#include "geometry/nearest_triangle.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// Points of the surface on the way: fits them again and again while the tip is led over the organ,
/// each time from the fit before. Every fit is a frame of the result and is
/// published by OpenIGTLink as `livetet track` does: the organ, its targets' regions, the tip.
class LiveSweep {
  public:
    /// What a sweep goes to; each may be missing.
    struct Output {
        ResultWriter* result = nullptr;
        std::optional<PublishOptions> publish{};
    };
    /// All must outlive this. `frame`: the registration that the points are mapped by. Throws Error
    /// if the scene seeks the frame from the whole surface, or the port cannot be opened.
    LiveSweep(const RegisterArguments& arguments, const Scene& scene, SceneBody& body,
              DeformingRegistration& registration, const FiducialRegistration& frame,
              std::vector<MeasuredLandmark> landmarks, Output output);

    /// Fits all points so far, if there are new ones and enough.
    void take(const Recording& so_far);
    /// The points of a recording in the image that are near enough to the organ, and the landmarks;
    /// counts those left out.
    MeasuredOrgan measured(const Recording& recording);
    /// "184 points, 1.92 mm from the surface, error within 4.2 mm (Tumour)", or what is waited for.
    const std::string& text() const { return text_; }
    /// Of the first fit, with its set-up, s; none: there were too few points.
    std::optional<double> first_step_s() const { return first_step_s_; }

  private:
    void publish(const Recording& so_far, const DeformedOrgan& found);
    void describe(const MeasuredOrgan& measured, const DeformedOrgan& found);

    const RegisterArguments& arguments_;
    const Scene& scene_;
    SceneBody& body_;
    DeformingRegistration& registration_;
    const FiducialRegistration& frame_;
    std::vector<MeasuredLandmark> landmarks_;
    Output output_;
    int allowed_iterations_;   ///< of the next fit
    NearestTriangle surface_;  ///< at rest
    std::optional<FrameMessages> messages_;
    std::unique_ptr<OpenIgtLinkServer> server_;
    std::string text_ = "no point of the surface yet";
    std::size_t fitted_points_ = 0, left_out_ = 0, fits_ = 0;
    std::optional<double> first_step_s_;
};

}  // namespace livetet
