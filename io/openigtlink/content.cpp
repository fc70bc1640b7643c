#include "io/openigtlink/content.hpp"

#include <cmath>

#include "io/openigtlink/fields.hpp"

namespace livetet::igtl {

namespace {

// Contents whose reading and writing differ.

void fields(ByteReader& in, Position& x) {
    using enum Position::Layout;
    if (in.left() != 12 && in.left() != 24 && in.left() != 28)
        fail("{}: {} bytes, expected 28, 24 or 12", in.what(), in.left());
    x.layout = in.left() == 28 ? whole : in.left() == 24 ? without_w : without_rotation;
    in(x.position);
    auto& [qx, qy, qz, w] = x.quaternion;
    if (x.layout == whole) return in(x.quaternion);
    if (x.layout == without_rotation) return;
    in(qx);
    in(qy);
    in(qz);
    w = std::sqrt(std::max(0.0f, 1 - qx * qx - qy * qy - qz * qz));
}

void fields(ByteWriter& out, const Position& x) {
    out(x.position);
    const int numbers = x.layout == Position::Layout::whole       ? 4
                        : x.layout == Position::Layout::without_w ? 3
                                                                  : 0;
    for (int i = 0; i < numbers; ++i) out(x.quaternion[i]);
}

void fields(ByteReader& in, Status& x) {
    in(x.code);
    in(x.subcode);
    in.name(x.error_name, 20);
    in.text(x.text, in.left());
    if (x.text.ends_with('\0')) x.text.pop_back();
}

void fields(ByteWriter& out, const Status& x) {
    out(x.code);
    out(x.subcode);
    out.name(x.error_name, 20);
    out.text(x.text, x.text.size());
    out.unused(1);
}

void fields(ByteReader& in, Sensor& x) {
    const auto count = in.number<std::uint8_t>();
    in(x.status);
    in(x.unit);
    in.numbers(x.values, count);
}

void fields(ByteWriter& out, const Sensor& x) {
    out.count<std::uint8_t>(x.values.size());
    out(x.status);
    out(x.unit);
    out.numbers(x.values, x.values.size());
}

/// Calls f with a value of the scalar's C++ type; for complex scalars the type of their parts.
template <class F>
void with_scalar(ScalarType type, const std::string& what, F&& f) {
    switch (type) {
        case 2:
            return f(std::int8_t());
        case 3:
            return f(std::uint8_t());
        case 4:
            return f(std::int16_t());
        case 5:
            return f(std::uint16_t());
        case 6:
            return f(std::int32_t());
        case 7:
            return f(std::uint32_t());
        case 10:
            return f(float());
        case 11:
        case 13:
            return f(double());
        default:
            known_scalar_size(type, what);
    }
}

/// Number of values in an array of this shape. Throws Error if they exceed `max_body_size`.
std::uint64_t number_count(const NdArray& x, const std::string& what) {
    std::uint64_t count = x.scalar == 13 ? 2 : 1;
    for (const std::uint16_t n : x.size) {
        count *= n;
        if (count > std::uint64_t(1) << 32) fail("{}: an array of more than 2^32 values", what);
    }
    return x.size.empty() ? 0 : count;
}

void fields(ByteReader& in, NdArray& x) {
    in(x.scalar);
    in.numbers(x.size, in.number<std::uint8_t>());
    const std::uint64_t count = number_count(x, in.what());
    with_scalar(x.scalar, in.what(), [&]<class Scalar>(Scalar) {
        std::vector<Scalar> values;
        in.numbers(values, count);
        x.values.assign(values.begin(), values.end());
    });
}

void fields(ByteWriter& out, const NdArray& x) {
    out(x.scalar);
    out.count<std::uint8_t>(x.size.size());
    out.numbers(x.size, x.size.size());
    if (x.values.size() != number_count(x, out.what()))
        fail("{}: {} values, expected {}", out.what(), x.values.size(),
             number_count(x, out.what()));
    with_scalar(x.scalar, out.what(), [&]<class Scalar>(Scalar) {
        for (const double value : x.values) out(static_cast<Scalar>(value));
    });
}

void read_cells(ByteReader& in, Cells& cells, std::uint32_t bytes, std::size_t points) {
    if (bytes % 4 != 0) fail("{}: {} bytes of cells, expected a multiple of 4", in.what(), bytes);
    in.numbers(cells.list, bytes / 4);
    std::size_t at = 0, count = 0;
    for (; at < cells.list.size(); ++count) {
        const std::size_t nodes = cells.list[at++];
        if (nodes > cells.list.size() - at)
            fail("{}: a cell of {} points, expected at most {}", in.what(), nodes,
                 cells.list.size() - at);
        for (const std::size_t end = at + nodes; at < end; ++at)
            if (cells.list[at] >= points)
                fail("{}: point {}, expected less than {}", in.what(), cells.list[at], points);
    }
    if (count != cells.count) fail("{}: {} cells, expected {}", in.what(), count, cells.count);
}

/// The name table: each name ends with a NUL, and the table has an even length.
std::size_t padding_of(std::size_t size) { return size % 2; }

std::string read_ended_name(ByteReader& in) {
    std::string name;
    for (;;) {
        const auto c = in.number<std::uint8_t>();
        if (c == 0) return name;
        name.push_back(static_cast<char>(c));
    }
}

void fields(ByteReader& in, PolyData& x) {
    const auto points = in.number<std::uint32_t>();
    std::array<std::uint32_t, 4> bytes;
    const std::array<Cells*, 4> cells{&x.vertices, &x.lines, &x.polygons, &x.strips};
    for (int i = 0; i < 4; ++i) {
        in(cells[i]->count);
        in(bytes[i]);
    }
    const auto attributes = in.number<std::uint32_t>();
    in.numbers(x.points, points);
    for (int i = 0; i < 4; ++i) read_cells(in, *cells[i], bytes[i], points);

    std::vector<std::uint32_t> counts;
    for (std::uint32_t i = 0; i < attributes; ++i) {
        Attribute& a = x.attributes.emplace_back();
        in(a.kind);
        in(a.components);
        counts.push_back(in.number<std::uint32_t>());
        if (a.components == 0)
            fail("{}: an attribute of 0 components, expected at least 1", in.what());
    }
    std::size_t names = 0;
    for (Attribute& a : x.attributes) {
        a.name = read_ended_name(in);
        names += a.name.size() + 1;
    }
    in.unused(padding_of(names));
    for (std::size_t i = 0; i < counts.size(); ++i)
        in.numbers(x.attributes[i].values, std::uint64_t(counts[i]) * x.attributes[i].components);
}

void fields(ByteWriter& out, const PolyData& x) {
    out.count<std::uint32_t>(x.points.size());
    const std::array<const Cells*, 4> cells{&x.vertices, &x.lines, &x.polygons, &x.strips};
    for (const Cells* c : cells) {
        out(c->count);
        out.count<std::uint32_t>(4 * c->list.size());
    }
    out.count<std::uint32_t>(x.attributes.size());
    out.numbers(x.points, x.points.size());
    for (const Cells* c : cells) out.numbers(c->list, c->list.size());
    for (const Attribute& a : x.attributes) {
        if (a.components == 0 || a.values.size() % a.components != 0)
            fail("{}: {} has {} values of {} components", out.what(), a.name, a.values.size(),
                 a.components);
        out(a.kind);
        out(a.components);
        out.count<std::uint32_t>(a.values.size() / a.components);
    }
    std::size_t names = 0;
    for (const Attribute& a : x.attributes) {
        out.name(a.name, a.name.size() + 1);
        names += a.name.size() + 1;
    }
    out.unused(padding_of(names));
    for (const Attribute& a : x.attributes) out.numbers(a.values, a.values.size());
}

/// The device names of `count` messages, preceded by the size of the name table in bytes.
std::vector<std::string> read_names(ByteReader& in, std::size_t count) {
    ByteReader table(in.take(in.number<std::uint16_t>()), in.what() + ", names");
    std::vector<std::string> names;
    for (std::size_t i = 0; i < count; ++i) names.push_back(read_ended_name(table));
    if (table.left() > 1) table.end();  // one byte of padding is allowed
    return names;
}

/// `name_of(i)` returns the i-th of `count` names.
template <class F>
void write_names(ByteWriter& out, std::size_t count, F&& name_of) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < count; ++i) size += name_of(i).size() + 1;
    out.count<std::uint16_t>(size + padding_of(size));
    for (std::size_t i = 0; i < count; ++i) out.name(name_of(i), name_of(i).size() + 1);
    out.unused(padding_of(size));
}

