#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace livetet::house {

/// A function or a class, with its lines or its data members.
struct Size {
    std::string head;  ///< its declaration, without templates' parameters
    int line = 0;      ///< where it begins, from 1
    int size = 0;
};

struct Sizes {
    std::vector<Size> functions;  ///< lines from the declaration to the closing brace
    std::vector<Size> classes;    ///< data members, static ones not counted
};

/// Sizes of all that a C++ file defines at namespace and class scope. Reads text, not the language:
/// it expects what clang-format leaves, and knows no macros that open a scope.
Sizes measure(std::string_view source);

/// `source` with comments, literals' contents and preprocessor lines as spaces; lines stay.
std::string blanked(std::string_view source);

}  // namespace livetet::house
