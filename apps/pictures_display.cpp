// Apart from all else: Xlib.h defines macros (Success, None) that others use as names.
#include "apps/pictures_display.hpp"

#include <X11/Xlib.h>

namespace livetet {

bool have_display() {
    // Kept open to the end: a virtual server resets itself when its last client leaves, and refuses the next meanwhile.
    static Display* const display = XOpenDisplay(nullptr);
    return display != nullptr;
}

}  // namespace livetet
