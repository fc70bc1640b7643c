#include "house/includes.hpp"

#include <algorithm>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace livetet::house {
namespace {

struct Include {
    std::string target;
    bool quoted;
};

std::vector<Include> includes(const std::string& text) {
    static const std::regex line(R"(^\s*#\s*include\s*(["<])([^">]+))");
    std::vector<Include> found;
    std::istringstream stream(text);
    for (std::string one; std::getline(stream, one);) {
        std::smatch match;
        if (one.find("include") != one.npos && std::regex_search(one, match, line)) {
            found.push_back({match[2], match[1] == "\""});
        }
    }
    return found;
}

/// Path from the root of what a file includes as `target`.
std::string path_of(const std::string& target) {
    for (const auto* top : {"apps/", "io/", "meshing/", "solvers/"}) {
        if (target.starts_with(top)) {
            return target;
        }
    }
    return "src/" + target;
}

/// The top folder of what a test, an example or a benchmark includes as `target`; empty: a file
/// beside it.
std::string top_of(const std::string& target) {
    const auto slash = target.find('/');
    if (slash == target.npos) return {};
    const auto first = target.substr(0, slash);
    for (const auto* top :
         {"apps", "io", "meshing", "solvers", "support", "fuzz", "house", "livetet"}) {
        if (first == top) {
            return first;
        }
    }
    return "src";
}

/// The folder with an arrow of its own that a file is in: src/mesh, io/openigtlink, io.
std::string folder_of(const std::string& path) {
    const auto first = path.find('/');
    const auto second = path.find('/', first + 1);
    return path.substr(0, second == path.npos ? first : second);
}

}  // namespace

Arrows arrows(const std::string& apps_cmake) {
    Arrows arrows{
        {"src/base", {}},
        {"src/config", {"src/base"}},
        {"src/geometry", {"src/base"}},
        {"src/mesh", {"src/base", "src/geometry"}},
        {"src/image", {"src/base", "src/geometry", "src/mesh"}},
        {"src/mechanics", {"src/base", "src/config", "src/geometry", "src/mesh"}},
        {"src/tracking", {"src/base", "src/config", "src/geometry", "src/mesh"}},
    };
    std::set<std::string> below;
    for (const auto& [folder, _] : arrows) {
        below.insert(folder);
    }
    std::set<std::string> solvers;
    for (const auto* folder : {"parallel", "assembly", "linear", "nonlinear", "inverse"}) {
        const auto name = std::string("solvers/") + folder;
        arrows[name] = below;
        arrows[name].insert(solvers.begin(), solvers.end());
        solvers.insert(name);
    }
    for (const auto* folder : {"meshing", "io/openigtlink", "io"}) {
        arrows[folder] = below;
    }
    arrows["io"].insert("io/openigtlink");
    below.insert(solvers.begin(), solvers.end());
    below.insert({"meshing", "io", "io/openigtlink"});

    static const std::regex library(R"(livetet_apps(?:_images|_python)?_library\((\w+)([^)]*)\))");
    static const std::regex word(R"(\w+)");
    for (std::sregex_iterator match(apps_cmake.begin(), apps_cmake.end(), library), end;
         match != end; ++match) {
        const auto name = "apps/" + (*match)[1].str();
        const auto arguments = (*match)[2].str();
        auto allowed = below;
        if (name == "apps/folder") {  // the functions' own definitions
            continue;
        }
        std::vector<std::string> links;
        if (const auto at = arguments.find("LINKS"); at != arguments.npos) {
            for (std::sregex_iterator link(arguments.begin() + at + 5, arguments.end(), word);
                 link != end; ++link) {
                links.push_back("apps/" + link->str());
            }
        }
        if (name == "apps/bench" && arrows.contains("apps/viewer")) {
            links.push_back("apps/viewer");  // linked in a build with images only
        }
        for (const auto& link : links) {
            if (!arrows.contains(link)) {
                throw std::runtime_error(name + " links " + link + ", which is not before it");
            }
            allowed.insert(link);
            allowed.insert(arrows[link].begin(), arrows[link].end());
        }
        arrows[name] = allowed;
    }
    for (auto& [folder, allowed] : arrows) {
        allowed.insert(folder);
    }
    return arrows;
}

std::vector<std::string> wrong_includes(const SourceFiles& files, const Arrows& arrows) {
    std::vector<std::string> wrong;
    for (const auto& [file, text] : files) {
        const auto allowed = arrows.find(folder_of(file));
        if (allowed == arrows.end()) {
            wrong.push_back(file + ": its folder has no arrows");
            continue;
        }
        for (const auto& [target, quoted] : includes(text)) {
            if (quoted && !allowed->second.contains(folder_of(path_of(target)))) {
                wrong.push_back(file + ": includes " + target);
            }
            const bool petsc =
                target.starts_with("petsc") || target == "mpi.h" || target == "base/petsc.hpp";
            const bool knows_it = file == "src/base/petsc.hpp" || file == "src/base/together.hpp";
            if (petsc && file.starts_with("src/") && !knows_it) {
                wrong.push_back(file + ": includes " + target + " (PETSc belongs to solvers)");
            }
        }
    }
    return wrong;
}

std::vector<std::string> wrong_includes_of_users(const SourceFiles& files) {
    const std::map<std::string, std::set<std::string>> allowed{
        {"tests/src", {"src", "support"}},
        {"tests/support", {"src", "solvers", "support"}},
        {"tests/io", {"src", "io", "support"}},
        {"tests/interop", {"src", "io", "support"}},
        {"tests/meshing", {"src", "meshing", "support"}},
        {"tests/solvers", {"src", "solvers", "meshing", "support"}},
        {"tests/apps", {"src", "io", "meshing", "solvers", "apps", "support"}},
        {"tests/fuzz", {"src", "io", "meshing", "solvers", "apps", "support", "fuzz"}},
        {"tests/house", {"house"}},
        {"benchmarks", {"src", "solvers", "apps", "support"}},
        {"examples", {"livetet"}},
    };
    std::vector<std::string> wrong;
    for (const auto& [file, text] : files) {
        const auto top = file.substr(0, file.find('/'));
        const auto tops = allowed.find(top == "tests" ? folder_of(file) : top);
        if (tops == allowed.end()) {
            wrong.push_back(file + ": its folder has no arrows");
            continue;
        }
        for (const auto& [target, quoted] : includes(text)) {
            const auto of_target = top_of(target);
            if (quoted && !of_target.empty() && !tops->second.contains(of_target)) {
                wrong.push_back(file + ": includes " + target);
            }
        }
    }
    return wrong;
}

std::vector<std::string> include_circles(const SourceFiles& files) {
    enum class Mark { unseen, open, done };
    std::map<std::string, Mark> marks;
    std::vector<std::string> way, circles;
    const auto visit = [&](const auto& self, const std::string& file) -> void {
        if (marks[file] == Mark::open) {
            std::string circle;
            for (auto at = std::find(way.begin(), way.end(), file); at != way.end(); ++at) {
                circle += *at + " -> ";
            }
            circles.push_back(circle + file);
        }
        if (marks[file] != Mark::unseen || !files.contains(file)) {
            return;
        }
        marks[file] = Mark::open;
        way.push_back(file);
        for (const auto& [target, quoted] : includes(files.at(file))) {
            if (quoted) {
                self(self, path_of(target));
            }
        }
        way.pop_back();
        marks[file] = Mark::done;
    };
    for (const auto& [file, _] : files) {
        visit(visit, file);
    }
    return circles;
}

}  // namespace livetet::house
