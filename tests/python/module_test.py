"""The module: its stubs and docstrings, its errors, its arrays."""

import ast
import inspect
import os
import pathlib
import unittest

import numpy as np

import livetet
from support import InFolder


def stub_names():
    """Public names of the stubs: of the module, and of each class."""
    text = (pathlib.Path(livetet.__file__).parent / "livetet.pyi").read_text()
    names = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef):
            members = {m.name for m in node.body if isinstance(m, ast.FunctionDef)}
            members |= {m.target.id for m in node.body if isinstance(m, ast.AnnAssign)}
            names[node.name] = {m for m in members if not m.startswith("__")}
        elif isinstance(node, ast.FunctionDef):
            names[node.name] = {a.arg for a in node.args.args}
    return names


def is_error(thing):
    return inspect.isclass(thing) and issubclass(thing, Exception)


class Stubs(unittest.TestCase):
    def test_they_name_what_the_module_has(self):
        public = {name for name in dir(livetet) if not name.startswith("_")}
        stubs = stub_names()
        self.assertEqual(public, set(stubs))
        for name in public:
            thing = getattr(livetet, name)
            if inspect.isclass(thing) and not is_error(thing):
                members = {m for m in vars(thing) if not m.startswith("_")}
                self.assertEqual(members, stubs[name], name)

    def test_functions_have_the_arguments_that_they_name(self):
        for name, arguments in stub_names().items():
            if callable(getattr(livetet, name)) and not inspect.isclass(getattr(livetet, name)):
                signature = getattr(livetet, name).__doc__.splitlines()[0]
                for argument in arguments:
                    self.assertIn(f"{argument}: ", signature)

    def test_all_that_is_public_says_what_it_is(self):
        for name in dir(livetet):
            thing = getattr(livetet, name)
            if name.startswith("_"):
                continue
            self.assertTrue(inspect.getdoc(thing), name)
            if not inspect.isclass(thing) or is_error(thing):
                continue
            for member, value in vars(thing).items():
                if not member.startswith("_"):
                    self.assertTrue(inspect.getdoc(value), f"{name}.{member}")


class Errors(InFolder):
    def text_of_program(self, scene):
        outcome = self.run_program("solve", self.scene_file(scene))
        self.assertEqual(outcome.returncode, 2, outcome.stderr)
        return outcome.stderr.splitlines()[-1]

    def text_of_module(self):
        with self.assertRaises(livetet.Error) as raised:
            livetet.Scene.load(self.folder / "scene.yaml").solve()
        return str(raised.exception)

    def test_they_have_the_texts_of_the_program(self):
        bad = [
            {"materials": [{"young_Pa": -3}]},
            {"mesh": {"file": "nowhere.h5"}},
            {"fix": []},
            {"fix": [{"half_space_mm": [900, 0, 0, -1, 0, 0]}]},
            {"nonsense": 1},
            {"solver": {"petsc_options": "-ksp_rtol 1e-3 loose"}},
        ]
        for keys in bad:
            with self.subTest(keys=keys):
                text = self.text_of_program(self.beam(**keys))
                self.assertEqual("livetet: " + self.text_of_module(), text)
                self.assertFalse((self.folder / "result.h5").exists())

    def test_they_are_value_errors(self):
        self.assertTrue(issubclass(livetet.Error, ValueError))

    def test_arrays_of_other_shapes_are_refused(self):
        with self.assertRaisesRegex(livetet.Error, r"points: found .* expected shape \(n, 3\)"):
            livetet.Mesh(np.zeros((4, 2)), [[0, 1, 2, 3]])
        with self.assertRaisesRegex(livetet.Error, "expected 0 to 3"):
            livetet.Mesh(np.eye(4, 3), [[0, 1, 2, 3]], node_sets={"fixed": [4]})

    def test_node_numbers_are_whole_and_of_32_bits(self):
        body = livetet.Body(livetet.Scene(self.beam(), self.folder))
        push = np.full((1, 3), 1e-4)
        for bad in ([1.5], [True], [2**32 + 1], np.array([2**64 - 1], np.uint64)):
            with self.subTest(bad=bad), self.assertRaises(livetet.Error):
                body.prescribe(bad, push)
        for good in ([40], np.array([40], np.uint8), np.array([40, 1, 41, 1], np.int32)[::2]):
            with self.subTest(good=good):
                body.prescribe(good, np.tile(push, (len(good), 1)))
        with self.assertRaisesRegex(livetet.Error, "components.*none"):
            body.prescribe([40], push, components="")
        body.prescribe([], np.empty((0, 3)))
        body.solve()
        np.testing.assert_allclose(body.displacement[[40, 41]], np.tile(push, (2, 1)))

    def test_a_budget_is_a_time(self):
        body = livetet.Body(livetet.Scene(self.beam(), self.folder))
        for bad in (-1, float("nan"), float("inf")):
            with self.subTest(bad=bad), self.assertRaisesRegex(livetet.Error, "budget_ms: found"):
                body.advance(budget_ms=bad)
        self.assertTrue(body.advance(budget_ms=1000).converged)

    def test_boxes_that_fit_no_memory_are_refused(self):
        with self.assertRaisesRegex(livetet.Error, "6e.15 tets, expected at most"):
            livetet.box((1, 1, 1), [(100000, 100000, 100000)])

    def test_words_that_are_no_options_are_refused(self):
        with self.assertRaisesRegex(livetet.Error, 'found "nonsense", expected -name'):
            livetet.add_petsc_options("nonsense")