void fields(ByteReader& in, Bind& x) {
    const auto count = in.number<std::uint16_t>();
    std::vector<std::uint64_t> sizes;
    for (int i = 0; i < count; ++i) {
        in.name(x.messages.emplace_back().type, 12);
        sizes.push_back(in.number<std::uint64_t>());
    }
    const std::vector<std::string> names = read_names(in, count);
    for (int i = 0; i < count; ++i) {
        x.messages[i].device = names[i];
        in.bytes(x.messages[i].content, sizes[i]);
        // Some senders omit the padding after the last one.
        if (in.left() > 0) in.unused(padding_of(sizes[i]));
    }
}

void fields(ByteWriter& out, const Bind& x) {
    out.count<std::uint16_t>(x.messages.size());
    for (const BoundMessage& m : x.messages) {
        out.name(m.type, 12);
        out(static_cast<std::uint64_t>(m.content.size()));
    }
    write_names(out, x.messages.size(),
                [&](std::size_t i) -> const std::string& { return x.messages[i].device; });
    for (const BoundMessage& m : x.messages) {
        out.bytes(m.content, m.content.size());
        out.unused(padding_of(m.content.size()));
    }
}

void read_query(ByteReader& in, BindQuery& x) {
    if (in.left() == 0) return;
    x.types_and_devices.resize(in.number<std::uint16_t>());
    for (auto& [type, device] : x.types_and_devices) in.name(type, 12);
    const std::vector<std::string> names = read_names(in, x.types_and_devices.size());
    for (std::size_t i = 0; i < names.size(); ++i) x.types_and_devices[i].second = names[i];
}

