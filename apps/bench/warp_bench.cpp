#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkCharArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkImageInterpolator.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkProbeFilter.h>
#include <vtkUnstructuredGrid.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/bench/benchmarks.hpp"
#include "apps/bench/figure_option.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "base/distribution.hpp"
#include "base/file.hpp"
#include "base/stopwatch.hpp"
#include "base/work_folder.hpp"
#include "image/image_warp.hpp"
#include "io/image_file.hpp"

namespace livetet {

namespace {

struct WarpBenchArguments {
    int size = 256;  ///< voxels along each axis
    int tets = 60000;
    int repeats = 9;
    std::filesystem::path json;
};

constexpr double allowed_s = 1;

/// The pressed mesh of the phantom, and a grey image about it.
struct WarpCase {
    TetMesh mesh;
    std::vector<Vector3> u;
    GreyImage image;
};

WarpCase make_case(const WarpBenchArguments& a, ProgressLine& progress) {
    WarpCase c;
    c.mesh =
        mesh_phantom(make_phantom_images(0.0015, 1), {"", a.tets, 0, 0, 0}, progress.callback())
            .levels.front();
    const Vector3 at = phantom::sensor_place(), inwards = -phantom::organ_normal(at);
    for (const Vector3& x : c.mesh.nodes)
        c.u.push_back(0.015 * std::exp(-(x - at).squaredNorm() / (2 * 0.025 * 0.025)) * inwards);
    const Vector3 half = phantom::organ_half_extents();
    const double spacing = 2.1 * half.maxCoeff() / a.size;
    c.image.size = {a.size, a.size, a.size};
    c.image.ras_from_voxel.diagonal().head<3>().setConstant(spacing);
    c.image.ras_from_voxel.topRightCorner<3, 1>() =
        phantom::organ_centre() - Vector3::Constant(spacing * (a.size - 1) / 2.0);
    c.image.values.reserve(static_cast<std::size_t>(a.size) * a.size * a.size);
    for (int k = 0; k < a.size; ++k)
        for (int j = 0; j < a.size; ++j)
            for (int i = 0; i < a.size; ++i)
                c.image.values.push_back(
                    std::round(500 + 2.0F * static_cast<float>(i - j) +
                               100 * std::sin(0.1F * static_cast<float>(i + 2 * k))));
    return c;
}

/// Times of repeated runs, s.
std::vector<double> timed(int repeats, const std::function<void()>& run) {
    std::vector<double> seconds;
    for (int r = 0; r < repeats; ++r) {
        const auto start = std::chrono::steady_clock::now();
        run();
        seconds.push_back(seconds_since(start));
    }
    return seconds;
}

vtkSmartPointer<vtkImageData> vtk_image(const GreyImage& image) {
    auto data = vtkSmartPointer<vtkImageData>::New();
    data->SetDimensions(image.size.data());
    const double spacing = image.ras_from_voxel(0, 0);
    data->SetSpacing(spacing, spacing, spacing);
    data->SetOrigin(image.ras_from_voxel(0, 3), image.ras_from_voxel(1, 3),
                    image.ras_from_voxel(2, 3));
    return data;
}

/// The same warp by VTK: positions at rest, given at the nodes of the deformed tets, are probed at
/// the voxels, and the image is interpolated there. Voxels outside keep the image's value.
std::vector<float> warp_by_vtk(const WarpCase& c, ThreadTeam& team) {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkDoubleArray> rest;
    rest->SetName("rest");
    rest->SetNumberOfComponents(3);
    for (std::size_t n = 0; n < c.mesh.nodes.size(); ++n) {
        points->InsertNextPoint(Vector3(c.mesh.nodes[n] + c.u[n]).data());
        rest->InsertNextTuple(c.mesh.nodes[n].data());
    }
    vtkNew<vtkCellArray> tets;
    for (const Tet& t : c.mesh.tets) tets->InsertNextCell({t[0], t[1], t[2], t[3]});
    vtkNew<vtkUnstructuredGrid> deformed;
    deformed->SetPoints(points);
    deformed->SetCells(VTK_TETRA, tets);
    deformed->GetPointData()->AddArray(rest);
    vtkNew<vtkProbeFilter> probe;
    probe->SetInputData(vtk_image(c.image));
    probe->SetSourceData(deformed);
    probe->Update();

    const auto image = vtk_image(c.image);
    vtkNew<vtkFloatArray> scalars;
    scalars->SetArray(const_cast<float*>(c.image.values.data()),
                      static_cast<vtkIdType>(c.image.values.size()), 1);
    image->GetPointData()->SetScalars(scalars);
    vtkNew<vtkImageInterpolator> interpolator;
    interpolator->SetInterpolationModeToLinear();
    interpolator->Initialize(image);
    interpolator->Update();
    auto* places =
        vtkDoubleArray::SafeDownCast(probe->GetOutput()->GetPointData()->GetArray("rest"));
    auto* valid = vtkArrayDownCast<vtkCharArray>(
        probe->GetOutput()->GetPointData()->GetArray(probe->GetValidPointMaskArrayName()));
    std::vector<float> out = c.image.values;
    team.run_pieces(out.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const auto id = static_cast<vtkIdType>(n);
            double value = 0;
            if (valid->GetValue(id) &&
                interpolator->Interpolate(places->GetPointer(3 * id), &value))
                out[n] = static_cast<float>(value);
        }
    });
    return out;
}

