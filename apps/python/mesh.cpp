#include "apps/python/mesh.hpp"

#include <pybind11/stl.h>

#include "apps/python/arrays.hpp"
#include "apps/python/engine.hpp"
#include "apps/scene/body_factory.hpp"
#include "config/yaml.hpp"
#include "io/fiducial_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/text.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/shapes.hpp"
#include "meshing/options.hpp"

namespace livetet::python {

namespace {

Mesh mesh_of_arrays(const DoubleArray& points, const IntArray& tets,
                    const std::optional<IntArray>& regions,
                    const std::map<std::string, IntArray>& node_sets,
                    const std::vector<Mesh>& coarser) {
    if (tets.ndim() != 2 || tets.shape(1) != 4)
        fail("tets: found an array of {} dimensions, expected shape (m, 4)", tets.ndim());
    TetMesh mesh;
    const auto nodes = rows3(points, "points");
    mesh.nodes.assign(nodes.begin(), nodes.end());
    const auto* all = reinterpret_cast<const Tet*>(tets.data());
    mesh.tets.assign(all, all + tets.shape(0));
    if (regions) {
        const auto labels = numbers(*regions, "regions");
        if (labels.size() != mesh.tets.size())
            fail("regions: found {} labels, expected one for each of {} tets", labels.size(),
                 mesh.tets.size());
        mesh.regions.assign(labels.begin(), labels.end());
    }
    for (const auto& [name, set] : node_sets) {
        const auto members = numbers(set, "node_sets");
        auto& sorted = mesh.node_sets[name];
        sorted.assign(members.begin(), members.end());
        std::sort(sorted.begin(), sorted.end());
        if (!sorted.empty() && (sorted.front() < 0 || sorted.back() >= std::ssize(mesh.nodes)))
            fail("node_sets: {} has node {}, expected 0 to {}", name,
                 sorted.front() < 0 ? sorted.front() : sorted.back(), mesh.nodes.size() - 1);
    }
    std::vector<TetMesh> levels{std::move(mesh)};
    for (const Mesh& level : coarser) levels.push_back(*level.mesh);
    const py::gil_scoped_release release;
    return Mesh(std::make_shared<const MeshHierarchy>(
        make_hierarchy(std::move(levels), "arrays of a Python program")));
}

Mesh box(const std::array<double, 3>& size, const std::vector<std::array<int, 3>>& cells) {
    if (cells.empty()) fail("cells: found none, expected (nx, ny, nz) of each level");
    constexpr double tets_a_cell = 6;
    std::vector<TetMesh> levels;
    for (const auto& n : cells) {
        if (std::min({n[0], n[1], n[2]}) < 1)
            fail("cells: found ({}, {}, {}), expected 1 or more along each axis", n[0], n[1], n[2]);
        if (const double tets = tets_a_cell * n[0] * n[1] * n[2]; tets > max_tets)
            fail("cells: found ({}, {}, {}), {:.3g} tets, expected at most {}", n[0], n[1], n[2],
                 tets, max_tets);
        levels.push_back(shapes::box({size[0], size[1], size[2]}, n));
    }
    return Mesh(std::make_shared<const MeshHierarchy>(make_hierarchy(std::move(levels), "a box")));
}

Mesh load(const py::object& path, const py::object& progress, const py::dict& keys) {
    keys["file"] = path_of(path);
    auto source = read_yaml<MeshSource>(yaml_text_of(keys), "load_mesh");
    if (source.grading == MeshGrading::scene)
        fail("load_mesh: grading = scene needs a scene, expected Scene.mesh()");
    Watch watch(progress);
    return in_engine([&] {
        return Mesh(std::make_shared<const MeshHierarchy>(load_mesh(source, watch.callback(), {})));
    });
}

void save(const Mesh& mesh, const py::object& path) {
    const std::string name = path_of(path);
    if (ending(name) != ".h5")
        fail("path = {}: the name ends in '{}', expected .h5", name, ending(name));
    in_engine([&] {
        write_hierarchy(name,
                        mesh.hierarchy ? *mesh.hierarchy : make_hierarchy({*mesh.mesh}, "a mesh"));
    });
}

py::dict node_sets(const py::object& self) {
    py::dict sets;
    for (const auto& [name, nodes] : self.cast<const Mesh&>().mesh->node_sets)
        sets[py::str(name)] = view(nodes.data(), {std::ssize(nodes)}, self);
    return sets;
}

/// (names, points) of a list of points: Slicer's, or a CSV.
py::tuple read_points(const py::object& path) {
    const std::filesystem::path file = path_of(path);
    const std::vector<NamedPoint> points =
        ending(file) == ".csv" ? read_points_csv(file) : read_fiducials(file);
    std::vector<std::string> names;
    for (const NamedPoint& p : points) names.push_back(p.name);
    return py::make_tuple(names, owned(positions_of(points)));
}

/// Interpolates fields of a mesh's nodes at points.
struct Sampler {
    std::shared_ptr<const TetMesh> mesh;
    PointSampler points;
    std::size_t count;
};

void bind_sampler(py::module_& module) {
    py::class_<Sampler>(module, "Sampler", "Interpolates nodal vectors at points fixed in a mesh.")
        .def(py::init([](const Mesh& mesh, const DoubleArray& points) {
                 const auto rows = rows3(points, "points");
                 return Sampler{mesh.mesh, PointSampler(*mesh.mesh, rows), rows.size()};
             }),
             py::arg("mesh"), py::arg("points"),
             "Finds the points (n, 3), m, at rest. A point outside takes the nearest surface "
             "point's value.")
        .def(
            "__call__",
            [](const Sampler& s, const DoubleArray& values) {
                const auto rows = rows3(values, "values");
                if (rows.size() != s.mesh->nodes.size())
                    fail("values: found {} rows, expected one for each of {} nodes", rows.size(),
                         s.mesh->nodes.size());
                return owned(s.points.sample(rows));
            },
            py::arg("values"), "Vectors (n, 3) at the points, of those (nodes, 3) at the nodes.")
        .def_property_readonly(
            "distance",
            [](const Sampler& s) {
                std::vector<double> distance;
                const std::vector<double>& all = s.points.distances();
                distance.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(s.count));
                return owned(std::move(distance), {static_cast<py::ssize_t>(s.count)});
            },
            "Distance of each point from the mesh, m; 0 inside. A copy.");
}

/// Converts a value that JSON has no type for: arrays and numbers of numpy, and paths. Throws Error
/// for anything else.
py::object plain_value(const py::object& value) {
    if (py::hasattr(value, "tolist")) return value.attr("tolist")();
    if (py::hasattr(value, "__fspath__")) return py::str(path_of(value));
    fail(
        "table of keys: found an object of type {}, expected tables, lists, text, numbers and None",
        py::type::of(value).attr("__name__").cast<std::string>());
}

}  // namespace

