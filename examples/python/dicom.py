"""From a segmented DICOM series to the deformed series, as files of other programs.

Sample run:  python3 dicom.py ct/ "liver.dcm#Liver" out

Meshes the segmentation (DICOM-SEG, or any label map), lets the organ hang by its weight from its
anterior layer, and writes into the folder `out` the solved result, the CT series in the deformed
state, and the field from deformed to rest as a Deformable Spatial Registration object.
"""

import pathlib
import sys

import numpy as np

import livetet

series, segmentation, out = sys.argv[1:4]
out = pathlib.Path(out)
out.mkdir(exist_ok=True)

# 1. Mesh. Keys are those of a scene's mesh block.
mesh = livetet.load_mesh(segmentation, tets=3000)
mesh.save(out / "organ.h5")
low, high = 1e3 * mesh.points.min(axis=0), 1e3 * mesh.points.max(axis=0)
print(f"{len(mesh.tets)} tets, {1e6 * mesh.volume:.1f} ml, from {low.round()} to {high.round()} mm")

# 2. Solve: the patient lies on the back, so that weight acts towards posterior, -y in RAS.
held = high[1] - 0.15 * (high[1] - low[1])
scene = livetet.Scene(
    {
        "mesh": {"file": str(out / "organ.h5")},
        "materials": [{"young_Pa": 10000, "poisson": 0.45}],
        "gravity_m_per_s2": [0, -9.81, 0],
        "fix": [{"half_space_mm": [0, float(held), 0, 0, -1, 0]}],
        "output": {"file": str(out / "result.h5")},
    }
)
solution = scene.solve()
print(f"moves by at most {1e3 * np.linalg.norm(solution.displacement, axis=1).max():.2f} mm")

# 3. Warp the series. Each call writes its files whole or not at all.
figures = solution.result().warp(
    out / "deformed", image=series, registration=out / "deformation.dcm"
)
print(f"{figures['carried']} voxels moved with the organ, {figures['left_empty']} left empty")
sys.exit(0 if solution.converged and figures["carried"] > 0 else 1)
