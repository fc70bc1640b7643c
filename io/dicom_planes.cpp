#include "io/dicom_planes.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/error.hpp"
#include "io/volume.hpp"

namespace livetet::dicom {

namespace {

/// Positions and directions are decimal texts of up to 16 characters, often rounded to 0.1 mm.
constexpr double max_angle = 1e-3;  ///< radians
constexpr double max_spacing_ratio = 1e-3;
constexpr double max_shift_mm = 0.1;  ///< sideways, of neighbouring slices
constexpr double max_uneven = 0.1;    ///< of the step
constexpr double same_position_mm = 1e-3;

void check_alike(std::span<const Plane> planes) {
    const Plane& first = planes.front();
    for (const Plane& p : planes) {
        if (p.size != first.size)
            fail("{}: has {} x {} pixels, expected {} x {} as in {}", p.name, p.size[0], p.size[1],
                 first.size[0], first.size[1], first.name);
        if (((p.spacing - first.spacing).array().abs() > max_spacing_ratio * first.spacing.array())
                .any())
            fail("{}: its pixels are {:g} x {:g} mm apart, expected {:g} x {:g} as in {}", p.name,
                 p.spacing[0], p.spacing[1], first.spacing[0], first.spacing[1], first.name);
        const double turned =
            std::max((p.row - first.row).norm(), (p.column - first.column).norm());
        if (turned > max_angle)
            fail("{}: is turned by {:.3g} degrees against {}, expected slices of one orientation",
                 p.name, 180 / std::numbers::pi * 2 * std::asin(std::min(turned / 2, 1.0)),
                 first.name);
    }
}

Eigen::Vector3d normal_of(const Plane& plane) { return plane.row.cross(plane.column); }

/// Positions of the planes along the normal of the first, mm.
std::vector<double> depths_of(std::span<const Plane> planes) {
    const Eigen::Vector3d normal = normal_of(planes.front());
    std::vector<double> depths;
    for (const Plane& p : planes)
        depths.push_back(normal.dot(p.position - planes.front().position));
    return depths;
}

std::vector<std::size_t> order_of(const std::vector<double>& depths) {
    std::vector<std::size_t> order(depths.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return depths[a] < depths[b]; });
    return order;
}

/// `planes` in the order of their depths.
void check_not_shifted(std::span<const Plane> planes, const std::vector<std::size_t>& order) {
    const Eigen::Vector3d normal = normal_of(planes.front());
    for (std::size_t n = 1; n < order.size(); ++n) {
        const Plane &before = planes[order[n - 1]], &plane = planes[order[n]];
        const Eigen::Vector3d step = plane.position - before.position;
        const double along = normal.dot(step), sideways = (step - along * normal).norm();
        if (sideways > max_shift_mm)
            fail(
                "{}: is shifted sideways by {:.3g} mm against {}, {:.3g} mm away (a gantry tilt of "
                "{:.3g} degrees?), expected slices straight above each other: correct the tilt in "
                "3D Slicer or with dcm2niix, and save the image as NRRD or NIfTI",
                plane.name, sideways, before.name, along,
                180 / std::numbers::pi * std::atan2(sideways, along));
    }
    const Eigen::Vector3d all = planes[order.back()].position - planes[order.front()].position;
    const double sideways = (all - normal.dot(all) * normal).norm();
    if (sideways > std::max(max_shift_mm, 2e-3 * all.norm()))
        fail(
            "{}: is shifted sideways by {:.3g} mm against {}, expected slices straight above each "
            "other (gantry tilt?)",
            planes[order.back()].name, sideways, planes[order.front()].name);
}

/// The grid of `slices` planes from the lowest on; `step`: from slice to slice, mm (LPS).
ImageGrid grid_of(const Plane& lowest, int slices, const Eigen::Vector3d& step,
                  const std::string& where) {
    checked_voxel_count({lowest.size[0], lowest.size[1], slices}, where);
    ImageGrid grid{{lowest.size[0], lowest.size[1], slices}};
    const Eigen::Array3d metres_ras_from_lps_mm(-1e-3, -1e-3, 1e-3);
    const auto set_column = [&](int j, const Eigen::Vector3d& lps_mm) {  // no negative zero
        grid.ras_from_voxel.col(j).head<3>() = metres_ras_from_lps_mm * lps_mm.array() + 0.0;
    };
    set_column(0, lowest.spacing[0] * lowest.row);
    set_column(1, lowest.spacing[1] * lowest.column);
    set_column(2, step);
    set_column(3, lowest.position);
    check_spans_space(grid.ras_from_voxel, where, "Image Orientation (Patient)");
    return grid;
}

/// A length of the file in mm if it is usable as a step.
std::optional<double> step_in(const std::optional<double>& length) {
    return length && *length > same_position_mm && *length < 1e4 ? length : std::nullopt;
}

/// The step of a stack whose planes lie at one position.
double step_of_one(const Plane& plane, const std::string& where) {
    if (const auto step = step_in(plane.slice_step)) return *step;
    if (const auto step = step_in(plane.thickness)) return *step;
    fail("{}: has one slice of no stated thickness, expected two slices or more", where);
}

/// Throws Error unless the steps between sorted slices are equal.
void check_even(std::span<const Plane> planes, const std::vector<std::size_t>& order,
                const std::vector<double>& depths) {
    std::vector<double> steps;
    for (std::size_t n = 1; n < order.size(); ++n)
        steps.push_back(depths[order[n]] - depths[order[n - 1]]);
    for (std::size_t n = 0; n < steps.size(); ++n)
        if (steps[n] < same_position_mm)
            fail(
                "{}: lies at the position of {}, expected one slice a position (several phases or "
                "echoes in one series?)",
                planes[order[n + 1]].name, planes[order[n]].name);
    std::vector<double> sorted = steps;
    const auto middle = sorted.begin() + (std::ssize(sorted) - 1) / 2;
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double usual = *middle;
    for (std::size_t n = 0; n < steps.size(); ++n) {
        const std::string &name = planes[order[n + 1]].name, &before = planes[order[n]].name;
        const double missing = std::round(steps[n] / usual) - 1;
        if (missing >= 1 && std::abs(steps[n] - (missing + 1) * usual) <= max_uneven * usual)
            fail(
                "{}: lies {:.4g} mm above {}, expected {:.4g} mm: {:.0f} slice(s) between them "
                "are missing",
                name, steps[n], before, usual, missing);
        if (std::abs(steps[n] - usual) > max_uneven * usual)
            fail("{}: lies {:.4g} mm above {}, expected {:.4g} mm as between other slices", name,
                 steps[n], before, usual);
    }
    const double mean =
        (depths[order.back()] - depths[order.front()]) / static_cast<double>(steps.size());
    for (std::size_t n = 0; n < order.size(); ++n) {
        const double off = depths[order[n]] - depths[order.front()] - static_cast<double>(n) * mean;
        if (std::abs(off) > max_uneven * mean)
            fail(
                "{}: lies {:.3g} mm off its place among slices of {:.4g} mm, expected evenly "
                "spaced slices",
                planes[order[n]].name, off, mean);
    }
}

}  // namespace