void fields(ByteReader& in, BindQuery& x) {
    if (in.what() == "STT_BIND") in(x.resolution);
    read_query(in, x);
}

void fields(ByteWriter& out, const BindQuery& x) {
    if (out.what() == "STT_BIND") out(x.resolution);
    if (x.types_and_devices.empty()) return;
    out.count<std::uint16_t>(x.types_and_devices.size());
    for (const auto& [type, device] : x.types_and_devices) out.name(type, 12);
    write_names(out, x.types_and_devices.size(),
                [&](std::size_t i) -> const std::string& { return x.types_and_devices[i].second; });
}

std::optional<Content> blank_query(std::string_view prefix, std::string_view type) {
    if (prefix == "RTS_") return type == "COMMAND" ? Content(Command()) : Content(Reply());
    if (prefix == "STT_" && (type == "TDATA" || type == "QTDATA")) return StartTracking();
    if (type == "BIND" && prefix != "STP_") return BindQuery();
    return Raw();
}

}  // namespace

std::optional<Content> blank_content(std::string_view type) {
    for (const std::string_view prefix : {"GET_", "STT_", "STP_", "RTS_"})
        if (type.starts_with(prefix) && type.size() > prefix.size())
            return blank_query(prefix, type.substr(prefix.size()));
    static const std::vector<std::pair<std::string_view, Content>> types{
        {"TRANSFORM", Transform()},
        {"POSITION", Position()},
        {"QTRANS", Position()},
        {"TDATA", TrackingData()},
        {"QTDATA", QuaternionTrackingData()},
        {"STATUS", Status()},
        {"STRING", String()},
        {"POINT", Points()},
        {"TRAJ", Trajectories()},
        {"POLYDATA", PolyData()},
        {"IMAGE", Image()},
        {"IMGMETA", ImageList()},
        {"LBMETA", LabelList()},
        {"VIDEOMETA", VideoList()},
        {"COLORT", ColorTable()},
        {"CAPABILITY", Capability()},
        {"COMMAND", Command()},
        {"SENSOR", Sensor()},
        {"NDARRAY", NdArray()},
        {"BIND", Bind()}};
    for (const auto& [name, content] : types)
        if (name == type) return content;
    return std::nullopt;
}

Content decode_content(std::string_view type, ByteView bytes) {
    std::optional<Content> content = blank_content(type);
    if (!content) fail("{}: a type of message that is not known", type);
    ByteReader in(bytes, type);
    std::visit([&](auto& x) { fields(in, x); }, *content);
    in.end();
    return std::move(*content);
}

Bytes encode_content(std::string_view type, const Content& content) {
    const std::optional<Content> expected = blank_content(type);
    if (!expected || expected->index() != content.index())
        fail("{}: the content is not that of a message of this type", type);
    ByteWriter out(type);
    std::visit([&](const auto& x) { fields(out, x); }, content);
    return out.take();
}

}  // namespace livetet::igtl
