#include "io/vtu_file.hpp"

#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkCellTypes.h>
#include <vtkDataArray.h>
#include <vtkGenericCell.h>
#include <vtkUnstructuredGrid.h>
#include <vtkUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>

#include "base/file.hpp"
#include "io/parse_in_child.hpp"
#include "io/vtk_reader.hpp"
#include "mesh/mesh_of_hexahedra.hpp"
#include "mesh/packed_mesh.hpp"
#include "mesh/quadratic_hexahedra.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

bool is_box(int type) {
    return type == VTK_HEXAHEDRON || type == VTK_VOXEL || type == VTK_QUADRATIC_HEXAHEDRON ||
           type == VTK_TRIQUADRATIC_HEXAHEDRON;
}

/// Where each of a VTK cell's nodes stands in a cell of ours, by its place in VTK's own.
std::vector<int> places_of_nodes(int type) {
    vtkNew<vtkGenericCell> cell;
    cell->SetCellType(type);
    std::vector<int> places;
    const double* at = cell->GetParametricCoords();
    for (vtkIdType i = 0; i < cell->GetNumberOfPoints(); ++i, at += 3)
        places.push_back(quadratic_place(static_cast<int>(std::lround(2 * at[0])),
                                         static_cast<int>(std::lround(2 * at[1])),
                                         static_cast<int>(std::lround(2 * at[2]))));
    return places;
}

/// Returns whether all volume cells are hexahedra. Throws Error if they are neither these nor all
/// tets.
bool has_hexahedra_alone(vtkUnstructuredGrid* grid, const std::string& where) {
    std::map<int, vtkIdType> counts;
    for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) ++counts[grid->GetCellType(c)];
    const bool has_tets = counts.contains(VTK_TETRA);
    bool has_boxes = false;
    std::string others;
    vtkNew<vtkGenericCell> cell;
    for (const auto& [type, count] : counts) {
        if (type == VTK_TETRA || type == VTK_EMPTY_CELL) continue;
        if (is_box(type) && !has_tets) {
            has_boxes = true;
            continue;
        }
        cell->SetCellType(type);
        if (cell->GetCellDimension() == 3 || cell->GetCellType() != type)
            others += fmt::format("{}{} {}", others.empty() ? "" : ", ", count,
                                  vtkCellTypes::GetClassNameFromTypeId(type));
    }
    if (others.empty()) return has_boxes;
    const bool quadratic = counts.contains(VTK_QUADRATIC_TETRA);
    fail(
        "{}: holds {} beside {} vtkTetra, expected four-node tetrahedra alone, or hexahedra "
        "alone{}",
        where, others, counts.contains(VTK_TETRA) ? counts.at(VTK_TETRA) : 0,
        quadratic
            ? " (export linear tetrahedra; a scene's elements: P2 gives them their middle nodes)"
            : "");
}

vtkDataArray* region_array(vtkCellData* data) {
    for (const char* name : {"region", "regions", "label", "labels", "material", "materials",
                             "gmsh:physical", "medit:ref", "cell_tags", "cellentityids"})
        for (int i = 0; i < data->GetNumberOfArrays(); ++i) {
            const char* own = data->GetArrayName(i);
            if (own && lower(own) == name && data->GetArray(i) &&
                data->GetArray(i)->GetNumberOfComponents() == 1)
                return data->GetArray(i);
        }
    return nullptr;
}

std::int32_t region_of(vtkDataArray* regions, vtkIdType cell, const std::string& where) {
    const double value = regions->GetComponent(cell, 0);
    if (!(std::abs(value) <= std::numeric_limits<std::int32_t>::max() &&
          value == std::floor(value)))
        fail("{}: '{}' of cell {} is {}, expected a whole number", where, regions->GetName(), cell,
             value);
    return static_cast<std::int32_t>(value);
}

/// A file's tets or hexahedra, and their nodes. Tets are not checked.
template <class Reader>
TetMesh parse(const fs::path& path, double metres_per_unit) {
    const std::string where = path.string();
    vtkNew<Reader> reader;
    update_reader(reader.GetPointer(), path);
    vtkUnstructuredGrid* grid = reader->GetOutput();
    check_cells(grid->GetCells(), grid->GetNumberOfPoints(), where);
    const bool are_hexahedra = has_hexahedra_alone(grid, where);
    vtkDataArray* regions = region_array(grid->GetCellData());

    TetMesh mesh;
    std::vector<std::int32_t> numbers(grid->GetNumberOfPoints(), -1);
    const auto number_of = [&](vtkIdType point) {
        std::int32_t& number = numbers[point];
        if (number >= 0) return number;
        number = static_cast<std::int32_t>(mesh.nodes.size());
        mesh.nodes.push_back(metres_per_unit * Vector3(grid->GetPoint(point)));
        return number;
    };
    std::vector<QuadraticHexahedron> boxes;
    std::map<int, std::vector<int>> places;  // by type
    std::vector<std::int32_t> of_cells;
    for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
        const int type = grid->GetCellType(c);
        if (type != VTK_TETRA && !is_box(type)) continue;
        if (is_box(type) && !places.contains(type)) places[type] = places_of_nodes(type);
        const vtkIdType expected =
            type == VTK_TETRA ? 4 : static_cast<vtkIdType>(places[type].size());
        vtkIdType count = 0;
        const vtkIdType* points = nullptr;
        grid->GetCellPoints(c, count, points);
        if (count != expected)
            fail("{}: cell {} has {} points, expected {}", where, c, count, expected);
        if (regions) of_cells.push_back(region_of(regions, c, where));
        if (type == VTK_TETRA) {
            Tet& tet = mesh.tets.emplace_back();
            for (int k = 0; k < 4; ++k) tet[k] = number_of(points[k]);
        } else {
            QuadraticHexahedron& box = boxes.emplace_back();
            box.fill(-1);
            for (vtkIdType k = 0; k < expected; ++k) box[places[type][k]] = number_of(points[k]);
        }
    }
    if (are_hexahedra) return mesh_of_hexahedra(std::move(mesh), std::move(boxes), of_cells, where);
    mesh.regions = std::move(of_cells);
    return mesh;
}

}  // namespace

bool is_legacy_grid(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::string line;
    for (int number = 0; number < 8 && std::getline(in, line); ++number)
        if (const auto words = split_words(line);
            words.size() == 2 && lower(std::string(words[0])) == "dataset")
            return lower(std::string(words[1])) == "unstructured_grid";
    return false;
}

TetMesh read_vtu(const fs::path& path, double metres_per_unit) {
    const std::string where = path.string();
    const std::string end = ending(path);
    if (end != ".vtu" && end != ".vtk")
        fail("{}: the name ends in '{}', expected a VTK unstructured grid: .vtu or .vtk", where,
             end);
    check_is_file(path);
    const auto parsed = [&] {
        return packed(end == ".vtk" ? parse<vtkUnstructuredGridReader>(path, metres_per_unit)
                                    : parse<vtkXMLUnstructuredGridReader>(path, metres_per_unit));
    };
    TetMesh mesh = unpacked_mesh(parse_in_child(path, "VTK", parsed), where);
    divide_hexahedra(mesh, where);
    check_tet_mesh(mesh, where);
    return mesh;
}

}  // namespace livetet