Eigen::Vector3d lps_mm(const ImageGrid& grid, int k) {
    const Eigen::Array3d lps_mm_from_metres_ras(-1e3, -1e3, 1e3);
    return lps_mm_from_metres_ras *
               (grid.ras_from_voxel * Eigen::Vector4d(0, 0, k, 1)).head<3>().array() +
           0.0;
}

void check_plane(Plane& plane) {
    if (!plane.position.allFinite() || plane.position.cwiseAbs().maxCoeff() > 1e6)
        fail("{}: its Image Position (Patient) is ({:g}, {:g}, {:g}), expected mm", plane.name,
             plane.position[0], plane.position[1], plane.position[2]);
    if (!((plane.spacing.array() > 1e-6).all() && (plane.spacing.array() < 1e4).all()))
        fail("{}: its Pixel Spacing is {:g} x {:g} mm, expected positive numbers", plane.name,
             plane.spacing[0], plane.spacing[1]);
    const double row = plane.row.norm(), column = plane.column.norm(),
                 cosine = plane.row.dot(plane.column);
    if (!(std::abs(row - 1) < 1e-2 && std::abs(column - 1) < 1e-2 && std::abs(cosine) < 1e-2))
        fail(
            "{}: its Image Orientation (Patient) is ({:g}, {:g}, {:g}) and ({:g}, {:g}, {:g}), "
            "expected unit vectors at right angles",
            plane.name, plane.row[0], plane.row[1], plane.row[2], plane.column[0], plane.column[1],
            plane.column[2]);
    plane.row /= row;
    plane.column = (plane.column - plane.row.dot(plane.column) * plane.row).normalized();
}

