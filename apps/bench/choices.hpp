#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// One way to compute a scene, as a scene of its own.
struct SceneChoice {
    std::string varied;  ///< what sets it apart from the scene itself: a line of the figure
    std::string name;    ///< in a few words: "level 1, P2, 1e-4"
    std::size_t level = 0;
    Scene scene;
};

/// The ways to compute a scene that a user may choose among, and what each is measured against.
class Choices {
  public:
    /// Writes the levels of `hierarchy` from each on as hierarchy files into `folder`.
    Choices(const Scene& scene, MeshHierarchy hierarchy, const std::filesystem::path& folder);

    /// The scene on each level with P1 and P2 (P2 not on the finest: that is the reference's), to
    /// three tolerances; with each strain model; each solver; and where it is dynamic each scheme
    /// with three steps.
    std::vector<SceneChoice> all() const;

    // What a choice's error is made of: each has one cause of error fewer than the one before.
    // `tight` solves its equations to 1e-9; `fine_in_time` takes a quarter of the scene's step,
    // too; `same_model` has the scene's strain model, too; the reference has ten-node tets on the
    // finest mesh, too.
    Scene tight(const SceneChoice& choice) const;
    Scene fine_in_time(const SceneChoice& choice) const;
    Scene same_model(const SceneChoice& choice) const;
    Scene reference() const;

    const MeshHierarchy& hierarchy() const { return hierarchy_; }

  private:
    SceneChoice on_level(std::size_t level) const;

    Scene scene_;
    MeshHierarchy hierarchy_;
    std::filesystem::path folder_;
};

}  // namespace livetet
