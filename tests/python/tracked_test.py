"""The tracked body, frame by frame, and its results."""

import unittest

import numpy as np

import livetet
from support import InFolder


class Tracked(InFolder):
    def body_and_recording(self, **keys):
        path = self.scene_file(self.tracked_block(**keys))
        recording = livetet.Recording.load(self.folder / "press.yaml")
        return livetet.TrackedBody(livetet.Scene.load(path), recording.tools), recording

    def test_its_frames_are_those_of_the_program_to_the_bit(self):
        body, recording = self.body_and_recording(targets=True)
        outcome = self.run_program("track", "scene.yaml", "--every-sample")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        result = livetet.Result(self.folder / "track.h5")
        self.assertEqual(len(result), len(recording))
        self.assertEqual(result.target_names, ["Tumour"])
        deepest = 0.0
        for k in range(len(recording)):
            frame = body.step(recording[k])
            self.assertEqual(frame.time, result.times[k])
            np.testing.assert_array_equal(frame.displacement.astype(np.float32),
                                          result.displacement(k).astype(np.float32))
            stated, kept = frame.targets["Tumour"], result.targets(k)["Tumour"]
            np.testing.assert_allclose(stated["position"], kept["position"], rtol=1e-12)
            np.testing.assert_allclose(stated["radius_95"], kept["radius_95"], rtol=1e-12)
            np.testing.assert_allclose(stated["covariance"], kept["covariance"], rtol=1e-9,
                                       atol=1e-18)
            deepest = max(deepest, frame.press)
        self.assertAlmostEqual(deepest, 0.012, delta=0.0015)  # the tracker has noise
        self.assertEqual(frame.registration, "valid")
        self.assertEqual(frame.sensors[0]["drive"], "following")

    def test_poses_of_a_program_give_the_same(self):
        body, recording = self.body_and_recording()
        other = livetet.TrackedBody(livetet.Scene.load(self.folder / "scene.yaml"))
        for k in range(len(recording)):
            sample = recording[k]
            ours = other.step(sample.poses, sample.time).displacement
            np.testing.assert_allclose(ours, body.step(sample).displacement, atol=2e-7)

    def test_a_tool_that_is_not_seen_is_held_then_released(self):
        body, recording = self.body_and_recording()
        for k in range(len(recording)):
            body.step(recording[k])
        last = recording[-1]
        poses = dict(last.poses, Sensor=None)
        for k in range(60):
            frame = body.step(poses, last.time + (k + 1) / 15)
        self.assertEqual(frame.sensors[0]["trouble"], "lost")
        self.assertLess(np.abs(frame.displacement).max(), 1e-3)
        broken = np.full((4, 4), np.nan)
        frame = body.step({"Reference": broken}, last.time + 10)
        self.assertNotEqual(frame.registration, "valid")

    def test_the_displacement_is_one_buffer_that_outlives_the_body(self):
        body, recording = self.body_and_recording()
        first = body.step(recording[0]).displacement
        second = body.step(recording[1]).displacement
        self.assertEqual(first.ctypes.data, second.ctypes.data)
        self.assertFalse(first.flags.writeable)
        kept, points = second.copy(), body.mesh.points
        body.close()
        with self.assertRaisesRegex(livetet.Error, "closed"):
            body.step(recording[2])
        del body
        np.testing.assert_array_equal(second, kept)
        self.assertEqual(points.shape, kept.shape)

    def test_wrong_tools_and_scenes_are_refused(self):
        body, recording = self.body_and_recording()
        with self.assertRaisesRegex(livetet.Error, "no tool Stylus, expected some of Reference"):
            body.step({"Stylus": np.eye(4)}, 0.0)
        with self.assertRaisesRegex(livetet.Error, r"poses\[Sensor\]: expected"):
            body.step({"Sensor": np.eye(3)}, 0.0)
        with self.assertRaisesRegex(livetet.Error, "time: found nan"):
            body.step({"Sensor": np.eye(4)}, float("nan"))
        with self.assertRaisesRegex(livetet.Error, "track is missing"):
            livetet.TrackedBody(livetet.Scene(self.beam(), self.folder))
        with self.assertRaises(livetet.Error):
            livetet.TrackedBody(livetet.Scene.load(self.folder / "scene.yaml"), ["Other"])
        with self.assertRaises(IndexError):
            recording[len(recording)]


if __name__ == "__main__":
    unittest.main()
