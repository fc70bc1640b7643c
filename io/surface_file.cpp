#include "io/surface_file.hpp"

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPLYWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#include <vtkPolyDataWriter.h>
#include <vtkSTLReader.h>
#include <vtkSTLWriter.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/packing.hpp"
#include "io/parse_in_child.hpp"
#include "io/ply_check.hpp"
#include "io/text.hpp"
#include "io/vtk_reader.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// Converts between RAS and LPS, in both directions.
Vector3 turned(const Vector3& x, Space space) {
    return space == Space::lps ? Vector3(-x.x(), -x.y(), x.z()) : x;
}

/// The file's triangles in mm; polygons are already split.
struct Polygons {
    std::vector<Vector3> points;
    std::vector<std::array<vtkIdType, 3>> triangles;
};

std::vector<char> packed(const Polygons& polygons) {
    Packer packer;
    packer.add(polygons.points);
    packer.add(polygons.triangles);
    return packer.take_bytes();
}

/// Runs in the child process.
template <class Reader>
Polygons parse(const fs::path& path) {
    vtkNew<Reader> reader;
    update_reader(reader.GetPointer(), path);
    for (vtkCellArray* cells : {reader->GetOutput()->GetPolys(), reader->GetOutput()->GetStrips()})
        check_cells(cells, reader->GetOutput()->GetNumberOfPoints(),
                    path.string());  // vtkTriangleFilter does not check
    vtkNew<vtkTriangleFilter> triangulate;
    triangulate->SetInputConnection(reader->GetOutputPort());
    triangulate->PassLinesOff();
    triangulate->PassVertsOff();
    triangulate->Update();
    vtkPolyData* data = triangulate->GetOutput();
    Polygons polygons;
    for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
        polygons.points.emplace_back(data->GetPoint(n));
    vtkCellArray* cells = data->GetPolys();
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    for (cells->InitTraversal(); cells->GetNextCell(count, ids);)
        polygons.triangles.push_back({ids[0], ids[1], ids[2]});
    return polygons;
}

template <class Reader>
Polygons read_with(const fs::path& path) {
    const std::vector<char> bytes =
        parse_in_child(path, "VTK", [&] { return packed(parse<Reader>(path)); });
    Unpacker unpacker(bytes, path.string());
    Polygons polygons{unpacker.take<Vector3>(), unpacker.take<std::array<vtkIdType, 3>>()};
    unpacker.finish();
    for (const auto& triangle : polygons.triangles)
        for (const vtkIdType n : triangle)
            if (n < 0 || n >= std::ssize(polygons.points))
                fail("{}: VTK made a triangle of point {} of {}", path.string(), n,
                     polygons.points.size());
    return polygons;
}

/// The numbers of an OFF file in sequence, without comments.
class OffWords {
  public:
    explicit OffWords(const fs::path& path) : where_(path.string()), text_(read_text_file(path)) {
        for (const auto line : split_lines(text_))
            for (const auto word : split_words(line.substr(0, line.find('#'))))
                words_.push_back(word);
        if (words_.empty() || words_[0] != "OFF") fail("{}: does not begin with OFF", where_);
    }
    double number(const char* what) {
        if (at_ >= words_.size()) fail("{}: ends where {} was expected: truncated", where_, what);
        const auto value = parse_number(words_[at_]);
        if (!value) fail("{}: found '{}', expected {}", where_, words_[at_].substr(0, 40), what);
        ++at_;
        return *value;
    }
    std::size_t index(const char* what, std::size_t end) {
        const double value = number(what);
        if (!(value >= 0 && value < static_cast<double>(end) && value == std::floor(value)))
            fail("{}: found {}, expected {} below {}", where_, value, what, end);
        return static_cast<std::size_t>(value);
    }

  private:
    std::string where_, text_;
    std::vector<std::string_view> words_;
    std::size_t at_ = 1;
};

Polygons read_off(const fs::path& path) {
    OffWords words(path);
    Polygons polygons;
    constexpr std::size_t max_count = 1u << 30;
    const std::size_t points = words.index("the number of points", max_count);
    const std::size_t faces = words.index("the number of faces", max_count);
    words.index("the number of edges", max_count);
    for (std::size_t n = 0; n < points; ++n) {
        Vector3 x;
        for (int i = 0; i < 3; ++i) x[i] = words.number("a coordinate");
        polygons.points.push_back(x);
    }
    for (std::size_t f = 0; f < faces; ++f) {
        const std::size_t corners = words.index("a face's number of corners", 1000);
        std::vector<vtkIdType> face;
        for (std::size_t k = 0; k < corners; ++k)
            face.push_back(static_cast<vtkIdType>(words.index("a point's number", points)));
        for (std::size_t k = 2; k < corners; ++k)
            polygons.triangles.push_back({face[0], face[k - 1], face[k]});
    }
    return polygons;
}

