#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace livetet {

/// Where the values of a field belong.
enum class FieldPlace { node, tet };

/// A field in an HDF5 table: `components` (1, 3 or 9) numbers of `bytes` bytes for each node or
/// tet.
struct XdmfField {
    std::string name, table;
    FieldPlace place = FieldPlace::node;
    int components = 1;
    int bytes = 8;
};

/// A mesh stored by write_mesh and its fields, at a time or with a sequence number.
struct XdmfFrame {
    double time = 0;
    std::string group;                ///< HDF5 group of the mesh
    std::size_t nodes = 0, tets = 0;  ///< of a grid hexahedra instead of tets
    bool quadratic = false, regions = false;
    std::vector<XdmfField> fields;
    bool hexahedra = false;
};

/// Text of an XDMF file for ParaView, which refers to the HDF5 file `h5_name` in the same folder: a
/// temporal collection of the frames.
std::string xdmf_text(const std::string& h5_name, const std::vector<XdmfFrame>& frames);

}  // namespace livetet
