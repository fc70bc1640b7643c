#pragma once

namespace livetet {

/// True where an X server answers: without one, no picture can be drawn (VTK would end the program).
bool have_display();

}  // namespace livetet
