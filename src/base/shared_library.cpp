#include "base/shared_library.hpp"

#include <dlfcn.h>

#include "base/error.hpp"

namespace livetet {

SharedLibrary::SharedLibrary(std::string who, const std::string& file)
    : who_(std::move(who)), handle_(::dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL)) {
    if (!handle_)
        fail(
            "{}: its library cannot be loaded, expected {} of the version that Livetet was built "
            "with: {}",
            who_, file, ::dlerror());
}

void* SharedLibrary::address(const char* name) const {
    void* const found = ::dlsym(handle_, name);
    if (!found)
        fail("{}: its library has no function {}, expected the version that Livetet was built with",
             who_, name);
    return found;
}

}  // namespace livetet