class Keys(InFolder):
    def test_numbers_of_numpy_and_paths_are_taken(self):
        scene = self.beam(
            mesh={"file": pathlib.Path("beam.h5")},
            materials=[{"young_Pa": np.float32(2500), "region": np.int64(0)}],
            gravity_m_per_s2=np.array([0, 0, -1.5]),
        )
        keys = livetet.Scene(scene, self.folder).to_dict()
        self.assertEqual(keys["gravity_m_per_s2"], [0, 0, -1.5])
        self.assertEqual(keys["materials"][0]["young_Pa"], 2500)
        self.assertEqual(pathlib.Path(keys["mesh"]["file"]).name, "beam.h5")

    def test_other_objects_are_refused(self):
        ring = {}
        ring["mesh"] = ring
        for bad in (ring, {"mesh": {"file": object()}}, {(1, 2): 3}):
            with self.assertRaisesRegex(livetet.Error, "^table of keys: "):
                livetet.Scene(bad)


class Arrays(InFolder):
    def test_those_of_a_mesh_are_views_that_keep_it(self):
        mesh = livetet.box((1, 1, 1), [(2, 2, 2)])
        points, again = mesh.points, mesh.points
        self.assertEqual(points.ctypes.data, again.ctypes.data)
        self.assertFalse(points.flags.writeable)
        del mesh
        self.assertEqual(points.shape, (27, 3))
        self.assertEqual(points.max(), 1)
        self.assertIsInstance(points.base, livetet.Mesh)

    def test_a_mesh_goes_to_a_file_and_back(self):
        mesh = livetet.box((0.1, 0.1, 0.1), [(4, 4, 4), (2, 2, 2)])
        fixed = np.flatnonzero(mesh.points[:, 0] == 0)
        mesh = livetet.Mesh(mesh.points, mesh.tets, node_sets={"fixed": fixed},
                            coarser=mesh.levels[1:])
        with self.assertRaisesRegex(livetet.Error, "'.txt', expected .h5"):
            mesh.save(self.folder / "box.txt")
        mesh.save(self.folder / "box.h5")
        again = livetet.load_mesh(self.folder / "box.h5")
        np.testing.assert_array_equal(again.points, mesh.points)
        np.testing.assert_array_equal(again.tets, mesh.tets)
        np.testing.assert_array_equal(again.node_sets["fixed"], fixed)
        self.assertEqual([len(level.tets) for level in again.levels], [384, 48])
        self.assertAlmostEqual(again.volume, 1e-3, 12)

    def test_keys_of_a_mesh_block_are_taken_and_checked(self):
        livetet.box((0.1, 0.1, 0.1), [(4, 4, 4)]).save(self.folder / "box.h5")
        refined = livetet.load_mesh(self.folder / "box.h5", refine=1)
        self.assertEqual(len(refined.tets), 8 * 384)
        with self.assertRaisesRegex(livetet.Error, "tets"):
            livetet.load_mesh(self.folder / "box.h5", tets=-1)

    def test_a_linear_field_is_sampled_exactly(self):
        mesh = livetet.box((1, 1, 1), [(3, 3, 3)])
        gradient = np.array([[1, 2, 3], [0, 1, 0], [4, 0, -1.0]])
        at = np.array([[0.2, 0.3, 0.4], [0.9, 0.1, 0.5]])
        sampler = livetet.Sampler(mesh, at)
        np.testing.assert_allclose(sampler(mesh.points @ gradient), at @ gradient, atol=1e-12)
        np.testing.assert_array_equal(sampler.distance, 0)


class Registrations(unittest.TestCase):
    def test_a_known_motion_is_found(self):
        image = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.08, 0], [0, 0, 0.05], [0.1, 0.1, 0.1]])
        angle = 0.3
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0],
                         [0, 0, 1]])
        touched = (image - [0.3, 0.1, -0.2]) @ turn  # image = R touched + t
        found = livetet.register(touched, image)
        np.testing.assert_allclose(found.image_from_tracker[:3, :3], turn, atol=1e-12)
        np.testing.assert_allclose(found.image_from_tracker[:3, 3], [0.3, 0.1, -0.2], atol=1e-12)
        self.assertLess(found.fre, 1e-12)
        self.assertEqual(found.residuals.shape, (5, 3))

    def test_the_stated_error_is_the_expected_one(self):
        rng = np.random.default_rng(1)
        image = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.08, 0], [0, 0, 0.05], [0.1, 0.1, 0.1]])
        found = livetet.register(image + rng.normal(0, 1e-3, image.shape), image)
        target = [0.05, 0.05, 0.2]
        # Both are first-order formulas of the same error: RMS is the root of the trace.
        trace = np.trace(found.covariance_at(target))
        self.assertAlmostEqual(np.sqrt(trace) / found.expected_tre(target), 1, 1)
        np.testing.assert_allclose(found.covariance, found.covariance.T)

    def test_points_that_determine_nothing_are_refused(self):
        line = np.outer(np.arange(4), [0.1, 0, 0])
        with self.assertRaises(livetet.Error):
            livetet.register(line, line)
        corners = np.eye(4, 3) * [0.1, 0.07, 0.05]
        with self.assertRaisesRegex(livetet.Error, "in the order"):
            livetet.register(corners[[1, 0, 2, 3]], corners)


if __name__ == "__main__":
    unittest.main()
