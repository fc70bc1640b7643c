"""A controller of one's own around the live body: it presses until a force is reached.

A patch on a soft block is moved down frame by frame. The controller reads the force that the patch
takes and chooses the next displacement, so that the force goes to its set point (an integral
controller). Sample run:  python3 controller.py
"""

import sys

import numpy as np

import livetet

# 1. A block of 80 x 80 x 60 mm in two meshes, held at its bottom; a patch in the middle of its top.
livetet.box((0.08, 0.08, 0.06), [(12, 12, 9), (4, 4, 3)]).save("block.h5")
scene = livetet.Scene(
    {
        "mesh": {"file": "block.h5"},
        "materials": [{"young_Pa": 3000, "poisson": 0.45}],
        "fix": [{"half_space_mm": [0, 0, 0, 0, 0, 1]}],
    }
)
body = livetet.Body(scene, live=True)
points = body.mesh.points
top = points[:, 2] > 0.06 - 1e-9
patch = np.flatnonzero(top & (np.hypot(points[:, 0] - 0.04, points[:, 1] - 0.04) < 0.0101))


def moved_by(depth):
    """Displacements of the patch that is pressed so deep, m."""
    return np.tile([0.0, 0.0, -depth], (len(patch), 1))


# 2. The first frame that moves sets up what the others use.
body.prescribe(patch, moved_by(1e-6))
body.advance()

# 3. Frame by frame: force, next depth, one frame that aims at 20 ms.
wanted, stiffness = 0.5, 100.0  # N; N/m, a guess of the block's
depth, force = 0.0, 0.0
for frame in range(100):
    depth += 0.3 * (wanted - force) / stiffness
    body.move(patch, moved_by(depth))
    report = body.advance(budget_ms=20)
    if report.kept_old:
        sys.exit(f"frame {frame}: {report.reason}")
    force = -body.reactions()[patch, 2].sum()
print(f"{body.solver}: {force:.4f} N of {wanted} N at {1e3 * depth:.2f} mm")

# 4. The equilibrium at that depth has the same force.
body.solve()
exact = -body.reactions()[patch, 2].sum()
print(f"at equilibrium {exact:.4f} N")
sys.exit(0 if abs(force - wanted) < 0.005 and abs(exact - wanted) < 0.02 else 1)
