#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkFloatArray.h>
#include <vtkGlyph3DMapper.h>
#include <vtkLightKit.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkSphereSource.h>
#include <vtkTextActor.h>

#include <Eigen/Dense>

#include <algorithm>
#include <string>

#include "apps/plots/off_screen_window.hpp"
#include "apps/plots/pictures.hpp"
#include "apps/plots/zoom_to_fill.hpp"
#include "base/error.hpp"
#include "mesh/grid_surface.hpp"

namespace livetet {

namespace {

constexpr look::Colour patch_colour = look::red;
constexpr look::Colour fixed_colour{0.25, 0.25, 0.28};

/// The surface moved by `scale` times the displacement, in mm, with the length of the displacement
/// in mm at each point.
vtkSmartPointer<vtkPolyData> surface(const TetMesh& mesh, std::span<const Vector3> displacement,
                                     double scale) {
    vtkNew<vtkPoints> points;
    vtkNew<vtkFloatArray> length;
    length->SetName("displacement");
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const std::vector<Vector3> places = drawn_places(mesh, surface);
    for (std::size_t n = 0; n < places.size(); ++n) {
        const Vector3 x = 1e3 * (places[n] + scale * displacement[n]);
        points->InsertNextPoint(x.data());
        length->InsertNextValue(static_cast<float>(1e3 * scale * displacement[n].norm()));
    }
    vtkNew<vtkCellArray> triangles;
    for (const auto& [a, b, c] : surface) {
        const vtkIdType ids[3] = {a, b, c};
        triangles->InsertNextCell(3, ids);
    }
    auto data = vtkSmartPointer<vtkPolyData>::New();
    data->SetPoints(points);
    data->SetPolys(triangles);
    data->GetPointData()->SetScalars(length);
    return data;
}

vtkSmartPointer<vtkActor> coloured(vtkPolyData* data, vtkColorTransferFunction* map) {
    vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(data);
    normals->SetFeatureAngle(50);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(normals->GetOutputPort());
    mapper->SetLookupTable(map);
    mapper->UseLookupTableScalarRangeOn();
    mapper->InterpolateScalarsBeforeMappingOn();
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetAmbient(0.35);
    actor->GetProperty()->SetDiffuse(0.7);
    return actor;
}

/// The shape at rest as lines, where the organ has left it by at least a tenth of the largest
/// motion.
vtkSmartPointer<vtkActor> veil(const TetMesh& mesh, std::span<const Vector3> displacement,
                               vtkPolyData* rest, double largest_mm) {
    vtkNew<vtkCellArray> left;
    for (const auto& [a, b, c] : boundary_triangles(mesh.tets)) {
        const double moved =
            std::max({displacement[a].norm(), displacement[b].norm(), displacement[c].norm()});
        const vtkIdType ids[3] = {a, b, c};
        if (1e3 * moved > 0.1 * largest_mm) left->InsertNextCell(3, ids);
    }
    vtkNew<vtkPolyData> data;
    data->SetPoints(rest->GetPoints());
    data->SetPolys(left);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(data);
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetRepresentationToWireframe();
    actor->GetProperty()->SetColor(look::grey[0], look::grey[1], look::grey[2]);
    actor->GetProperty()->SetOpacity(0.5);
    actor->GetProperty()->LightingOff();
    return actor;
}

/// A small ball at each of some nodes of a surface.
vtkSmartPointer<vtkActor> balls(vtkPolyData* data, std::span<const std::int32_t> nodes,
                                double radius_mm, const look::Colour& colour) {
    vtkNew<vtkPoints> points;
    for (const std::int32_t n : nodes) points->InsertNextPoint(data->GetPoint(n));
    vtkNew<vtkPolyData> places;
    places->SetPoints(points);
    vtkNew<vtkSphereSource> ball;
    ball->SetRadius(radius_mm);
    vtkNew<vtkGlyph3DMapper> mapper;
    mapper->SetInputData(places);
    mapper->SetSourceConnection(ball->GetOutputPort());
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
    actor->GetProperty()->SetAmbient(0.3);
    return actor;
}

/// Nodes of a set on the surface; empty if there is no such set.
std::vector<std::int32_t> marked(const TetMesh& mesh, const char* name) {
    const auto found = mesh.node_sets.find(name);
    if (found == mesh.node_sets.end()) return {};
    const std::vector<std::int32_t> skin = nodes_of(boundary_triangles(mesh.tets));
    std::vector<std::int32_t> nodes;
    std::set_intersection(found->second.begin(), found->second.end(), skin.begin(), skin.end(),
                          std::back_inserter(nodes));
    return nodes;
}

/// Direction of view: across the press, slightly from the pressed side, towards the broad side of
/// the organ. Unit vectors.
struct View {
    Vector3 towards_camera, up;
};

View choose_view(const TetMesh& mesh, std::span<const Vector3> displacement) {
    Vector3 press = Vector3::Zero(), mean = Vector3::Zero();
    double largest = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        mean += mesh.nodes[n] / static_cast<double>(mesh.nodes.size());
        if (displacement[n].norm() <= largest) continue;
        largest = displacement[n].norm();
        press = displacement[n];
    }
    const Vector3 up = largest > 0 ? Vector3(-press / largest) : Vector3::UnitZ();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vector3& x : mesh.nodes) spread += (x - mean) * (x - mean).transpose();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - up * up.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(across * spread * across);
    const Vector3 long_side = axes.eigenvectors().col(2);
    Vector3 side = long_side.cross(up).normalized();
    if (side.dot(Vector3(0.3, 1, 0.1)) < 0)
        side = -side;  // the one towards the patient's front (RAS)
    return {(side + 0.5 * up).normalized(), up};
}

