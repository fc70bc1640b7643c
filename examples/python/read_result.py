"""Reads a result: of `livetet solve`, of `livetet track`, or of Scene.solve.

Sample run:  python3 read_result.py result.h5
"""

import sys

import numpy as np

import livetet

result = livetet.Result(sys.argv[1])
mesh = result.mesh
print(f"{len(mesh.tets)} tets, {len(mesh.points)} nodes, {1e6 * mesh.volume:.1f} ml")
print(f"{len(result)} frames, version {result.info.get('version', 'unknown')}")

# 1. The largest displacement of each frame.
sizes = [np.linalg.norm(result.displacement(k), axis=1).max() for k in range(len(result))]
deepest = int(np.argmax(sizes))
print(f"largest displacement {1e3 * sizes[deepest]:.3f} mm at {result.times[deepest]:.4g}")

# 2. Volume of the deformed body: sixth part of the sum of the tets' determinants.
x = mesh.points + result.displacement(deepest)
a, b, c, d = (x[mesh.tets[:, i]] for i in range(4))
deformed = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)).sum() / 6
print(f"volume changes by {100 * (deformed / mesh.volume - 1):+.3f} %")

# 3. Fields that the scene asked for, and errors that `track` stated.
for name in result.fields:
    values = result.field(name, deepest)
    print(f"{name}: {values.shape}, from {values.min():.4g} to {values.max():.4g}")
for name, target in (result.targets(deepest) if result.target_names else {}).items():
    at, radius = 1e3 * target["position"], 1e3 * target["radius_95"]
    print(f"{name}: at {np.round(at, 1)} mm, within {radius:.2f} mm with 95 %")
sys.exit(0 if np.isfinite(deformed) and sizes[deepest] > 0 else 1)
