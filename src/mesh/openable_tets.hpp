#pragma once

#include <array>
#include <string>

#include "mesh/link_cuts.hpp"
#include "mesh/openable_mesh.hpp"
#include "mesh/point_locator.hpp"
#include "mesh/tet_links.hpp"

namespace livetet {

/// Levels of tets of four nodes, all of which open alike.
///
/// A link between two tets is cut where the segment between their middles, as they were loaded,
/// crosses the surface. Faces of cut links open. A node that is doubled for the first time moves
/// onto the plane nearest to the crossings around it, as far as the angles allow (MovableNodes).
class OpenableTets : public OpenableMesh {
  public:
    OpenableTets(const std::vector<TetMesh>& levels, std::string where);

    double cell_edge() const override { return cell_edge_; }
    bool holds(const Vector3& place) const override;
    Vector3 rest_place(const Vector3& y, const TetMesh& mesh,
                       std::span<const Vector3> displacement) const override;
    std::size_t cut(const TriangleMesh& surface) override;
    void rejoin_crumbs() override;
    OpenedLevels open(const std::vector<TetMesh>& levels) override;
    void keep() override;
    void undo() override;
    std::size_t parted() const override { return levels_.front().cuts.parted(); }

  private:
    struct Level {
        std::array<Vector3, 2> box;    ///< of the nodes as loaded: its lower and upper corners
        std::vector<Vector3> middles;  ///< of the tets as loaded
        std::vector<TetLink> links;
        LinkCuts cuts;
        std::vector<Vector3> crossings;        ///< of links that are cut, m
        std::vector<std::uint8_t> was_parted;  ///< for each node now: it stays where it is
        std::vector<std::uint8_t> is_parted;   ///< the same, once what was opened is kept
    };
    static Level level_of(const TetMesh& mesh);
    OpenedNodes open_level(Level& level, TetMesh& mesh) const;

    std::string where_;
    std::vector<Level> levels_;
    TetMesh finest_;  ///< as loaded: nodes and tets
    PointLocator locator_;
    double cell_edge_ = 0;
};

}  // namespace livetet
