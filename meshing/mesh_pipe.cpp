#include "meshing/mesh_pipe.hpp"

#include <algorithm>
#include <cstring>

#include "base/error.hpp"

namespace livetet {

namespace {

static_assert(sizeof(Vector3) == 3 * sizeof(double) && sizeof(Tet) == 4 * sizeof(std::int32_t));

struct Header {
    std::uint64_t nodes, tets, regions;
};

}  // namespace

bool write_mesh(int descriptor, const TetMesh& mesh) {
    const Header header{mesh.nodes.size(), mesh.tets.size(), mesh.regions.size()};
    const bool written = write_all(descriptor, &header, sizeof header) &&
                         write_all(descriptor, mesh.nodes.data(), mesh.nodes.size() * sizeof(Vector3)) &&
                         write_all(descriptor, mesh.tets.data(), mesh.tets.size() * sizeof(Tet)) &&
                         write_all(descriptor, mesh.regions.data(), mesh.regions.size() * sizeof(std::int32_t));
    if (!written) std::fprintf(stderr, "Error   : the temporary folder is full\n");
    return written;
}

TetMesh read_mesh(const std::vector<char>& bytes, const std::string& who) {
    Header header{};
    if (bytes.size() >= sizeof header) std::memcpy(&header, bytes.data(), sizeof header);
    const std::size_t expected = sizeof header + header.nodes * sizeof(Vector3) + header.tets * sizeof(Tet) +
                                 header.regions * sizeof(std::int32_t);
    if (bytes.size() < sizeof header || bytes.size() != expected)
        fail("{}: its result has {} bytes, expected {}", who, bytes.size(), expected);
    TetMesh mesh;
    mesh.nodes.resize(header.nodes);
    mesh.tets.resize(header.tets);
    mesh.regions.resize(header.regions);
    const char* at = bytes.data() + sizeof header;
    const auto take = [&](void* to, std::size_t count) {
        if (count > 0) std::memcpy(to, at, count);
        at += count;
    };
    take(mesh.nodes.data(), header.nodes * sizeof(Vector3));
    take(mesh.tets.data(), header.tets * sizeof(Tet));
    take(mesh.regions.data(), header.regions * sizeof(std::int32_t));
    return mesh;
}

std::string last_words(const std::string& log) {
    std::vector<std::string> lines, errors;
    for (std::size_t from = 0; from < log.size();) {
        const std::size_t to = std::min(log.find('\n', from), log.size());
        const std::string line = log.substr(from, to - from);
        if (!line.empty()) lines.push_back(line);
        if (line.find("Error") != std::string::npos) errors.push_back(line.substr(line.find("Error")));
        from = to + 1;
    }
    const std::vector<std::string>& from = errors.empty() ? lines : errors;
    std::string words;
    for (std::size_t i = from.size() > 3 ? from.size() - 3 : 0; i < from.size(); ++i)
        words += (words.empty() ? "" : "; ") + from[i];
    return words.empty() ? "it said nothing" : words;
}

std::string end_text(const ChildResult& child, double time_limit_s) {
    switch (child.end) {
        case ChildResult::End::timed_out:
            return fmt::format("did not end within {:.1f} s and was killed", time_limit_s);
        case ChildResult::End::crashed:
            return fmt::format("crashed (signal {})", child.detail);
        case ChildResult::End::failed:
        case ChildResult::End::returned:
            break;
    }
    return "failed: " + last_words(child.log);
}

}  // namespace livetet
