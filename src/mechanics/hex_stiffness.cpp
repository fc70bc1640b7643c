#include "mechanics/hex_stiffness.hpp"

namespace livetet {

Matrix24 hooke_stiffness(const TetElement& cell, Dilation dilation) {
    using Hex = ElementShape<8>;
    Matrix24 K = Matrix24::Zero();
    Eigen::Matrix<double, 24, 1> mean = Eigen::Matrix<double, 24, 1>::Zero();
    const double weight = cell.volume / Hex::points;
    for (int point = 0; point < Hex::points; ++point) {
        const Hex::Gradients g = Hex::gradients(cell, point);
        const Eigen::Map<const Eigen::Matrix<double, 24, 1>> n(g.data());
        mean += n / Hex::points;
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                K.block<3, 3>(3 * i, 3 * j) += shear_block(weight * cell.mu, g.col(i), g.col(j));
        if (dilation == Dilation::of_points) K += (weight * cell.lambda) * n * n.transpose();
    }
    if (dilation == Dilation::of_cell) K += (cell.volume * cell.lambda) * mean * mean.transpose();
    return K;
}

}  // namespace livetet
