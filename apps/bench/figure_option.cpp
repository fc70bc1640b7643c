#include "apps/bench/figure_option.hpp"

#ifdef LIVETET_IMAGES
#include "apps/plots/virtual_display.hpp"
#endif

#include "base/file.hpp"

namespace livetet {

void check_output_files(std::initializer_list<std::filesystem::path> files) {
    for (const std::filesystem::path& file : files)
        if (!file.empty()) expect_writable(file);
}

#ifdef LIVETET_IMAGES
void add_figure_option(CLI::App& command, const std::string& name, std::filesystem::path& figure,
                       const std::string& text) {
    command.add_option(name, figure, text);
}

void check_figures(std::initializer_list<std::filesystem::path> figures) {
    check_output_files(figures);
    for (const std::filesystem::path& figure : figures)
        if (!figure.empty()) need_display(figure.string());
}
#else
void add_figure_option(CLI::App&, const std::string&, std::filesystem::path&, const std::string&) {}

void check_figures(std::initializer_list<std::filesystem::path>) {}
#endif

}  // namespace livetet