class Table {
  public:
    explicit Table(double voxels) : voxels_(voxels) {
        fmt::print("\n{:<58} {:>7} {:>10} {:>10} {:>10} {:>12}\n", "", "threads", "median/ms",
                   "least", "most", "Mvoxels/s");
    }
    double add(const std::string& what, const std::string& threads,
               const std::vector<double>& seconds) {
        const Distribution d = distribution(seconds);
        const double least = *std::min_element(seconds.begin(), seconds.end());
        fmt::print("{:<58} {:>7} {:>10.1f} {:>10.1f} {:>10.1f} {:>12.1f}\n", what, threads,
                   1e3 * d.median, 1e3 * least, 1e3 * d.worst, 1e-6 * voxels_ / d.median);
        std::fflush(stdout);
        rows_.push_back({{"what", what},
                         {"threads", threads},
                         {"median_ms", 1e3 * d.median},
                         {"least_ms", 1e3 * least},
                         {"most_ms", 1e3 * d.worst},
                         {"runs", seconds.size()}});
        return d.median;
    }
    const nlohmann::json& rows() const { return rows_; }

  private:
    double voxels_;
    nlohmann::json rows_ = nlohmann::json::array();
};

/// The largest difference of two warps of an image, and the number of voxels that only one of them
/// covers. These lie on the surface, differ by the whole motion, and do not count.
std::pair<double, std::size_t> compare(const GreyImage& rest, const std::vector<float>& a,
                                       const std::vector<float>& b) {
    double worst = 0;
    std::size_t on_surface = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        const bool one_alone = a[n] != b[n] && (a[n] == rest.values[n] || b[n] == rest.values[n]);
        on_surface += one_alone && std::abs(a[n] - b[n]) > 0.1;
        if (!one_alone) worst = std::max<double>(worst, std::abs(a[n] - b[n]));
    }
    return {worst, on_surface};
}

