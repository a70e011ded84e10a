// The whole path from text to a value, through the installed headers and libraries only.
#include <cstdio>
#include <memory>
#include <vector>

#include <nms/compiler/compile.h>
#include <nms/lang/render.h>
#include <nms/program/evaluate.h>
#include <nms/runtime/face.h>

namespace {

class NoFiles : public nms::lang::SourceProvider {
 public:
  std::shared_ptr<const nms::lang::Source> find(std::string_view, std::string_view) override { return nullptr; }
};

}  // namespace

int main() {
  const auto source = std::make_shared<const nms::lang::Source>(
      "smile.nms",
      "track mouth { merge strongest }\nau 12 \"Lip Corner Puller\" { track mouth }\nexpression smile 1s { 100%: 60% AU12 }\n");
  NoFiles files;
  nms::lang::Diagnostics diagnostics;
  const auto draft = nms::compiler::compile({source}, files, diagnostics);
  if (!draft) {
    std::fputs(nms::lang::render_text(diagnostics, false).c_str(), stderr);
    return 1;
  }
  const auto image = nms::program::Image::from(*draft);
  if (!image) return 1;
  const nms::program::Program& program = image->program();
  std::vector<float> values(program.channels.size());
  nms::program::evaluate(program, program.clips[0], 1'000'000'000, values);
  const nms::runtime::Face face;
  return values[0] == 0.6F && face.materials.empty() ? 0 : 1;
}