/// Checks the triangle count of a binary STL file, because VTK's reader accepts truncated files.
void check_stl_is_whole(const fs::path& path) {
    const std::string text = read_text_file(path);
    if (text.starts_with("solid") && text.find("facet") != std::string::npos) {
        if (text.find("endsolid") == std::string::npos)
            fail("{}: does not end in endsolid: truncated", path.string());
        return;
    }
    if (text.starts_with("solid") && text.size() < 84)
        fail("{}: holds no facet, expected a surface", path.string());
    std::uint32_t triangles = 0;
    if (text.size() >= 84) std::memcpy(&triangles, text.data() + 80, 4);
    if (text.size() < 84 || (text.size() - 84) / 50 < triangles)
        fail("{}: found {} bytes, expected {} for {} triangles: the file is truncated",
             path.string(), text.size(), 84 + 50 * static_cast<std::uint64_t>(triangles),
             triangles);
}

Polygons read_polygons(const fs::path& path) {
    const std::string end = ending(path);
    check_is_file(path);
    if (end == ".off") return read_off(path);
    if (end == ".obj") return read_with<vtkOBJReader>(path);
    if (end == ".ply") {
        check_ply_is_whole(path);
        return read_with<vtkPLYReader>(path);
    }
    if (end == ".vtk") return read_with<vtkPolyDataReader>(path);
    if (end == ".vtp") return read_with<vtkXMLPolyDataReader>(path);
    if (end != ".stl")
        fail("{}: the name ends in '{}', expected a surface: .stl, .obj, .ply, .vtk, .vtp or .off",
             path.string(), end);
    check_stl_is_whole(path);
    return read_with<vtkSTLReader>(path);
}

/// Writes with the VTK writer for the extension.
template <class Writer>
bool write_with(const std::string& path, vtkPolyData* data) {
    vtkNew<Writer> writer;
    const VtkMessages messages(writer.GetPointer());
    writer->SetFileName(path.c_str());
    writer->SetInputData(data);
    writer->SetFileTypeToBinary();
    return writer->Write() == 1 && messages.text().empty();
}

}  // namespace

bool is_surface_name(const fs::path& path) {
    const std::string end = ending(path);
    return end == ".stl" || end == ".obj" || end == ".ply" || end == ".vtk" || end == ".vtp" ||
           end == ".off";
}

TriangleMesh read_surface(const fs::path& path, Space space) {
    const Polygons polygons = read_polygons(path);
    TriangleMesh surface;
    std::map<std::array<double, 3>, std::int32_t> numbers;
    const auto number_of = [&](vtkIdType n) {
        const Vector3& x = polygons.points[n];
        if (!x.allFinite())
            fail("{}: point {} has a coordinate that is not finite", path.string(), n);
        const auto [place, added] =
            numbers.try_emplace({x[0] + 0.0, x[1] + 0.0, x[2] + 0.0},  // adding 0.0 turns -0 into 0
                                static_cast<std::int32_t>(surface.nodes.size()));
        if (added) surface.nodes.push_back(1e-3 * turned(x, space));
        return place->second;
    };
    for (const auto& t : polygons.triangles) {
        const auto& p = polygons.points;
        if (p[t[0]] == p[t[1]] || p[t[1]] == p[t[2]] || p[t[2]] == p[t[0]]) continue;
        surface.triangles.push_back({number_of(t[0]), number_of(t[1]), number_of(t[2])});
    }
    if (surface.triangles.empty())
        fail("{}: holds no triangle of three different corners, expected a surface", path.string());
    return surface;
}

void write_surface(const fs::path& path, const TriangleMesh& surface, Space space) {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (const Vector3& x : surface.nodes)
        points->InsertNextPoint((1e3 * turned(x, space)).eval().data());
    vtkNew<vtkCellArray> cells;
    for (const Triangle& t : surface.triangles) cells->InsertNextCell({t[0], t[1], t[2]});
    vtkNew<vtkPolyData> data;
    data->SetPoints(points);
    data->SetPolys(cells);

    const std::string end = ending(path);
    if (end != ".stl" && end != ".vtk" && end != ".ply")
        fail("{}: the name ends in '{}', expected a surface to write: .stl, .vtk or .ply",
             path.string(), end);
    PendingFile pending(path);
    const std::string place = pending.path().string();
    const bool written = end == ".stl"   ? write_with<vtkSTLWriter>(place, data)
                         : end == ".ply" ? write_with<vtkPLYWriter>(place, data)
                                         : write_with<vtkPolyDataWriter>(place, data);
    if (!written) fail("{}: cannot be written (is the disk full?)", path.string());
    pending.commit();
}

}  // namespace livetet
