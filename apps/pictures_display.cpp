// Apart from all else: Xlib.h defines macros (Success, None) that others use as names.
#include "apps/pictures_display.hpp"

#include <X11/Xlib.h>

namespace livetet {

bool have_display() {
    Display* display = XOpenDisplay(nullptr);
    if (display) XCloseDisplay(display);
    return display != nullptr;
}

}  // namespace livetet
