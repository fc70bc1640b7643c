"""Solves: the numbers of the program, to the bit; interrupts; ranks."""

import os
import signal
import subprocess
import sys
import threading
import time
import unittest

import numpy as np

import livetet
from support import InFolder


class Solves(InFolder):
    def test_the_numbers_are_those_of_the_program_to_the_bit(self):
        for strain in ("linear", "corotated", "neohookean"):
            with self.subTest(strain=strain):
                path = self.scene_file(self.beam(strain=strain))
                outcome = self.run_program("solve", path)
                self.assertEqual(outcome.returncode, 0, outcome.stderr)
                of_program = livetet.Result(self.folder / "result.h5")
                solution = livetet.Scene.load(path).solve(output=self.folder / "python.h5")
                of_module = solution.result()
                np.testing.assert_array_equal(of_program.displacement(-1), solution.displacement)
                np.testing.assert_array_equal(of_program.displacement(-1),
                                              of_module.displacement(-1))
                self.assertEqual(of_program.fields, of_module.fields)
                for field in of_program.fields:
                    np.testing.assert_array_equal(of_program.field(field, 0),
                                                  of_module.field(field, 0))
                self.assertGreater(np.abs(solution.displacement).max(), 1e-3)

    def test_options_of_one_scene_do_not_reach_the_next(self):
        scene = self.beam(output={"file": "none"})
        before = livetet.Scene(scene, self.folder).solve()
        scene["solver"] = {"petsc_options": "-snes_max_it 1"}
        other = livetet.Scene(scene, self.folder).solve(must_converge=False)
        scene["solver"] = {}
        after = livetet.Scene(scene, self.folder).solve()
        self.assertLess(other.info["linearisations"], before.info["linearisations"])
        np.testing.assert_array_equal(before.displacement, after.displacement)

    def test_the_forces_on_the_clamp_carry_the_weight(self):
        solution = livetet.Scene(self.beam(), self.folder).solve(output="none")
        density, volume = 1060, 0.2 * 0.04 * 0.04  # kg/m^3, as by default; m^3
        (force,) = solution.forces.values()
        np.testing.assert_allclose(force, [0, 0, density * volume * 9.81], rtol=1e-4, atol=1e-4)
        self.assertIsNone(solution.file)
        with self.assertRaisesRegex(livetet.Error, "output.file"):
            solution.result()

    def test_one_that_does_not_converge_raises_with_what_was_reached(self):
        scene = self.beam(solver={"petsc_options": "-snes_max_it 1"}, strain="neohookean",
                          gravity_m_per_s2=[0, 0, -200])
        with self.assertRaises(livetet.NotConverged) as raised:
            livetet.Scene(scene, self.folder).solve(output="none")
        self.assertFalse(raised.exception.solution.converged)
        self.assertEqual(str(raised.exception), raised.exception.solution.failure)
        outcome = self.run_program("solve", self.scene_file(scene))
        self.assertEqual(outcome.returncode, 3)
        self.assertIn(str(raised.exception), outcome.stderr)

    def test_progress_is_shown_and_its_errors_end_the_solve(self):
        shown = []
        scene = livetet.Scene(self.beam(), self.folder)
        scene.solve(progress=lambda fraction, text: shown.append((fraction, text)))
        self.assertTrue(any("step" in text for _, text in shown), shown)
        (self.folder / "result.h5").unlink()

        def refuse(fraction, text):
            raise KeyError("enough")

        with self.assertRaises(KeyError):
            scene.solve(progress=refuse)
        self.assertEqual([p.name for p in self.folder.glob("*result*.h5")], [])
        again = scene.solve(output="none")  # the engine is whole
        self.assertTrue(again.converged)

    def test_a_call_from_within_a_call_is_refused(self):
        scene = livetet.Scene(self.beam(), self.folder)
        with self.assertRaisesRegex(livetet.Error, "from within a call"):
            scene.solve(output="none", progress=lambda *_: scene.solve(output="none"))

    def test_another_thread_goes_on_meanwhile(self):
        scene = livetet.Scene(self.large(cells=20, steps=1), self.folder)
        counts, done = [0], threading.Event()

        def count():
            while not done.is_set():
                counts[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        scene.solve()
        done.set()
        thread.join()
        self.assertGreater(counts[0], 10)

    def large(self, cells, steps):
        n = cells // 2
        box = livetet.box((0.2, 0.1, 0.1), [(cells, n, n), (n, n // 2, n // 2)])
        box.save(self.folder / "large.h5")
        return self.beam(mesh={"file": "large.h5"}, strain="neohookean", output={"file": "none"},
                         gravity_m_per_s2=[0, 0, -30], time={"load_steps": steps})

    def test_ctrl_c_ends_it_and_leaves_no_file(self):
        scene = self.large(cells=40, steps=20)
        scene["output"] = {"file": "result.h5"}
        path = self.scene_file(scene)
        program = (
            "import livetet, sys\n"
            "def say(fraction, text):\n    print('at', fraction, flush=True)\n"
            f"livetet.Scene.load({str(path)!r}).solve(progress=say)\n"
        )
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as process:
            process.stdout.readline()
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=120)
        self.assertIn("KeyboardInterrupt", errors)
        self.assertNotEqual(process.returncode, 0)
        self.assertEqual(list(self.folder.glob("*result*")), [])

    def test_dicts_and_texts_describe_the_same_scene(self):
        scene = livetet.Scene(self.beam(), self.folder)
        again = livetet.Scene(scene.to_dict())
        self.assertEqual(scene.text, again.text)
        self.assertEqual(scene.to_dict()["materials"][0]["young_Pa"], 20000)
        self.assertEqual(scene.check(), [])


class Bodies(InFolder):
    def test_a_body_follows_nodes_that_a_program_moves(self):
        scene = livetet.Scene(self.beam(gravity_m_per_s2=[0, 0, 0]), self.folder)
        body = livetet.Body(scene)
        points = body.mesh.points
        end = np.flatnonzero(points[:, 0] == points[:, 0].max())
        body.prescribe(end, np.tile([1e-4, 0, 0], (len(end), 1)), "x")
        self.assertTrue(body.solve().converged)
        strain, section = 1e-4 / 0.2, 0.04 * 0.04
        # Clamped at one end, so a little stiffer than a bar that is free to become thinner.
        pull = body.reactions()[end, 0].sum()
        self.assertGreater(pull / (20000 * strain * section), 1)
        self.assertLess(pull / (20000 * strain * section), 1.1)
        np.testing.assert_allclose(body.displacement[end, 0], 1e-4, rtol=1e-12)
        self.assertEqual(body.stress().shape, (len(points), 3, 3))
        self.assertAlmostEqual(body.strain_energy() / (pull * 1e-4 / 2), 1, 3)

    def test_its_arrays_outlive_it(self):
        body = livetet.Body(livetet.Scene(self.beam(), self.folder))
        body.solve()
        displacement, points = body.displacement, body.mesh.points
        kept = displacement.copy()
        body.close()
        del body
        np.testing.assert_array_equal(displacement, kept)
        self.assertEqual(points.shape, displacement.shape)

    def test_bad_nodes_are_refused_and_change_nothing(self):
        body = livetet.Body(livetet.Scene(self.beam(), self.folder))
        with self.assertRaisesRegex(livetet.Error, "nodes: found 9999999"):
            body.prescribe([9999999], [[0, 0, 0]])
        with self.assertRaisesRegex(livetet.Error, "expected one for each of 1"):
            body.move([0], [[0, 0, 0], [0, 0, 0]])
        body.close()
        with self.assertRaisesRegex(livetet.Error, "closed"):
            body.solve()


class Ranks(InFolder):
    def run_ranks(self, text):
        program = self.write("program.py", text)
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1",
                           OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
        return subprocess.run(
            [os.environ["MPIEXEC"], "--oversubscribe", "-n", "2", sys.executable, str(program)],
            capture_output=True, text=True, check=False, env=environment, timeout=300)

    def test_two_ranks_solve_one_scene(self):
        path = self.scene_file(self.beam())
        alone = livetet.Scene.load(path).solve(output="none")
        for first in ("from mpi4py import MPI\nimport livetet\n",
                      "import livetet\nlivetet.add_petsc_options('')\nfrom mpi4py import MPI\n"):
            try:
                import mpi4py  # noqa: F401
            except ImportError:
                self.skipTest("mpi4py is not installed")
            with self.subTest(first=first):
                outcome = self.run_ranks(
                    first + "import numpy as np\n"
                    f"s = livetet.Scene.load({str(path)!r}).solve(output='none')\n"
                    "rank = MPI.COMM_WORLD.rank\n"
                    f"np.save({str(self.folder)!r} + f'/u{{rank}}.npy', s.displacement)\n"
                    "print('ranks', s.info['ranks'])\n")
                self.assertEqual(outcome.returncode, 0, outcome.stderr)
                self.assertIn("ranks 2", outcome.stdout)
                u = [np.load(self.folder / f"u{rank}.npy") for rank in (0, 1)]
                np.testing.assert_array_equal(u[0], u[1])
                np.testing.assert_allclose(u[0], alone.displacement, atol=1e-7)


if __name__ == "__main__":
    unittest.main()