/// The phantom pressed by 15 mm in a volume that it fills: the parts of `livetet warp`, on one
/// thread and on all, and the same by VTK's probe filter and interpolator, whose values must agree.
/// Prints a table. Returns 1 if the linear warp takes a second or more on all threads, or VTK's
/// values differ.
int bench_warp(const WarpBenchArguments& a) {
    ProgressLine progress("warp");
    const WarpCase c = make_case(a, progress);
    const ImageGrid grid = grid_of(c.image);
    const auto voxels = static_cast<double>(c.image.values.size());
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    const BodyMotion motion = body_motion(c.mesh, c.u, grid.spacing().maxCoeff());
    const BodyMotion bare = body_motion(c.mesh, c.u, 0);
    const LabelImage labels{
        c.image.size, c.image.ras_from_voxel, {c.image.values.begin(), c.image.values.end()}};
    WarpCounts counts;
    Table table(voxels);
    double linear_s = 0;
    for (const int threads : {1, cores}) {
        if (threads == 1 && cores == 1) continue;
        ThreadTeam team(threads);
        const std::string text = fmt::format("{}", threads);
        const auto warp = [&](Interpolation how) {
            return timed(a.repeats,
                         [&] { warp_image(c.image, grid, motion, how, 0.0F, team, counts); });
        };
        table.add("the mesh with its rind", text,
                  timed(a.repeats, [&] { body_motion(c.mesh, c.u, grid.spacing().maxCoeff()); }));
        linear_s = table.add("warp, grey, linear", text, warp(Interpolation::linear));
        table.add("warp, grey, cubic", text, warp(Interpolation::cubic));
        table.add("warp, labels, nearest", text, timed(a.repeats, [&] {
                      warp_image(labels, grid, motion, Interpolation::nearest, 0, team, counts);
                  }));
        table.add("inverse displacement field", text, timed(a.repeats, [&] {
                      displacement_field(grid, motion, FieldDirection::inverse, team);
                  }));
    }
    const WorkFolder folder;
    table.add("write .nii.gz, 16 bits", "1",
              timed(3, [&] { write_image(folder / "image.nii.gz", c.image, ScalarType::int16); }));
    table.add("read it", "1", timed(3, [&] { read_grey_image(folder / "image.nii.gz"); }));
    ThreadTeam team(cores);
    std::vector<float> theirs;
    const double vtk_s =
        table.add("the same warp by VTK: probe filter, interpolator", fmt::format("{}", cores),
                  timed(3, [&] { theirs = warp_by_vtk(c, team); }));

    // Without its rind the body covers what VTK's probe finds; VTK has no empty voxels.
    GreyImage ours =
        warp_image(c.image, grid, bare, Interpolation::linear, std::nanf(""), team, counts);
    for (std::size_t n = 0; n < ours.values.size(); ++n)
        if (std::isnan(ours.values[n])) ours.values[n] = c.image.values[n];
    const auto [worst, on_surface] = compare(c.image, ours.values, theirs);
    const bool same =
        worst < 0.5 && static_cast<double>(on_surface) < 1e-3 * static_cast<double>(counts.carried);
    fmt::print(
        "\n{0} x {0} x {0} voxels, {1} tets, {2:.1f} % of the voxels in the body; VTK takes "
        "{3:.1f} times as long; its values of 0 to 1600 "
        "differ by {4:.2g} at most ({5} voxels on the surface are in one's body alone)\n",
        a.size, c.mesh.tets.size(), 100 * static_cast<double>(counts.carried) / voxels,
        vtk_s / linear_s, worst, on_surface);
    const bool holds = linear_s < allowed_s;
    fmt::print(
        "target: the linear warp in less than {:g} s on all threads: {}; the same values as "
        "VTK: {}\n",
        allowed_s, holds ? "holds" : "MISSED", same ? "yes" : "NO");
    if (!a.json.empty())
        write_text_file(a.json, nlohmann::json{{"size", a.size},
                                               {"tets", c.mesh.tets.size()},
                                               {"carried", counts.carried},
                                               {"rows", table.rows()},
                                               {"vtk_times_longer", vtk_s / linear_s},
                                               {"worst_difference", worst},
                                               {"on_surface", on_surface}}
                                        .dump(2) +
                                    "\n");
    return holds && same ? 0 : 1;
}

}  // namespace

void add_warp_benchmark(CLI::App& bench, int& status) {
    CLI::App* command = bench.add_subcommand(
        "warp",
        "Time to warp an image to the deformed state, by part, compared with VTK's probe filter; "
        "exit status 1 if a target is missed");
    auto a = std::make_shared<WarpBenchArguments>();
    command->add_option("--size", a->size, "voxels along each axis")
        ->capture_default_str()
        ->check(CLI::Range(16, 1024));
    command->add_option("--tets", a->tets, "tets of the phantom's mesh")
        ->capture_default_str()
        ->check(CLI::Range(500, 1000000));
    command->add_option("--repeats", a->repeats, "runs whose median time is reported")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command->add_option("--json", a->json, "write the figures to this file");
    command->callback([a, &status] {
        check_output_files({a->json});
        status = bench_warp(*a);
    });
}

}  // namespace livetet
