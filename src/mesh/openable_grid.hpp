#pragma once

#include <string>
#include <utility>

#include "mesh/hex_cut.hpp"
#include "mesh/link_cuts.hpp"
#include "mesh/openable_mesh.hpp"
#include "mesh/rest_places.hpp"

namespace livetet {

/// A grid of hexahedra; see crossed_links and open_links.
class OpenableGrid : public OpenableMesh {
  public:
    OpenableGrid(const TetMesh& grid, std::string where)
        : where_(std::move(where)),
          level_(hex_level_of(grid, where_)),
          frame_(grid_frame(grid, level_)),
          crossings_(level_, frame_),
          rest_places_(level_, frame_),
          cuts_(level_.links.size()) {}

    double cell_edge() const override { return frame_.axes.colwise().norm().minCoeff(); }
    bool holds(const Vector3& place) const override { return rest_places_.holds(place); }
    Vector3 rest_place(const Vector3& y, const TetMesh& mesh,
                       std::span<const Vector3> displacement) const override {
        return rest_places_.rest_place(y, mesh.hexahedra, displacement);
    }
    std::size_t cut(const TriangleMesh& surface) override {
        return crossings_.mark(surface, cuts_.cut, where_);
    }
    void rejoin_crumbs() override {
        cuts_.rejoin_small_pieces(level_.links, level_.places.size(), 2);
    }
    OpenedLevels open(const std::vector<TetMesh>& levels) override {
        rejoin_crumbs();
        OpenedGrid opened = open_links(levels.front(), level_, cuts_.cut);
        return {{std::move(opened.mesh)}, {{}, std::move(opened.originals)}};
    }
    void keep() override { cuts_.keep(); }
    void undo() override { cuts_.undo(); }
    std::size_t parted() const override { return cuts_.parted(); }

  private:
    std::string where_;
    HexLevel level_;  ///< as loaded
    GridFrame frame_;
    LinkCrossings crossings_;
    RestPlaces rest_places_;
    LinkCuts cuts_;
};

}  // namespace livetet
