#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace livetet {

enum class FieldPlace { node, tet };

/// A field in a table of an HDF5 file: `components` (1, 3 or 9) numbers of so many bytes for each
/// node or tet.
struct XdmfField {
    std::string name, table;
    FieldPlace place = FieldPlace::node;
    int components = 1;
    int bytes = 8;
};

/// A mesh as write_mesh stores it, at one time or of one number, with its fields.
struct XdmfFrame {
    double time = 0;
    std::string group;  ///< of the mesh
    std::size_t nodes = 0, tets = 0;
    bool quadratic = false, regions = false;
    std::vector<XdmfField> fields;
};

/// What ParaView opens beside the HDF5 file of that name (no folder): frames in a temporal
/// collection.
std::string xdmf_text(const std::string& h5_name, const std::vector<XdmfFrame>& frames);

}  // namespace livetet