void add_text(vtkRenderer* renderer, const std::string& text, double x, double y, int size,
              const look::Colour& colour, TextWeight weight = TextWeight::regular) {
    vtkNew<vtkTextActor> actor;
    actor->SetInput(text.c_str());
    actor->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
    actor->SetPosition(x, y);
    set_text(actor->GetTextProperty(), size, weight);
    actor->GetTextProperty()->SetColor(colour[0], colour[1], colour[2]);
    actor->GetTextProperty()->SetJustificationToCentered();
    renderer->AddViewProp(actor);
}

void add_scalar_bar(vtkRenderer* renderer, vtkColorTransferFunction* map) {
    vtkNew<vtkScalarBarActor> bar;
    bar->SetLookupTable(map);
    bar->SetNumberOfLabels(6);
    bar->SetLabelFormat("%.1f");
    bar->UnconstrainedFontSizeOn();
    bar->SetOrientationToHorizontal();
    bar->SetPosition(0.1, 0.05);
    bar->SetWidth(0.8);
    bar->SetHeight(0.5);
    bar->SetBarRatio(0.45);
    set_text(bar->GetLabelTextProperty(), look::tick_size);
    renderer->AddViewProp(bar);
}

vtkSmartPointer<vtkRenderer> add_renderer(vtkRenderWindow* window, double x0, double y0, double x1,
                                          double y1) {
    auto renderer = vtkSmartPointer<vtkRenderer>::New();
    renderer->SetViewport(x0, y0, x1, y1);
    renderer->SetBackground(look::paper.data());
    window->AddRenderer(renderer);
    return renderer;
}

}  // namespace

void write_organ_picture(const std::filesystem::path& path, const TetMesh& mesh,
                         std::span<const Vector3> displacement, const std::string& when) {
    if (displacement.size() != mesh.nodes.size())
        fail("{}: {} displacements for {} nodes, expected one each", path.string(),
             displacement.size(), mesh.nodes.size());
    double largest_mm = 0;
    Eigen::AlignedBox3d box;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        largest_mm = std::max(largest_mm, 1e3 * displacement[n].norm());
        box.extend(1e3 * mesh.nodes[n]);
    }
    const auto map = organ_colours(std::max(largest_mm, 0.1));
    const auto window = make_window();
    const auto left = add_renderer(window, 0, 0.16, 0.5, 1),
               right = add_renderer(window, 0.5, 0.16, 1, 1);
    const auto key = add_renderer(window, 0, 0, 0.45, 0.16),
               bar = add_renderer(window, 0.45, 0, 1, 0.16);

    const auto rest = surface(mesh, displacement, 0), moved = surface(mesh, displacement, 1);
    const std::vector<std::int32_t> fixed = marked(mesh, "fixed"), patch = marked(mesh, "patch");
    const double radius = 0.006 * box.diagonal().norm();
    for (const auto& [renderer, data] : {std::pair(left, rest), std::pair(right, moved)}) {
        renderer->AddActor(coloured(data, map));
        renderer->AddActor(balls(data, fixed, 0.8 * radius, fixed_colour));
        renderer->AddActor(balls(data, patch, radius, patch_colour));
    }
    vtkNew<vtkLightKit> lights;  // from above, with fill light
    lights->SetKeyLightIntensity(0.85);
    lights->AddLightsToRenderer(left);
    lights->AddLightsToRenderer(right);
    right->AddActor(veil(mesh, displacement, rest, largest_mm));
    add_text(left, "At rest", 0.5, 0.93, look::title_size, look::ink, TextWeight::bold);
    add_text(right, fmt::format("Deformed, {}: {:.1f} mm at most", when, largest_mm), 0.5, 0.93,
             look::title_size, look::ink, TextWeight::bold);
    if (!patch.empty())
        add_text(key, "red balls: the patch that the sensor drives", 0.5, 0.62, look::tick_size,
                 look::red);
    if (!fixed.empty())
        add_text(key, "dark balls: fixed nodes", 0.5, 0.38, look::tick_size, look::ink);
    add_text(key, "grey lines, right: the shape at rest", 0.5, 0.14, look::tick_size, look::grey);
    add_text(bar, "displacement [mm]", 0.5, 0.68, look::label_size, look::ink);
    add_scalar_bar(bar, map);

    const View view = choose_view(mesh, displacement);
    vtkNew<vtkCamera> camera;
    const Vector3 centre = box.center(), eye = centre + 1000 * view.towards_camera;
    camera->SetFocalPoint(centre.data());
    camera->SetPosition(eye.data());
    camera->SetViewUp(view.up.data());
    left->SetActiveCamera(camera);
    right->SetActiveCamera(camera);
    right->ResetCamera();
    std::vector<Vector3> points;  // at rest and deformed
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        for (const Vector3& x : {mesh.nodes[n], Vector3(mesh.nodes[n] + displacement[n])})
            points.push_back(1e3 * x);
    camera->Zoom(zoom_to_fill(right, points, 0.95, 0.8));  // below the title
    right->ResetCameraClippingRange();
    write_window(window, path);
}

}  // namespace livetet
