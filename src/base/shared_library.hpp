#pragma once

#include <string>

namespace livetet {

/// A shared library that is loaded when it is first needed, not at the program's start. It stays
/// loaded until the process ends: threads and exit handlers of the library may outlive this object.
class SharedLibrary {
  public:
    /// Loads the library `file`: a name that the loader searches for (libm.so.6), or a path. Its
    /// symbols do not become visible to other libraries. `who` names it in messages. Throws Error
    /// with the loader's reason.
    SharedLibrary(std::string who, const std::string& file);

    /// Address of the function `name`, of type F. The caller answers for the type. Throws Error if
    /// the library has no such symbol.
    template <class F>
    F* function(const char* name) const {
        return reinterpret_cast<F*>(address(name));
    }

  private:
    void* address(const char* name) const;

    std::string who_;
    void* handle_;
};

}  // namespace livetet