Stack stack_image(std::span<const Plane> planes, const std::string& where) {
    if (planes.empty()) fail("{}: has no slices", where);
    check_alike(planes);
    const std::vector<double> depths = depths_of(planes);
    const std::vector<std::size_t> order = order_of(depths);
    Eigen::Vector3d step;
    if (planes.size() == 1) {
        step = step_of_one(planes.front(), where) * normal_of(planes.front());
    } else {
        check_not_shifted(planes, order);
        check_even(planes, order, depths);
        step = (planes[order.back()].position - planes[order.front()].position) /
               static_cast<double>(planes.size() - 1);
    }
    Stack stack;
    stack.grid = grid_of(planes[order.front()], static_cast<int>(planes.size()), step, where);
    stack.slice_of_plane.resize(planes.size());
    for (std::size_t n = 0; n < order.size(); ++n)
        stack.slice_of_plane[order[n]] = static_cast<int>(n);
    return stack;
}

Stack stack_segmentation(std::span<const Plane> planes, const std::string& where) {
    if (planes.empty()) fail("{}: has no frames", where);
    check_alike(planes);
    const std::vector<double> depths = depths_of(planes);
    const std::vector<std::size_t> order = order_of(depths);
    check_not_shifted(planes, order);
    const double height = depths[order.back()] - depths[order.front()];
    double step = step_in(planes.front().slice_step).value_or(height);
    for (std::size_t n = 1; n < order.size(); ++n)
        if (const double gap = depths[order[n]] - depths[order[n - 1]]; gap > same_position_mm)
            step = std::min(step, gap);
    if (height <= same_position_mm) step = step_of_one(planes.front(), where);

    Stack stack;
    stack.slice_of_plane.resize(planes.size());
    double slice = 0;  // counted from gap to gap, as a stated step is rounded
    for (std::size_t n = 1; n < order.size(); ++n) {
        const double gap = depths[order[n]] - depths[order[n - 1]], slices = std::round(gap / step);
        if (std::abs(gap - slices * step) > max_uneven * step + 0.01 * gap)
            fail("{}: lies {:.4g} mm above {}, expected a multiple of {:.4g} mm",
                 planes[order[n]].name, gap, planes[order[n - 1]].name, step);
        slice += slices;
        if (slice > 1 << 20)
            fail("{}: its frames span {:.4g} mm, expected fewer slices of {:.4g} mm", where, height,
                 step);
        stack.slice_of_plane[order[n]] = static_cast<int>(slice);
    }
    const Plane &lowest = planes[order.front()], &highest = planes[order.back()];
    const Eigen::Vector3d step_vector =
        slice > 0 ? Eigen::Vector3d((highest.position - lowest.position) / slice)
                  : Eigen::Vector3d(step * normal_of(lowest));
    stack.grid = grid_of(lowest, static_cast<int>(slice) + 1, step_vector, where);
    return stack;
}

}  // namespace livetet::dicom
