#pragma once

namespace livetet {

/// The faces of a positively oriented tet, wound outwards. Face k is opposite corner k.
inline constexpr int tet_faces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

}  // namespace livetet
