"""Warping: the files of the program, to the byte; batches; bad input; DICOM in and out."""

import gzip
import os
import pathlib
import struct
import subprocess
import sys
import unittest

import numpy as np

import livetet
from support import ROOT, InFolder

SIZE = (30, 20, 20)
SPACING = 4.0  # mm


def write_labels(path, shift_mm=0.0):
    """A label map as NIfTI: 1 in voxels with their centres from (8, 8, 8) to (104, 64, 64) mm, in
    RAS. shift_mm: of all voxels along x."""
    labels = np.zeros(SIZE[::-1], np.uint8)
    labels[2:17, 2:17, 2:27] = 1
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *SIZE, 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 2, 8)  # uint8
    struct.pack_into("<8f", header, 76, 1, SPACING, SPACING, SPACING, 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352)  # where the voxels begin
    struct.pack_into("<2B", header, 122, 0, 2)  # mm
    struct.pack_into("<2h", header, 252, 0, 1)  # place by the matrix
    for row in range(3):
        values = [0.0, 0.0, 0.0, shift_mm if row == 0 else 0.0]
        values[row] = SPACING
        struct.pack_into("<4f", header, 280 + 16 * row, *values)
    header[344:348] = b"n+1\0"
    path.write_bytes(gzip.compress(bytes(header) + labels.tobytes()))


class Warps(InFolder):
    def setUp(self):
        super().setUp()
        write_labels(self.folder / "labels.nii.gz")
        mesh = livetet.load_mesh(self.folder / "labels.nii.gz", tets=600)
        mesh.save(self.folder / "beam.h5")
        self.scene = livetet.Scene(
            {
                "mesh": {"file": "beam.h5"},
                "materials": [{"young_Pa": 3000, "poisson": 0.4}],
                "gravity_m_per_s2": [0, 0, -9.81],
                "fix": [{"half_space_mm": [20, 0, 0, 1, 0, 0]}],
                "time": {"load_steps": 3},
                "output": {"file": "result.h5", "every": 1},
            },
            self.folder,
        )
        self.result = self.scene.solve().result()
        self.image = self.folder / "labels.nii.gz"

    def test_a_note_tells_of_a_layer_that_the_image_does_not_hold(self):
        def notes_with_face_at(x):
            cut = self.folder / "cut.nii.gz"
            write_labels(cut, x + SPACING / 2)
            outcome = self.run_program("warp", "result.h5", "--image", cut, "-o", "out.nii.gz")
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
            return "nodes of the mesh at rest lie outside of" in outcome.stdout

        least = 1e3 * self.result.mesh.points[:, 0].min()
        self.assertAlmostEqual(least, 6, delta=1)
        # A surface that bulges over the outermost voxels is no news.
        self.assertFalse(notes_with_face_at(least + 0.2 * SPACING))
        self.assertTrue(notes_with_face_at(least + 0.5 * SPACING))

    def test_the_files_are_those_of_the_program(self):
        outcome = self.run_program("warp", "result.h5", "--image", self.image, "-o", "a.nii.gz",
                                   "--inverse-field", "a_field.nii")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        figures = self.result.warp(self.folder / "b.nii.gz", image=self.image,
                                   inverse_field=self.folder / "b_field.nii")
        for name in (".nii.gz", "_field.nii"):
            self.assertEqual((self.folder / f"a{name}").read_bytes(),
                             (self.folder / f"b{name}").read_bytes())
        self.assertGreater(figures["carried"], 1000)
        self.assertGreater(figures["left_empty"], 10)
        self.assertEqual(figures["frame"], len(self.result) - 1)

    def test_several_frames_at_once_are_each_of_them(self):
        shown = []
        batch = self.result.warp(self.folder / "f{frame}.nii.gz", image=self.image,
                                 frame=range(len(self.result)), threads=2,
                                 progress=lambda fraction, text: shown.append(fraction))
        self.assertEqual([one["frame"] for one in batch], list(range(len(self.result))))
        self.assertEqual((shown[0], shown[-1]), (0, 1))
        for k in range(len(self.result)):
            self.result.warp(self.folder / "one.nii.gz", image=self.image, frame=k)
            self.assertEqual((self.folder / "one.nii.gz").read_bytes(),
                             (self.folder / f"f{k + 1}.nii.gz").read_bytes())

    def test_bad_input_is_an_error_and_leaves_no_file(self):
        output = self.folder / "out.nii.gz"
        for arguments, text in (
            ({}, "no file to write"),
            ({"output": "out.png"}, "out.png"),
            ({"output": output, "interpolation": "sinc"}, "sinc.*nearest, linear or cubic"),
            ({"output": output, "rind_mm": -1.0}, "rind_mm.*-1"),
            ({"output": output, "rind_mm": float("inf")}, "rind_mm.*inf"),
            ({"output": output, "rind_mm": 1e6}, "rind_mm.*1000000, expected 0 to 1000"),
            ({"output": output, "empty": float("nan")}, "empty.*nan"),
            ({"output": output, "image": ""}, "image.*empty text"),
            ({"output": output, "frame": [0, 0]}, "0 twice"),
            ({"output": output, "threads": 65}, "threads.*65"),
            ({"output": output, "frame": []}, "frame.*none"),
            ({"output": output, "image": self.folder / "no.nii.gz"}, "no.nii.gz"),
        ):
            with self.subTest(text=text), self.assertRaisesRegex(livetet.Error, text):
                self.result.warp(**{"image": self.image, **arguments})
        with self.assertRaises(IndexError):
            self.result.warp(output, image=self.image, frame=len(self.result))

        def refuse(fraction, text):
            raise KeyError("enough")

        with self.assertRaises(KeyError):
            self.result.warp(output, image=self.image, progress=refuse)
        self.assertFalse(output.exists())


class Dicom(InFolder):
    def test_the_example_takes_a_series_to_its_deformed_state(self):
        data = pathlib.Path(os.environ.get("LIVETET_DATA", "nowhere")) / "dicom"
        if not data.is_dir():
            self.skipTest("LIVETET_DATA names no folder with DICOM series")
        outcome = subprocess.run(
            [sys.executable, str(ROOT / "examples" / "python" / "dicom.py"),
             str(data / "ct-3slice"), str(data / "liver.dcm"), "out"],
            cwd=self.folder, capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(outcome.returncode, 0, outcome.stderr + outcome.stdout)
        import pydicom

        slices = {}
        for folder in (data / "ct-3slice", self.folder / "out" / "deformed"):
            for file in sorted(folder.iterdir()):
                slice_ = pydicom.dcmread(file)
                slices.setdefault(tuple(slice_.ImagePositionPatient), []).append(slice_)
        self.assertEqual([len(pair) for pair in slices.values()], [2, 2, 2])
        changed = 0
        for before, after in slices.values():
            self.assertEqual(before.PixelSpacing, after.PixelSpacing)
            self.assertNotEqual(before.SeriesInstanceUID, after.SeriesInstanceUID)
            self.assertEqual(before.StudyInstanceUID, after.StudyInstanceUID)
            changed += np.count_nonzero(before.pixel_array != after.pixel_array)
        self.assertGreater(changed, 1000)
        field = pydicom.dcmread(self.folder / "out" / "deformation.dcm")
        self.assertEqual(field.SOPClassUID.name, "Deformable Spatial Registration Storage")


if __name__ == "__main__":
    unittest.main()
