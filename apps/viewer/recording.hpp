#pragma once

#include <Eigen/Geometry>

#include "apps/live/statement_record.hpp"
#include "apps/viewer/body.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// A result of `livetet track` or `livetet solve`, read as moments to show.
class ViewRecording {
  public:
    /// Throws Error if the file is no result or has no frame.
    ViewRecording(const std::filesystem::path& path, const ViewFiles& files);
    ViewRecording(const ViewRecording&) = delete;
    ViewRecording& operator=(const ViewRecording&) = delete;

    const ShownBody& body() const { return body_; }
    const std::vector<double>& times_s() const { return reader_.times_s(); }
    /// Reads frame k. Throws Error if it is damaged.
    ShownMoment moment(std::size_t k) const;
    bool has_stress() const { return has_stress_; }
    /// Whether errors over the surface are stated.
    bool states_errors() const { return !body_.stated_places.empty(); }
    /// What the body occupies at rest and in some frames, m.
    const Eigen::AlignedBox3d& extent() const { return extent_; }
    /// Ranges of the colours: the largest displacement, m, stress, Pa (ignoring the highest
    /// hundredth of the nodes), and stated error, m, of some frames. And the frame with the deepest
    /// press or, without tracking, the last.
    std::size_t representative_frame() const { return representative_frame_; }
    double largest_displacement() const { return largest_displacement_; }
    double largest_stress() const { return largest_stress_; }
    double largest_stated_error() const { return largest_stated_error_; }

  private:
    std::vector<double> nodal_stress(std::size_t k) const;
    void trace_tools(const std::string& source, const Scene& scene);
    void find_driven(const std::string& source, const Scene& scene);
    void find_ranges();

    ResultReader reader_;
    StatementReader statements_;  ///< refers to reader_
    ShownBody body_;
    Eigen::AlignedBox3d extent_;
    bool has_stress_ = false, has_press_ = false;
    std::vector<double> node_volume_;  ///< a quarter of the volume of its tets, m^3
    double largest_displacement_ = 0, largest_stress_ = 0, largest_stated_error_ = 0;
    std::size_t representative_frame_ = 0;
    /// Of a frame.
    struct Traced {
        std::vector<ShownTool> tools;
        std::vector<std::optional<Vector3>> bases, now;
        std::optional<HandPull> pull;
    };
    std::vector<Traced> traced_;
    std::vector<ShownSensor> sensors_;  ///< with patches
};

}  // namespace livetet
