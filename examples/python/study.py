"""A study with a plot: how far a beam bends under its weight, for several moduli.

The tip of a beam of length L and section h x h bends by
    w = q L^4 / (8 E I) + q L^2 / (2 kappa G A),  q = rho g h^2, I = h^4 / 12, kappa = 5/6
(Timoshenko), as long as that is small. Sample run:  python3 study.py FOLDER
"""

import pathlib
import sys

import numpy as np

import livetet

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "study")
folder.mkdir(parents=True, exist_ok=True)

# 1. A beam of 100 x 20 x 20 mm, held at x = 0.
length, height = 0.1, 0.02  # m
livetet.box((length, height, height), [(10, 2, 2)]).save(folder / "beam.h5")
base = {
    "mesh": {"file": "beam.h5"},
    "elements": "P2",
    "strain": "corotated",
    "gravity_m_per_s2": [0, 0, -9.81],
    "fix": [{"half_space_mm": [0, 0, 0, 1, 0, 0]}],
    "output": {"fields": ["von_mises"]},
}

# 2. A solve for each modulus; the results stay on the disk. Sag is that of the end face's centre.
moduli = np.array([1e5, 3e5, 1e6, 3e6])  # Pa
poisson, density = 0, 1000  # does not thicken, so that the clamp adds nothing to the formula
sags = []
for young in moduli:
    material = {"young_Pa": young, "poisson": poisson, "density_kg_per_m3": density}
    scene = livetet.Scene({**base, "materials": [material]}, folder)
    solution = scene.solve(output=folder / f"young_{young:.0f}.h5")
    tip = livetet.Sampler(solution.mesh, [[length, height / 2, height / 2]])
    sags.append(-tip(solution.displacement)[0, 2])

# 3. The formula.
area, inertia, q = height**2, height**4 / 12, density * 9.81 * height**2
shear = moduli / (2 * (1 + poisson))
formula = q * length**4 / (8 * moduli * inertia) + q * length**2 / (2 * 5 / 6 * shear * area)
for young, sag, expected in zip(moduli, sags, formula):
    print(f"E = {young:8.0f} Pa: sag {1e3 * sag:7.3f} mm, beam formula {1e3 * expected:7.3f} mm")

# 4. The plot.
try:
    import matplotlib.pyplot as plt
except ImportError:
    print("matplotlib is not installed: no plot")
else:
    plt.loglog(moduli, 1e3 * np.array(sags), "o", label="Livetet, large rotations")
    plt.loglog(moduli, 1e3 * formula, "-", label="Timoshenko, small ones")
    plt.xlabel("Young's modulus / Pa")
    plt.ylabel("sag of the tip / mm")
    plt.legend()
    plt.savefig(folder / "study.png", dpi=120)

# The stiffest beam bends little, so that the formula holds.
sys.exit(0 if abs(sags[-1] / formula[-1] - 1) < 0.02 else 1)
