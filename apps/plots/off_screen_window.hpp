#pragma once

#include <vtkColorTransferFunction.h>
#include <vtkRenderWindow.h>
#include <vtkSmartPointer.h>
#include <vtkTextProperty.h>

#include <array>
#include <filesystem>

namespace livetet {

/// Common style of all pictures.
namespace look {
inline constexpr int width = 1600, height = 900;
using Colour = std::array<double, 3>;
inline constexpr Colour ink{0.13, 0.13, 0.16}, paper{1, 1, 1};
inline constexpr Colour blue{0.12, 0.42, 0.72}, red{0.80, 0.18, 0.16}, grey{0.55, 0.55, 0.58};
inline constexpr int title_size = 30, label_size = 24, tick_size = 20;
}  // namespace look

/// Sets font, size and colour.
enum class TextWeight { regular, bold };
void set_text(vtkTextProperty* text, int size, TextWeight weight = TextWeight::regular);

/// From pale at 0 to dark at `largest` (ColorBrewer's YlGnBu without its palest colour).
vtkSmartPointer<vtkColorTransferFunction> organ_colours(double largest);

/// Sends VTK's messages to the log from now on.
void route_messages();

/// An off-screen window of common size, anti-aliased.
vtkSmartPointer<vtkRenderWindow> make_window();

/// Renders and writes a PNG file, completely or not at all. Throws Error if it cannot be written.
void write_window(vtkRenderWindow* window, const std::filesystem::path& path);

}  // namespace livetet
