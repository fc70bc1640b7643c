#include "apps/viewer/body.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkIntArray.h>
#include <vtkLoopSubdivisionFilter.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStaticPointLocator.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>

#include "apps/live/statement_record.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/scene_image.hpp"
#include "base/error.hpp"
#include "geometry/ellipsoid_surface.hpp"
#include "io/image_file.hpp"
#include "io/registration_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/clipped_grid.hpp"
#include "mesh/grid_border.hpp"
#include "mesh/grid_surface.hpp"
#include "mesh/tet_faces.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// Calls f; an Error of it becomes an entry of what is left out.
template <class F>
void or_left_out(ShownBody& body, const std::string& what, F&& f) {
    try {
        f();
    } catch (const Error& error) {
        body.left_out.push_back(fmt::format("{}: {}", what, error.what()));
    }
}

/// Throws Error if image and mesh do not overlap: nothing would be visible.
void read_image(ShownBody& body, const fs::path& path) {
    GreyImage image = read_grey_image(path);
    Eigen::AlignedBox3d box = box_of(grid_of(image)), mesh;
    for (const Vector3& x : body.mesh.nodes) mesh.extend(x);
    if (!box.intersects(mesh))
        fail("{}: extends over {}, the mesh over {}, expected an image of the same place",
             path.string(), box_mm(std::array{Vector3(box.min()), Vector3(box.max())}),
             box_mm(body.mesh.nodes));
    body.image = std::move(image);
}

/// The number of the tet behind each triangle of the boundary.
vtkSmartPointer<vtkIntArray> tets_behind(std::span<const Triangle> triangles,
                                         std::span<const Tet> tets) {
    const auto key_of = [](Triangle t) {
        std::ranges::sort(t);
        return t;
    };
    std::map<Triangle, int> behind;
    for (const Triangle& t : triangles) behind.emplace(key_of(t), 0);
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (const auto& [i, j, k] : tet_faces) {
            const auto found = behind.find(key_of({tets[e][i], tets[e][j], tets[e][k]}));
            if (found != behind.end()) found->second = static_cast<int>(e);
        }
    const auto numbers = vtkSmartPointer<vtkIntArray>::New();
    for (const Triangle& t : triangles) numbers->InsertNextValue(behind.at(key_of(t)));
    return numbers;
}

/// Triangles with the number of a tet each.
DrawnSurface drawn(vtkPolyData* data, std::span<const Tet> tets) {
    DrawnSurface surface;
    for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
        surface.nodes.emplace_back(Eigen::Map<const Vector3>(data->GetPoint(i)));
    surface.tets.resize(surface.nodes.size());
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    for (vtkIdType i = 0; i < data->GetNumberOfCells(); ++i) {
        data->GetPolys()->GetCellAtId(i, count, ids);
        Triangle& t = surface.triangles.emplace_back();
        for (int k = 0; k < 3; ++k) {
            t[k] = static_cast<std::int32_t>(ids[k]);
            surface.tets[ids[k]] =
                tets[static_cast<std::size_t>(data->GetCellData()->GetScalars()->GetTuple1(i))];
        }
    }
    return surface;
}

/// What is drawn of a mesh: of a grid what of it is the body, its surface smoothed.
class Shell {
  public:
    explicit Shell(const TetMesh& mesh) : mesh_(mesh) {
        if (mesh.shares.empty()) return;
        clipped_ = clipped_grid(mesh);
        for (const std::int32_t t : clipped_.parents) owners_.push_back(mesh.tets[t]);
    }
    std::span<const Tet> tets() const { return mesh_.shares.empty() ? mesh_.tets : clipped_.tets; }
    /// Of each of these, a tet of the mesh in which it lies.
    std::span<const Tet> owners() const { return mesh_.shares.empty() ? mesh_.tets : owners_; }
    std::vector<Vector3> places(std::span<const Triangle> surface) const {
        if (mesh_.shares.empty()) return mesh_.nodes;
        TetMesh nodes;
        nodes.nodes = clipped_.at_nodes(mesh_.nodes);
        if (mesh_.hexahedra.empty()) return nodes.nodes;
        nodes.hexahedra = {mesh_.hexahedra.front()};  // for the axes
        return smoothed_surface(nodes, surface);
    }

  private:
    const TetMesh& mesh_;
    ClippedTets clipped_;
    std::vector<Tet> owners_;
};

/// Whether more than two triangles meet at an edge, as where cuts leave cells that hang together by
/// an edge alone. Loop's subdivision has no rule there.
bool has_branching_edge(std::span<const Triangle> triangles) {
    std::vector<std::array<std::int32_t, 2>> edges;
    edges.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
            edges.push_back({a, b});
        }
    std::ranges::sort(edges);
    for (std::size_t k = 2; k < edges.size(); ++k)
        if (edges[k] == edges[k - 2]) return true;
    return false;
}

