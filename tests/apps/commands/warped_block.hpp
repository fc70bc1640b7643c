#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <functional>

#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/result_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet::test {

/// A block of 60 x 50 x 40 mm in the middle of an image of 3 x 2.5 x 2 mm, and results of its own:
/// as if `livetet mesh` had meshed it and `livetet track` or `solve` had moved it.
struct WarpedBlock {
    Folder folder;
    TetMesh mesh = block({6, 5, 4}, {0.06, 0.05, 0.04});
    ImageGrid grid{{40, 40, 40}, Eigen::Matrix4d::Identity()};

    /// The image's axes lie obliquely in space where asked.
    explicit WarpedBlock(bool oblique = false) {
        Eigen::Matrix3d axes = Vector3(3e-3, 2.5e-3, 2e-3).asDiagonal();
        if (oblique)
            axes = Eigen::AngleAxisd(0.5, Vector3(2, -1, 1).normalized()).toRotationMatrix() * axes;
        grid.ras_from_voxel.topLeftCorner<3, 3>() = axes;
        grid.ras_from_voxel.topRightCorner<3, 1>() =
            Vector3(0.03, 0.025, 0.02) - axes * Vector3::Constant(19.5);
    }

    Vector3 place(int i, int j, int k) const {
        return (grid.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
    }

    template <class T>
    Image<T> image(const std::function<T(const Vector3&)>& value) const {
        Image<T> image{grid.size, grid.ras_from_voxel, {}};
        for (int k = 0; k < grid.size[2]; ++k)
            for (int j = 0; j < grid.size[1]; ++j)
                for (int i = 0; i < grid.size[0]; ++i)
                    image.values.push_back(value(place(i, j, k)));
        return image;
    }

    /// "labels.nii.gz", 1 in the block, and "block.h5" that says that it was meshed from it.
    void write_meshed() const {
        write_image(folder / "labels.nii.gz", image<std::int32_t>([](const Vector3& x) {
                        return (x.array() > 0).all() &&
                                       (x.array() < Eigen::Array3d(0.06, 0.05, 0.04)).all()
                                   ? 1
                                   : 0;
                    }));
        write_hierarchy(
            folder / "block.h5",
            make_hierarchy({mesh},
                           R"({"asked": {"mesh": "file: labels.nii.gz\nthreshold: \"\"\n"}})"),
            grid);
    }

    using Move = std::function<Vector3(const Vector3&)>;

    std::vector<Vector3> displaced(const Move& move) const {
        std::vector<Vector3> u;
        for (const Vector3& x : mesh.nodes) u.push_back(move(x) - x);
        return u;
    }

    /// A frame for each of `moves`, a second apart from 10 s on.
    void write_result(const std::string& name, const std::vector<Move>& moves,
                      const std::string& mesh_file = "block.h5") const {
        ResultWriter writer(folder / name, mesh, "mesh: {file: " + mesh_file + "}\n");
        for (std::size_t k = 0; k < moves.size(); ++k)
            writer.append(10.0 + static_cast<double>(k), displaced(moves[k]));
        writer.close();
    }
};

}  // namespace livetet::test
