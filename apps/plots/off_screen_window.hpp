#pragma once

#include <vtkColorTransferFunction.h>
#include <vtkRenderWindow.h>
#include <vtkSmartPointer.h>
#include <vtkTextProperty.h>

#include <array>
#include <filesystem>

namespace livetet {

/// The look that all pictures share.
namespace look {
inline constexpr int width = 1600, height = 900;
using Colour = std::array<double, 3>;
inline constexpr Colour ink{0.13, 0.13, 0.16}, paper{1, 1, 1};
inline constexpr Colour blue{0.12, 0.42, 0.72}, red{0.80, 0.18, 0.16}, grey{0.55, 0.55, 0.58};
inline constexpr int title_size = 30, label_size = 24, tick_size = 20;
}  // namespace look

/// Sets font, size and the colour of ink.
void set_text(vtkTextProperty* text, int size, bool bold = false);

/// From pale at 0 to dark at `largest` (ColorBrewer's YlGnBu without its palest), for any light.
vtkSmartPointer<vtkColorTransferFunction> organ_colours(double largest);

/// VTK's messages go to the log from here on.
void route_messages();

/// An off-screen window of the common size, anti-aliased.
vtkSmartPointer<vtkRenderWindow> make_window();

/// Renders and writes a PNG file, whole or not at all. Throws Error where it cannot be written.
void write_window(vtkRenderWindow* window, const std::filesystem::path& path);

}  // namespace livetet
