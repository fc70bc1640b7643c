#pragma once

#include <algorithm>

namespace livetet {

/// The modulus in place of lambda, Pa, by which grids in the mixed form damp the change of volume:
/// at most ten times mu, as at a Poisson's ratio of 0.45. Damping is by the dilation of the shape
/// at the step's start. By the whole of lambda it would resist what turns and bends from there
/// (near 1/2 a bar bent by its weight moved 5 % too little in two steps); by none, Newmark's scheme
/// leaves swings of the volume that a flattened start begins.
inline double damped_lambda(double lambda, double mu) { return std::min(lambda, 10 * mu); }

}  // namespace livetet
