#include "io/xdmf.hpp"

#include <fmt/format.h>

namespace livetet {

namespace {

std::string xml_text(const std::string& text) {
    std::string escaped;
    for (const char c : text)
        escaped += c == '&'   ? "&amp;"
                   : c == '<' ? "&lt;"
                   : c == '>' ? "&gt;"
                   : c == '"' ? "&quot;"
                              : std::string(1, c);
    return escaped;
}

}  // namespace

std::string xdmf_text(const std::string& h5_name, const std::vector<XdmfFrame>& frames) {
    const std::string h5 = xml_text(h5_name);
    const auto item = [&](const std::string& table, const char* type, int bytes, std::size_t rows,
                          int columns) {
        return fmt::format(R"(<DataItem Format="HDF" NumberType="{}" Precision="{}" )"
                           R"(Dimensions="{} {}">{}:/{}</DataItem>)",
                           type, bytes, rows, columns, h5, table);
    };
    std::string text =
        "<?xml version=\"1.0\" ?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" []>\n<Xdmf "
        "Version=\"2.0\">\n<Domain>\n"
        "<Grid Name=\"result\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const XdmfFrame& f = frames[k];
        text += fmt::format("<Grid Name=\"frame{}\" GridType=\"Uniform\">\n<Time Value=\"{}\"/>\n",
                            k, f.time);
        text += fmt::format("<Topology TopologyType=\"{}\" NumberOfElements=\"{}\">{}</Topology>\n",
                            f.hexahedra   ? "Hexahedron"
                            : f.quadratic ? "Tetrahedron_10"
                                          : "Tetrahedron",
                            f.tets,
                            item(f.group + (f.hexahedra   ? "/hexahedra"
                                            : f.quadratic ? "/ten_node_tets"
                                                          : "/tets"),
                                 "Int", 4, f.tets,
                                 f.hexahedra   ? 8
                                 : f.quadratic ? 10
                                               : 4));
        text += fmt::format("<Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                            item(f.group + "/nodes", "Float", 8, f.nodes, 3));
        const auto attribute = [&](const XdmfField& a, const char* type) {
            text += fmt::format(
                "<Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">{}</Attribute>\n",
                xml_text(a.name),
                a.components == 1   ? "Scalar"
                : a.components == 3 ? "Vector"
                                    : "Tensor",
                a.place == FieldPlace::node ? "Node" : "Cell",
                item(a.table, type, a.bytes, a.place == FieldPlace::node ? f.nodes : f.tets,
                     a.components));
        };
        for (const XdmfField& a : f.fields) attribute(a, "Float");
        if (f.regions) attribute({"region", f.group + "/regions", FieldPlace::tet, 1, 4}, "Int");
        text += "</Grid>\n";
    }
    return text + "</Grid>\n</Domain>\n</Xdmf>\n";
}

}  // namespace livetet
