// The command's operator new: large blocks begin where a huge page may, and ask for huge pages.
//
// A large file's text, tree and tables are a few blocks of megabytes. On pages of 4 kB the kernel stops the command
// some ten thousand times to hand them out, for a third of its time. Only what fills whole huge pages asks for them, so
// that nothing takes more memory; where the system has none, nothing changes.
#include <cstdlib>
#include <new>

// AddressSanitizer has an operator new of its own, which finds more.
#if defined(__SANITIZE_ADDRESS__)
#define NMS_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define NMS_SANITIZED 1
#endif
#endif

#if defined(__linux__) && !defined(NMS_SANITIZED)

#include <sys/mman.h>

namespace {

constexpr std::size_t kHugePage = std::size_t{2} << 20U;

void* allocate(std::size_t size) noexcept {
  if (size < kHugePage) return std::malloc(size == 0 ? 1 : size);
  void* block = nullptr;
  if (posix_memalign(&block, kHugePage, size) != 0) return nullptr;
  static_cast<void>(madvise(block, size / kHugePage * kHugePage, MADV_HUGEPAGE));
  return block;
}

}  // namespace

void* operator new(std::size_t size) {
  while (true) {
    if (void* const block = allocate(size)) return block;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }

#endif
