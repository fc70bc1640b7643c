#include "apps/bench/figure_option.hpp"

#ifdef LIVETET_IMAGES
#include "apps/plots/virtual_display.hpp"
#endif

namespace livetet {

#ifdef LIVETET_IMAGES
void add_figure_option(CLI::App& command, const std::string& name, std::filesystem::path& figure,
                       const std::string& text) {
    command.add_option(name, figure, text);
}

void check_display(const std::filesystem::path& figure) {
    if (!figure.empty()) need_display(figure.string());
}
#else
void add_figure_option(CLI::App&, const std::string&, std::filesystem::path&, const std::string&) {}

void check_display(const std::filesystem::path&) {}
#endif

}  // namespace livetet
