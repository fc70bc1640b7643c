#include "apps/viewer/marks.hpp"

#include <vtkActor.h>
#include <vtkGlyph3DMapper.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkSphereSource.h>

#include "apps/viewer/colours.hpp"
#include "apps/viewer/lines.hpp"

namespace livetet {

namespace {

constexpr double shaft_mm = 80;

/// Replaces the contents of a polydata by points, as vertices.
void put_points(vtkPolyData* data, const std::vector<Vector3>& places) {
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> vertices;
    for (const Vector3& x : places) {
        const Vector3 mm = 1e3 * x;
        const vtkIdType id = points->InsertNextPoint(mm.data());
        vertices->InsertNextCell(1, &id);
    }
    data->SetPoints(points);
    data->SetVerts(vertices);
}

double size_of(const TetMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : mesh.nodes) box.extend(x);
    return 1e3 * box.diagonal().norm();
}

}  // namespace

MarksView::MarksView(const ShownBody& body, vtkRenderer* renderer)
    : body_(body), renderer_(renderer), labels_(renderer), ball_mm_(0.012 * size_of(body.mesh)) {
    fixed_ = add_dots(mark_colour::fixed, 4, DotShape::square);
    patches_ = add_dots(mark_colour::patch, 5, DotShape::square);
    bases_ = add_dots(mark_colour::base, ball_mm_, DotShape::ball);
    sensors_ = add_dots(mark_colour::sensor, ball_mm_, DotShape::ball);
    tips_ = add_dots(mark_colour::tool, 0.8 * ball_mm_, DotShape::ball);
    touched_ = add_dots(mark_colour::touched, 0.6 * ball_mm_, DotShape::ball);
    pulled_ = add_dots(mark_colour::pull, ball_mm_, DotShape::ball);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(lines_);
    vtkNew<vtkActor> lines;
    lines->SetMapper(mapper);
    lines->GetProperty()->SetLineWidth(3);
    lines->GetProperty()->LightingOff();
    renderer->AddActor(lines);
}

/// Square dots of a size in pixels, drawn over the surface, or balls of a radius in mm.
MarksView::Dots MarksView::add_dots(const look::Colour& colour, double size, DotShape shape) {
    auto data = vtkSmartPointer<vtkPolyData>::New();
    put_points(data, {});
    auto actor = vtkSmartPointer<vtkActor>::New();
    if (shape == DotShape::ball) {
        vtkNew<vtkSphereSource> ball;
        ball->SetRadius(size);
        ball->SetThetaResolution(12);
        ball->SetPhiResolution(12);
        vtkNew<vtkGlyph3DMapper> mapper;
        mapper->SetInputData(data);
        mapper->SetSourceConnection(ball->GetOutputPort());
        actor->SetMapper(mapper);
        actor->GetProperty()->SetAmbient(0.3);
    } else {
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputData(data);
        mapper->SetResolveCoincidentTopologyToPolygonOffset();
        mapper->SetRelativeCoincidentTopologyPointOffsetParameter(-400);
        actor->SetMapper(mapper);
        actor->GetProperty()->SetPointSize(static_cast<float>(size));
        actor->GetProperty()->LightingOff();
    }
    actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
    renderer_->AddActor(actor);
    return {data, actor};
}

void MarksView::set_texts(const TextLayout& texts) {
    texts_ = texts;
    labels_.set_font_size(texts.font_size(13));
}

void MarksView::show(const ShownMoment& moment) {
    const auto moved = [&](std::int32_t n) -> Vector3 {
        return body_.marked_at[n] + moment.displacement[n];
    };
    ColouredLines lines;
    const auto line = [&](const Vector3& a, const Vector3& b, const look::Colour& c) {
        lines.add(1e3 * a, 1e3 * b, c);
    };
    std::vector<Vector3> fixed, patches, bases, sensors, tips, touched, pulled;
    labels_.begin(moment.keeps_numbers);
    for (const std::int32_t n : body_.fixed) fixed.push_back(moved(n));
    for (const ShownSensor& s : moment.sensors) {
        for (const std::int32_t n : s.patch) patches.push_back(moved(n));
        if (s.base) bases.push_back(*s.base);
        if (!s.now) continue;
        sensors.push_back(*s.now);
        labels_.put(
            *s.now,
            s.base ? fmt::format("{} {:.1f} mm", s.name, 1e3 * (*s.now - *s.base).norm()) : s.name,
            mark_colour::sensor);
        if (s.base) line(*s.base, *s.now, mark_colour::sensor);
    }
    for (const ShownTool& t : moment.tools) {
        const Vector3 tip = t.pose.translation;
        tips.push_back(tip);
        if (t.has_tip) line(tip, t.pose * Vector3(0, 0, -1e-3 * shaft_mm), mark_colour::tool);
        if (!texts_.is_small)
            labels_.put(tip, t.has_tip ? t.name + " tip" : t.name, mark_colour::tool);
    }
    for (const ShownFiducial& f : body_.fiducials) {
        lines.add_cross(1e3 * f.in_image, 2 * ball_mm_, 3, mark_colour::fiducial);
        touched.push_back(f.from_tracker);
        line(f.in_image, f.from_tracker, mark_colour::touched);
        if (texts_.is_small) continue;
        labels_.put(f.in_image,
                    fmt::format("{} {:.2f} mm", f.name, 1e3 * (f.in_image - f.from_tracker).norm()),
                    mark_colour::fiducial);
    }
    if (moment.pull) {
        pulled = {moment.pull->base, moment.pull->to};
        line(moment.pull->base, moment.pull->to, mark_colour::pull);
    }
    for (std::size_t k = 1; k < moment.drawn.size(); ++k)
        line(moment.drawn[k - 1], moment.drawn[k], mark_colour::pull);
    labels_.end();
    for (const auto& [dots, places] : {std::pair(&fixed_, &fixed),
                                       {&patches_, &patches},
                                       {&bases_, &bases},
                                       {&sensors_, &sensors},
                                       {&tips_, &tips},
                                       {&touched_, &touched},
                                       {&pulled_, &pulled}}) {
        dots->actor->SetVisibility(
            !places->empty());  // an empty mapper costs as much time as a full one
        if (!places->empty()) put_points(dots->places, *places);
    }
    lines.put_into(lines_);
}

}  // namespace livetet
