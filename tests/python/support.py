"""Scenes and runs of the program, for the tests of the Python module."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import livetet

PROGRAM = os.environ["LIVETET_PROGRAM"]
ROOT = pathlib.Path(os.environ["LIVETET_ROOT"])


class InFolder(unittest.TestCase):
    """A test with a temporary folder of its own."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def beam(self, **keys):
        """Writes beam.h5, and returns a scene: a beam of 200 mm, held at x = 0, under gravity."""
        livetet.box((0.2, 0.04, 0.04), [(16, 4, 4), (8, 2, 2)]).save(self.folder / "beam.h5")
        return {
            "mesh": {"file": "beam.h5"},
            "materials": [{"young_Pa": 20000, "poisson": 0.45}],
            "gravity_m_per_s2": [0, 0, -9.81],
            "fix": [{"half_space_mm": [0, 0, 0, 1, 0, 0]}],
            "output": {"file": "result.h5", "fields": ["stress", "von_mises", "reactions"]},
            **keys,
        }

    def tracked_block(self, targets=False):
        """Writes a block on a moving table with a sensor on its top; returns its scene."""
        livetet.box((0.2, 0.1, 0.1), [(12, 6, 6), (6, 3, 3), (4, 2, 2)]).save(
            self.folder / "block.h5"
        )
        reference = {"tool": "Reference", "at_mm": [20, 100, 50]}
        press = [{"at_s": 3}, {"at_s": 4, "by_mm": [0, 0, -12]}]
        sensor = {"tool": "Sensor", "at_mm": [100, 50, 100], "moves": press}
        table = {"at_mm": [300, 0, -100], "moves": [{"at_s": 5, "by_mm": [40, 0, 0]}]}
        script = {
            "rate_Hz": 15,
            "duration_s": 5,
            "position_noise_mm": 0.2,
            "organ": table,
            "tools": [reference, sensor],
        }
        self.write("press.yaml", json.dumps(script))
        corners = [[0, 0, 0], [200, 0, 0], [0, 100, 0], [0, 0, 100]]
        fiducials = [
            {
                "name": f"F{i}",
                "image_mm": at,
                "tracker_mm": at,
                "reference_mm": [at[0] - 20, at[1] - 100, at[2] - 50],
                "residual_mm": 0,
                "leave_one_out_mm": 0,
                "weight": 1,
            }
            for i, at in enumerate(corners)
        ]
        registration = {
            "format": "livetet registration 2",
            "reference_tool": "Reference",
            "image_from_reference_mm": [1, 0, 0, 20, 0, 1, 0, 100, 0, 0, 1, 50, 0, 0, 0, 1],
            "scale": 1,
            "fre_mm": 0,
            "fle_mm": 0,
            "fiducials": fiducials,
        }
        self.write("registration.json", json.dumps(registration))
        track = {
            "source": "press.yaml",
            "registration": "registration.json",
            "pace": "every-sample",
        }
        if targets:
            track["targets"] = [{"name": "Tumour", "point_mm": [100, 50, 60]}]
        return {
            "mesh": {"file": "block.h5"},
            "fix": [{"half_space_mm": [0, 0, 1, 0, 0, 1]}],
            "time": {"scheme": "newmark", "rayleigh_alpha": 10, "rayleigh_beta": 0.01},
            "solver": {"threads": 1},
            "track": track,
            "output": {"file": "track.h5"},
        }

    def write(self, name, text):
        """Writes a text file of the folder; returns its path."""
        path = self.folder / name
        path.write_text(text)
        return path

    def scene_file(self, scene, name="scene.yaml"):
        """Writes a scene, as JSON, which is YAML too; returns its path."""
        return self.write(name, json.dumps(scene))

    def run_program(self, *arguments):
        """Runs `livetet` in the folder; without a search path, so that it finds no X server and
        draws no pictures of a report."""
        return subprocess.run(
            [PROGRAM, *map(str, arguments)],
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
            env={
                **os.environ,
                "PATH": "",
                "DISPLAY": "",
                "OMPI_MCA_ess_singleton_isolated": "1",  # else it starts a daemon by PATH
            },
        )
