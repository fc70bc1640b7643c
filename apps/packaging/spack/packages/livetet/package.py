# SPDX-License-Identifier: GPL-3.0-or-later
from spack.package import *


class Livetet(CMakePackage):
    """Real-time soft-tissue simulation for image-guided surgery: tracked, corotated and
    hyperelastic finite elements on tetrahedral mesh hierarchies, solved by multigrid; studies
    under MPI. Built without images (VTK, ITK, GDCM, CGAL), for machines that solve: Spack has no
    GDCM."""

    license("GPL-3.0-or-later")

    # From a source tree: spack dev-build -d . livetet@0.2.0
    version("0.2.0")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("gzip", type="build")

    depends_on("mpi")
    # The project is tested with 3.18. PTScotch partitions, MUMPS factorises.
    depends_on("petsc@3.18:+mpi+hypre+mumps+ptscotch+double~complex~int64")
    depends_on("metis@5:~int64")
    depends_on("hdf5+mpi")
    depends_on("eigen@3.4:3")
    depends_on("gmsh@4.8:+shared")
    depends_on("asio@1.22:")
    depends_on("cli11@2.1:")
    depends_on("fmt@9:")
    depends_on("spdlog@1.10: +fmt_external")
    depends_on("yaml-cpp@0.7:")
    depends_on("nlohmann-json@3.11:")
    depends_on("zlib-api")

    # C++20 as the sources use it; kernels are vectors of GCC's extension with its shuffles.
    requires("%gcc@12:", msg="is built and tested with GCC 12 or newer")

    generator("ninja")

    def cmake_args(self):
        return [
            # Spack's compiler wrapper chooses the instruction set of the target.
            self.define("LIVETET_NATIVE", False),
            self.define("LIVETET_IMAGES", False),
            self.define("LIVETET_BENCHMARKS", False),
            self.define("BUILD_TESTING", False),
        ]
