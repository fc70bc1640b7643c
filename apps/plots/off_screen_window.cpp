#include "apps/plots/off_screen_window.hpp"

#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"

namespace livetet {

namespace {

/// Sends VTK's messages to the log instead of the terminal.
class LogWindow : public vtkOutputWindow {
  public:
    static LogWindow* New();
    vtkTypeMacro(LogWindow, vtkOutputWindow);
    void DisplayText(const char* text) override {
        log_debug(std::string("VTK: ") + (text ? text : ""));
    }
};
vtkStandardNewMacro(LogWindow);

}  // namespace

void set_text(vtkTextProperty* text, int size, TextWeight weight) {
    text->SetFontFamilyToArial();
    text->SetFontSize(size);
    text->SetBold(weight == TextWeight::bold);
    text->SetItalic(false);
    text->SetShadow(false);
    text->SetColor(look::ink.data());
}

vtkSmartPointer<vtkColorTransferFunction> organ_colours(double largest) {
    constexpr double steps[8][3] = {{0.93, 0.95, 0.75}, {0.78, 0.91, 0.71}, {0.50, 0.80, 0.73},
                                    {0.25, 0.71, 0.77}, {0.11, 0.57, 0.75}, {0.13, 0.37, 0.66},
                                    {0.15, 0.20, 0.58}, {0.03, 0.11, 0.35}};
    auto map = vtkSmartPointer<vtkColorTransferFunction>::New();
    for (int i = 0; i < 8; ++i)
        map->AddRGBPoint(largest * i / 7, steps[i][0], steps[i][1], steps[i][2]);
    return map;
}

void route_messages() {
    static const bool routed = [] {
        vtkNew<LogWindow> log;
        vtkOutputWindow::SetInstance(log);
        return true;
    }();
    (void)routed;
}

vtkSmartPointer<vtkRenderWindow> make_window() {
    route_messages();
    auto window = vtkSmartPointer<vtkRenderWindow>::New();
    window->SetOffScreenRendering(1);
    window->SetMultiSamples(8);
    window->SetSize(look::width, look::height);
    return window;
}

void write_window(vtkRenderWindow* window, const std::filesystem::path& path) {
    window->Render();
    vtkNew<vtkWindowToImageFilter> pixels;
    pixels->SetInput(window);
    pixels->SetInputBufferTypeToRGB();
    pixels->ReadFrontBufferOff();
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputConnection(pixels->GetOutputPort());
    writer->WriteToMemoryOn();  // VTK's own file output reports a full disk unclearly
    writer->Write();
    vtkUnsignedCharArray* const png = writer->GetResult();
    if (writer->GetErrorCode() != 0 || !png) fail("{}: the picture cannot be made", path.string());
    write_text_file(path, {png->Begin(), png->End()});
}

}  // namespace livetet
