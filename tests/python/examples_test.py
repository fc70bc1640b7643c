"""The scripts of examples/python, as a user runs them."""

import os
import subprocess
import sys
import unittest

from support import ROOT, InFolder


class Examples(InFolder):
    def run_example(self, name, *arguments):
        return subprocess.run(
            [sys.executable, str(ROOT / "examples" / "python" / name), *arguments],
            cwd=self.folder, capture_output=True, text=True, check=False, timeout=300,
            env=dict(os.environ, MPLBACKEND="Agg"))

    def test_each_ends_well(self):
        for name, arguments in (("study.py", ["study"]), ("controller.py", []),
                                ("read_result.py", ["study/young_100000.h5"])):
            with self.subTest(name=name):
                outcome = self.run_example(name, *arguments)
                self.assertEqual(outcome.returncode, 0, outcome.stderr + outcome.stdout)
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("matplotlib is not installed: the plot was not made")
        self.assertGreater((self.folder / "study" / "study.png").stat().st_size, 5000)


if __name__ == "__main__":
    unittest.main()
