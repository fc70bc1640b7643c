"""Without Slicer: a run of `livetet track` is started, followed and ended by the module's logic."""

import json
import math
import socket
import stat
import time
import unittest

import support
from LivetetTrackLib.session import (
    LivetetError,
    NewestFrame,
    Session,
    find_program,
    parse_frame,
    read_scene,
    scene_info,
)


class Scenes(support.InFolder):
    def test_what_slicer_loads_and_expects_is_read_from_the_scene(self):
        info = read_scene(support.PROGRAM, str(self.scene))
        self.assertEqual(info.image, str(self.folder / "grey.nii.gz"))
        self.assertFalse(info.image_has_labels)
        self.assertEqual(info.model, "")  # Slicer reads no .msh
        self.assertEqual(
            info.transforms, ("TrackerToRAS", "ReferenceToRAS", "SensorToRAS", "StylusToRAS")
        )
        self.assertEqual(info.organ, "Organ")
        self.assertTrue(info.has_targets)

    def test_a_label_map_and_a_surface_are_told_apart(self):
        track = {"reference_tool": "Reference", "tools": [{"tool": "Pen", "tip": "tip.json"}]}
        labels = scene_info({"mesh": {"file": "a.nrrd", "threshold": ""}, "track": track})
        self.assertEqual((labels.image, labels.model), ("a.nrrd", ""))
        self.assertTrue(labels.image_has_labels)
        self.assertEqual(labels.transforms[-1], "PenTipToRAS")
        grey = scene_info({"mesh": {"file": "a.mha", "threshold": "1:"}, "track": track})
        self.assertFalse(grey.image_has_labels)
        mesh = {"file": "a.stl", "space": "lps"}
        surface = scene_info({"mesh": mesh, "track": track})
        self.assertEqual((surface.image, surface.model, surface.model_is_lps), ("", "a.stl", True))
        self.assertEqual(scene_info({"mesh": {**mesh, "unit": "m"}, "track": track}).model, "")

    def test_mistakes_are_told_in_the_programs_words(self):
        self.scene.write_text("mesh: {file: block.msh}\nmatrials: []\n")
        with self.assertRaisesRegex(LivetetError, "matrials.*did you mean materials"):
            read_scene(support.PROGRAM, str(self.scene))
        self.scene.write_text("mesh: {file: block.msh}\n")
        with self.assertRaisesRegex(LivetetError, "track"):
            read_scene(support.PROGRAM, str(self.scene))

    def test_the_program_is_looked_for(self):
        self.assertEqual(find_program(support.PROGRAM), support.PROGRAM)
        with self.assertRaisesRegex(LivetetError, "scene.yaml"):
            find_program(str(self.scene))


