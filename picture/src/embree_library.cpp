#include "embree_library.h"

#include <string>

#include <dlfcn.h>

namespace nms::picture {
namespace {

RenderFailure failure(const char* file) {
  const char* said = dlerror();
  return {std::string("Embree cannot be loaded: ") + (said != nullptr ? said : file),
          "install Embree 3 (Debian: libembree3-3), or put its folder into LD_LIBRARY_PATH"};
}

}  // namespace

tl::expected<EmbreeLibrary, RenderFailure> open_embree(const char* file) {
  void* const opened = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (opened == nullptr) return tl::unexpected(failure(file));
  EmbreeLibrary library;
#define NMS_X(function)                                                                      \
  library.function = reinterpret_cast<decltype(library.function)>(dlsym(opened, #function)); \
  if (library.function == nullptr) return tl::unexpected(failure(#function));
  NMS_EMBREE_FUNCTIONS(NMS_X)
#undef NMS_X
  return library;
}

const tl::expected<EmbreeLibrary, RenderFailure>& embree() {
  static const tl::expected<EmbreeLibrary, RenderFailure> library = open_embree(NMS_EMBREE_LIBRARY);
  return library;
}

}  // namespace nms::picture
