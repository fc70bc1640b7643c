#include "apps/bench/allocation_count.hpp"

#include <cerrno>
#include <cstddef>

// Programs that link this file allocate through the functions below, which count and then call
// glibc's.

namespace {
thread_local std::uint64_t count = 0;
}

std::uint64_t livetet::allocations_of_this_thread() { return count; }

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
    ++count;
    return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
    ++count;
    return __libc_calloc(number, size);
}
void* realloc(void* old, std::size_t size) {
    ++count;
    return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
    ++count;
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    ++count;
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** place, std::size_t alignment, std::size_t size) {
    ++count;
    *place = __libc_memalign(alignment, size);
    return *place ? 0 : ENOMEM;
}
}