/// ShownBody::marked_at: of nodes of the border the nearest node of the surface.
std::vector<Vector3> mark_places(const TetMesh& mesh, const DrawnSurface& surface) {
    std::vector<Vector3> places = mesh.nodes;
    if (surface.nodes.empty()) return places;
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (const Vector3& x : surface.nodes) points->InsertNextPoint(x.data());
    vtkNew<vtkPolyData> data;
    data->SetPoints(points);
    vtkNew<vtkStaticPointLocator> locator;
    locator->SetDataSet(data);
    locator->BuildLocator();
    for (const std::int32_t n : nodes_of(boundary_triangles(mesh.tets)))
        places[n] = surface.nodes[locator->FindClosestPoint(mesh.nodes[n].data())];
    return places;
}

void read_shown_fiducials(ShownBody& body, const fs::path& path) {
    const FiducialRegistration registration = read_registration(path);
    for (const RegisteredFiducial& f : registration.fiducials) {
        const Vector3 touched = registration.reference_tool.empty() ? f.in_tracker : f.in_reference;
        body.fiducials.push_back({f.name, f.in_image, registration.image_from_base * touched});
    }
}

}  // namespace

DrawnSurface render_surface(const TetMesh& mesh) {
    constexpr std::size_t enough = 20000;
    const Shell shell(mesh);
    const std::vector<Triangle> triangles = boundary_triangles(shell.tets());
    const std::vector<std::int32_t> nodes = nodes_of(triangles);
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    const std::vector<Vector3> places = shell.places(triangles);
    for (const std::int32_t n : nodes) points->InsertNextPoint(places[n].data());
    vtkNew<vtkCellArray> cells;
    for (const Triangle& t : triangles) {
        vtkIdType ids[3];
        for (int k = 0; k < 3; ++k)
            ids[k] = std::lower_bound(nodes.begin(), nodes.end(), t[k]) - nodes.begin();
        cells->InsertNextCell(3, ids);
    }
    vtkNew<vtkPolyData> coarse;
    coarse->SetPoints(points);
    coarse->SetPolys(cells);
    coarse->GetCellData()->SetScalars(
        tets_behind(triangles, shell.tets()));  // triangles pass it on
    int times = 0;
    for (std::size_t count = triangles.size(); count < enough; count *= 4) ++times;
    if (times == 0 || has_branching_edge(triangles)) return drawn(coarse, shell.owners());
    vtkNew<vtkLoopSubdivisionFilter> fine;
    fine->SetInputData(coarse);
    fine->SetNumberOfSubdivisions(std::min(times, 3));
    fine->Update();
    return drawn(fine->GetOutput()->GetNumberOfCells() > 0 ? fine->GetOutput() : coarse,
                 shell.owners());
}

void add_statement(ShownMoment& moment, const FrameStatement& statement,
                   const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < statement.targets.size() && i < names.size(); ++i) {
        const TargetStatement& t = statement.targets[i];
        moment.targets.push_back({names[i], t.position, t.radius_95, !statement.missing.empty(),
                                  ellipsoid_surface(t.position, error_ellipsoid(t.covariance))});
    }
    moment.stated = statement.surface;
    if (const std::string error = statement_text(statement, names); !error.empty())
        moment.text += "; " + error;
}

void set_mesh(ShownBody& body, TetMesh mesh) {
    body.mesh = std::move(mesh);
    if (!body.has_own_surface) body.surface = render_surface(body.mesh);
    body.marked_at = mark_places(body.mesh, body.surface);
}

ShownBody make_shown_body(TetMesh mesh, const std::optional<Scene>& scene, const fs::path& named_in,
                          const ViewFiles& files) {
    ShownBody body;
    body.has_own_surface = !files.surface.empty();
    if (body.has_own_surface) body.surface = {read_surface(files.surface, Space::ras), {}};
    set_mesh(body, std::move(mesh));

    if (!files.image.empty())
        read_image(body, files.image);
    else if (scene)
        or_left_out(body, "slices (--image FILE shows them)",
                    [&] { read_image(body, find_scene_image(*scene, named_in).file); });

    if (!scene) {
        body.left_out.push_back(
            "slices, fixed nodes, sensors, fiducials: the result holds no scene");
        return body;
    }
    std::vector<std::int32_t> fixed;
    for (std::size_t i = 0; i < scene->fix.size(); ++i)
        or_left_out(body, "fixed nodes", [&] {
            const auto nodes =
                select_located(body.mesh, scene->fix[i], fmt::format("fix[{}]", i), named_in);
            fixed.insert(fixed.end(), nodes.begin(), nodes.end());
        });
    std::sort(fixed.begin(), fixed.end());
    fixed.erase(std::unique(fixed.begin(), fixed.end()), fixed.end());
    const std::vector<std::int32_t> skin = nodes_of(body_surface(body.mesh));
    std::set_intersection(fixed.begin(), fixed.end(), skin.begin(), skin.end(),
                          std::back_inserter(body.fixed));
    if (scene->track && !scene->track->registration.empty())
        or_left_out(body, "fiducials", [&] {
            read_shown_fiducials(body, locate(scene->track->registration, named_in));
        });
    return body;
}

}  // namespace livetet