class Runs(support.InFolder):
    def started(self, **arguments):
        session = Session(support.PROGRAM, str(self.scene), **arguments)
        self.addCleanup(session.close)
        return session

    def address_of(self, session, patience_s=60):
        """Of a run that publishes."""
        end = time.monotonic() + patience_s
        while session.address is None and session.is_running and time.monotonic() < end:
            time.sleep(0.02)
        self.assertIsNotNone(session.address, session.notes)
        return session.address

    def wait_for_end(self, session, patience_s=60):
        end = time.monotonic() + patience_s
        while session.is_running and time.monotonic() < end:
            time.sleep(0.02)

    def follow(self, client, is_done, patience_s=60):
        """Reads until a frame satisfies is_done; returns it, and the messages of its time stamp."""
        newest, messages = NewestFrame(), {}
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            message = client.receive()
            of_frame = messages.setdefault(message.stamp, {})
            of_frame[message.device] = message
            if message.device != "LivetetFrame":  # the last one of a frame
                continue
            newest.take(support.text_of(message))
            if is_done(newest.frame):
                return newest.frame, of_frame
            messages.clear()
        self.fail(f"no such frame came; the last one is {newest.frame}")

    def test_a_pressed_block_is_followed_and_its_run_ended(self):
        session = self.started()
        with support.Client(self.address_of(session)) as client:
            frame, messages = self.follow(
                client, lambda f: f.sensors and f.sensors[0].press_mm > 11 and f.computed == 1
            )
        self.assertEqual(frame.sensors[0].name, "Sensor")
        self.assertEqual(frame.sensors[0].status, "following")
        self.assertEqual(frame.troubles(), [])
        info = read_scene(support.PROGRAM, str(self.scene))
        self.assertLessEqual(set(info.transforms), set(messages))

        # The sensor, 12 mm below the top of the block; the organ goes with it.
        sensor = support.origin_of(messages["SensorToRAS"])
        for found, true in zip(sensor, (100, 50, 88)):
            self.assertAlmostEqual(found, true, delta=2)
        organ = support.surface_of(messages[info.organ])
        self.assertEqual(organ.scalar, "displacement_mm")
        for axis, size in enumerate(self.SIZE_MM):
            extent = max(p[axis] for p in organ.points) - min(p[axis] for p in organ.points)
            self.assertAlmostEqual(extent, size, delta=6)
        self.assertAlmostEqual(max(organ.values), 12, delta=2)

        # The region is the ellipsoid of the stated covariance, with 95 %: 7.815 is chi^2 of 3.
        (target,) = frame.targets
        self.assertEqual(target.name, "Tumour")
        self.assertLess(target.position_mm[2], 60)
        region = support.surface_of(messages["TargetRegion"])
        self.assertEqual(region.scalar, "radius_95_mm")
        self.assertAlmostEqual(region.values[0], target.radius_95_mm, places=3)
        for point in region.points:
            self.assertAlmostEqual(squared_distance(target, point), 7.815, delta=0.05)
        trace = sum(target.covariance_mm2[i] for i in (0, 3, 5))
        parts = sum(rms**2 for rms in target.rms_by_source_mm.values())
        self.assertAlmostEqual(trace, parts, delta=1e-3 * trace)
        self.assertIn("fiducials", frame.missing)  # the registration has no covariance
        self.assertTrue(frame.label(target).endswith(" mm*"))
        self.assertIn("without", frame.error_text())
        self.assertTrue(session.status_line)

        session.stop()
        session.close()
        self.assertEqual(session.exit_status, 0, session.error)
        self.assertIn("largest press", session.report)
        self.assertTrue((self.folder / "track.h5").is_file())

    def test_a_refused_run_says_why(self):
        (self.folder / "press.yaml").unlink()
        session = self.started()
        self.wait_for_end(session)
        self.assertEqual(session.exit_status, 2)
        self.assertIn("press.yaml", session.error)
        with self.assertRaisesRegex(LivetetError, "nowhere.yaml"):
            Session(support.PROGRAM, str(self.folder / "nowhere.yaml"))

    def test_a_taken_port_is_named(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            port = other.getsockname()[1]
            session = self.started(port=port)
            self.wait_for_end(session)
            self.assertIn(str(port), session.error)

    def test_a_program_that_does_not_end_is_killed(self):
        program = self.folder / "deaf"
        program.write_text("#!/bin/sh\ntrap '' INT\necho deaf >&2\nwhile :; do sleep 0.1; done\n")
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        session = Session(str(program), str(self.scene))
        while not session.notes:
            time.sleep(0.02)
        session.close(patience_s=0.5)
        self.assertFalse(session.is_running)
        self.assertEqual(session.error, "livetet was ended by signal 9")


def squared_distance(target, point):
    """d^T C^-1 d of a point, by Cramer's rule."""
    xx, xy, xz, yy, yz, zz = target.covariance_mm2
    d = [p - t for p, t in zip(point, target.position_mm)]
    cofactors = (
        (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy),
        (xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz),
        (xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy),
    )
    determinant = xx * cofactors[0][0] + xy * cofactors[0][1] + xz * cofactors[0][2]
    return sum(d[i] * cofactors[i][j] * d[j] for i in range(3) for j in range(3)) / determinant


class Frames(unittest.TestCase):
    TEXT = {
        "frame": 7,
        "sample_time_s": 1.5,
        "latency_ms": 3,
        "registration": "held",
        "reference": "stale",
        "sensors": {
            "A": {"status": "following", "reason": "", "press_mm": 1},
            "B": {"status": "holding", "reason": "lost", "press_mm": 2},
        },
        "statement": {
            "computed": 0.5,
            "missing": ["patches"],
            "targets": [
                {
                    "name": name,
                    "position_mm": [1, 2, 3],
                    "radius_95_mm": radius,
                    "covariance_mm2": [1, 0, 0, 1, 0, 1],
                    "rms_by_source_mm": {"sensors": 1, "patches": 0},
                }
                for name, radius in (("Vein", 2.84), ("Tumour", 3.06))
            ],
        },
    }

    def test_troubles_and_the_largest_radius_are_told(self):
        frame = parse_frame(json.dumps(self.TEXT))
        self.assertEqual(frame.troubles(), ["registration held (stale)", "B holding (lost)"])
        self.assertEqual(
            frame.error_text(), "error within 3.1 mm (Tumour), without patches (50 % computed)"
        )
        self.assertEqual(frame.label(frame.targets[0]), "Vein 2.8 mm*")
        self.assertEqual(frame.targets[0].main_source(), "sensors")
        whole = parse_frame(json.dumps({**self.TEXT, "statement": {}}))
        self.assertEqual((whole.targets, whole.error_text()), ((), ""))

    def test_what_is_no_frame_is_refused(self):
        text = json.dumps(self.TEXT)
        for broken in (
            "",
            "[]",
            text[:-9],
            text.replace("2.84", "NaN"),
            text.replace("2.84", "-1"),
            text.replace("[1, 2, 3]", "[1, 2]"),
            text.replace('"latency_ms"', '"other"'),
        ):
            with self.subTest(broken=broken[:40]), self.assertRaises(LivetetError):
                parse_frame(broken)

    def test_a_frame_becomes_stale_unless_another_one_comes(self):
        now = 100.0
        newest = NewestFrame(clock=lambda: now)
        self.assertTrue(newest.is_stale)
        self.assertEqual(newest.age_s, math.inf)
        self.assertTrue(newest.take(json.dumps(self.TEXT)))
        self.assertFalse(newest.is_stale)
        now = 103.0
        self.assertFalse(newest.take(json.dumps(self.TEXT)))  # the same text, read again
        self.assertTrue(newest.is_stale)
        self.assertTrue(newest.take(json.dumps({**self.TEXT, "frame": 8})))
        self.assertFalse(newest.is_stale)