std::string path_of(const py::object& path) {
    return py::module_::import("os").attr("fspath")(path).cast<std::string>();
}

std::string yaml_text_of(const py::object& text_or_dict) {
    if (py::isinstance<py::str>(text_or_dict)) return text_or_dict.cast<std::string>();
    const py::cpp_function plain(&plain_value);
    try {
        return py::module_::import("json")
            .attr("dumps")(text_or_dict, py::arg("default") = plain)
            .cast<std::string>();
    } catch (py::error_already_set& raised) {
        // A table within itself, or a key that is no text; the value of a key raises Error.
        if (!raised.matches(PyExc_TypeError) && !raised.matches(PyExc_ValueError)) throw;
        if (raised.matches(py::module_::import("livetet").attr("Error"))) throw;
        fail("table of keys: {}", py::str(raised.value()).cast<std::string>());
    }
}

void bind_mesh(py::module_& module) {
    py::class_<Mesh>(module, "Mesh",
                     "Tetrahedral mesh of a body at rest, m, RAS, with its coarser levels. Its "
                     "arrays are read-only views that keep the mesh alive.")
        .def(py::init(&mesh_of_arrays), py::arg("points"), py::arg("tets"),
             py::arg("regions") = py::none(), py::arg("node_sets") = py::dict(),
             py::arg("coarser") = py::list(),
             "From arrays, which are copied: points (n, 3), m; tets (m, 4); a material label of "
             "each tet; named lists of nodes; coarser meshes of the same body, finest first.")
        .def_property_readonly(
            "points",
            [](const py::object& self) { return view(self.cast<const Mesh&>().mesh->nodes, self); },
            "Nodes (n, 3), m; those of ten-node tets hold their edges' midpoints too. A view.")
        .def_property_readonly(
            "tets",
            [](const py::object& self) {
                const auto& tets = self.cast<const Mesh&>().mesh->tets;
                return view(reinterpret_cast<const std::int32_t*>(tets.data()),
                            {std::ssize(tets), 4}, self);
            },
            "Corner nodes (m, 4). A view.")
        .def_property_readonly(
            "regions",
            [](const py::object& self) {
                const auto& regions = self.cast<const Mesh&>().mesh->regions;
                return view(regions.data(), {std::ssize(regions)}, self);
            },
            "Material label of each tet; empty: one material. A view.")
        .def_property_readonly("node_sets", &node_sets, "Named lists of nodes: a dict of views.")
        .def_property_readonly(
            "surface",
            [](const Mesh& m) {
                std::vector<Triangle> triangles = boundary_triangles(m.mesh->tets);
                std::vector<std::int32_t> corners;
                for (const Triangle& t : triangles)
                    corners.insert(corners.end(), t.begin(), t.end());
                return owned(std::move(corners), {std::ssize(triangles), 3});
            },
            "Triangles (k, 3) of the surface, wound outwards. Computed at each call.")
        .def_property_readonly(
            "volume", [](const Mesh& m) { return volume(*m.mesh); }, "m^3")
        .def_property_readonly(
            "levels",
            [](const Mesh& m) {
                std::vector<Mesh> levels;
                if (!m.hierarchy) return std::vector{m};
                for (std::size_t l = 0; l < m.hierarchy->levels.size(); ++l)
                    levels.emplace_back(m.hierarchy, l);
                return levels;
            },
            "The hierarchy's meshes, finest first.")
        .def("save", &save, py::arg("path"), "Writes the hierarchy as `livetet mesh` does (.h5).");
    bind_sampler(module);
    module.def("box", &box, py::arg("size"), py::arg("cells"),
               "Mesh of the box [0, size], m; cells: (nx, ny, nz) bricks of six tets for each "
               "level, finest first.");
    module.def(
        "load_mesh",
        [](const py::object& path, const py::object& progress, const py::kwargs& keys) {
            return load(path, progress, keys);
        },
        py::arg("path"), py::arg("progress") = py::none(),
        "Reads a mesh or meshes an image or a surface, as the `mesh` block of a scene does, whose "
        "keys are taken by name: load_mesh('liver.nii.gz', tets=20000). progress(fraction, text) "
        "is called now and then.");
    module.def("read_points", &read_points, py::arg("path"),
               "(names, points) of a point list, .mrk.json, .fcsv or .csv; points (n, 3), m, RAS.");
}

}  // namespace livetet::python
