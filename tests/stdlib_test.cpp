#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <nms/compiler/compile.h>
#include <nms/lang/parse.h>
#include <nms/program/play.h>
#include <nms/program/program.h>
#include <nms/stdlib/embedded.h>

#include "embedded_library.h"

// What the standard library promises: all of FACS, all of the thesis' non-manual signs, sources for each entry, and
// directions that are what their names say.
namespace {

using namespace nms;

program::Image compile(std::shared_ptr<const lang::Source> root, EmbeddedLibrary& library) {
  lang::Diagnostics diagnostics;
  const auto draft = compiler::compile({std::move(root)}, library, diagnostics);
  for (const auto& d : diagnostics.all()) ADD_FAILURE() << d.source->path() << ": " << d.kind << ": " << d.message;
  auto image = program::Image::from(draft.value());
  return std::move(image.value());
}

program::Image compile_text(const std::string& text) {
  EmbeddedLibrary library;
  return compile(std::make_shared<const lang::Source>("test.nms", text), library);
}

program::Image compile_file(const std::string& path) {
  EmbeddedLibrary library;
  return compile(library.find(path, ""), library);
}

/// Barker 2005, appendix D, with its misprints put right.
const std::map<int, std::string_view> kAppendixD = {
    {1, "Inner Brow Raiser"},
    {2, "Outer Brow Raiser"},
    {4, "Brow Lowerer"},
    {5, "Upper Lid Raiser"},
    {6, "Cheek Raiser"},
    {7, "Lid Tightener"},
    {8, "Lips Together"},
    {9, "Nose Wrinkler"},
    {10, "Upper Lip Raiser"},
    {11, "Nasolabial Furrow Deepener"},
    {12, "Lip Corner Puller"},
    {13, "Sharp Lip Puller"},
    {14, "Dimpler"},
    {15, "Lip Corner Depressor"},
    {16, "Lower Lip Depressor"},
    {17, "Chin Raiser"},
    {18, "Lip Puckerer"},
    {19, "Tongue Out"},
    {20, "Lip Stretcher"},
    {21, "Neck Tightener"},
    {22, "Lip Funneler"},
    {23, "Lip Tightener"},
    {24, "Lip Pressor"},
    {25, "Lips Part"},
    {26, "Jaw Drop"},
    {27, "Mouth Stretch"},
    {28, "Lip Suck"},
    {29, "Jaw Thrust"},
    {30, "Jaw Sideways"},
    {31, "Jaw Clencher"},
    {32, "Lip Bite"},
    {33, "Cheek Blow"},
    {34, "Cheek Puff"},
    {35, "Cheek Suck"},
    {36, "Tongue Bulge"},
    {37, "Lip Wipe"},
    {38, "Nostril Dilator"},
    {39, "Nostril Compressor"},
    {41, "Lid Droop"},
    {42, "Eyelid Slit"},
    {43, "Eyes Closed"},
    {44, "Squint"},
    {45, "Blink"},
    {46, "Wink"},
    {51, "Head Turn Left"},
    {52, "Head Turn Right"},
    {53, "Head Up"},
    {54, "Head Down"},
    {55, "Head Tilt Left"},
    {56, "Head Tilt Right"},
    {57, "Head Forward"},
    {58, "Head Back"},
    {61, "Eyes Turn Left"},
    {62, "Eyes Turn Right"},
    {63, "Eyes Up"},
    {64, "Eyes Down"},
    {65, "Walleye"},
    {66, "Cross-eye"},
};

TEST(StandardLibrary, DeclaresEveryUnitOfAppendixDUnderItsName) {
  EmbeddedLibrary library;
  lang::Diagnostics diagnostics;
  const auto tree = lang::parse(library.find("facs.nms", ""), diagnostics);
  std::map<int, std::string> declared;
  for (const lang::NodeRef node : tree->root().children()) {
    if (!node.is(lang::NodeKind::au)) continue;
    const std::string title(node.child(lang::NodeKind::string).text());
    declared[std::stoi(std::string(node.child(lang::NodeKind::quantity).text()))] = title.substr(1, title.size() - 2);
  }
  for (const auto& [number, name] : kAppendixD) EXPECT_EQ(declared[number], name) << "AU" << number;
}

TEST(StandardLibrary, EveryUnitOfAppendixDReachesAChannel) {
  for (const auto& [number, name] : kAppendixD) {
    const auto image = compile_text("expression e 500ms { 100%: AU" + std::to_string(number) + " }");
    EXPECT_GE(image.program().curves.size(), 1U) << "AU" << number;
  }
}

TEST(StandardLibrary, AxesTurnTheWayTheirUnitsSay) {
  // Right-handed turns about +x (the subject's left), +y (up), +z (forward), of the way the face looks, (0, 0, 1), or
  // of the crown of the head, (0, 1, 0). `full_scale` is what the positive unit does.
  const auto image =
      compile_text("expression e 1s { 100%: AU53 + AU51 + AU55 + AU57 + AU63 + AU61 + AU101 + AU103 + AU105 }");
  const program::Program& p = image.program();
  std::map<std::string, float> full;
  for (const auto& channel : p.channels)
    if (channel.kind == program::ChannelKind::axis) full[std::string(p.string(channel.name))] = channel.full_scale;
  // Face's y after rotate_x by a: -sin a. AU53 and AU63 look up.
  EXPECT_GT(-std::sin(full["head_pitch"]), 0.0F);
  EXPECT_GT(-std::sin(full["gaze_pitch"]), 0.0F);
  // Face's x after rotate_y by a: sin a. AU51, AU61 and AU105 turn to the left, +x.
  EXPECT_GT(std::sin(full["head_yaw"]), 0.0F);
  EXPECT_GT(std::sin(full["gaze_yaw"]), 0.0F);
  EXPECT_GT(std::sin(full["torso_yaw"]), 0.0F);
  // Crown's x after rotate_z by a: -sin a. AU55 and AU103 tilt to the left.
  EXPECT_GT(-std::sin(full["head_roll"]), 0.0F);
  EXPECT_GT(-std::sin(full["torso_roll"]), 0.0F);
  // Crown's z after rotate_x by a: sin a. AU101 leans forward.
  EXPECT_GT(std::sin(full["torso_pitch"]), 0.0F);
  EXPECT_FLOAT_EQ(full["head_thrust"], 0.040F);
}

TEST(StandardLibrary, HasEveryNonManualSignOfTheThesis) {
  // Barker 2005, 1.2.1 to 1.2.4.
  const auto image = compile_file("lexicons/asl.nms");
  for (const std::string_view name :
       {"not_yet", "unexpectedly", "menstrual_period", "oh_why_not", "oh_definitely_yes", "thats_really_interesting",
        "flap", "mm", "th", "wh", "neg", "yn", "rhq", "feedback", "feedback_tilt", "feedback_brows", "feedback_nose"})
    EXPECT_NE(image.program().find_clip(name), nullptr) << name;
}

TEST(StandardLibrary, EveryEntrySaysWhatItMeansAndWhoSaysSo) {
  for (const auto& file : stdlib::embedded_files()) {
    if (!file.path.starts_with("lexicons/")) continue;
    lang::Diagnostics diagnostics;
    const auto tree =
        lang::parse(std::make_shared<const lang::Source>(std::string(file.path), std::string(file.text)), diagnostics);
    for (const lang::NodeRef lexicon : tree->root().children()) {
      for (const lang::NodeRef entry : lexicon.children()) {
        if (!entry.is(lang::NodeKind::entry)) continue;
        const std::string name(entry.child(lang::NodeKind::name).text());
        std::set<std::string> properties;
        for (const lang::NodeRef item : entry.children())
          if (item.is(lang::NodeKind::property)) properties.insert(std::string(item.at(0).text()));
        for (const char* wanted : {"label", "meaning", "source", "evidence"})
          EXPECT_TRUE(properties.contains(wanted)) << file.path << ": " << name << " has no " << wanted;
        EXPECT_TRUE(entry.child(lang::NodeKind::doc_comment).exists())
            << file.path << ": " << name << " has no doc comment";
      }
    }
  }
}

/// Values of a clip at 100 times, rounded: what it looks like.
std::vector<int> look(const program::Program& p, const program::Clip& clip) {
  std::vector<int> out;
  std::vector<float> values(p.channels.size());
  program::Player player(p, clip);
  for (int i = 0; i <= 100; ++i) {
    player.advance(clip.start_ns + (clip.end_ns - clip.start_ns) * i / 100, values);
    for (const float v : values) out.push_back(static_cast<int>(std::lround(v * 50.0F)));
  }
  return out;
}

TEST(StandardLibrary, NoTwoEntriesLookTheSame) {
  const auto image = compile_file("lexicons/asl.nms");
  std::map<std::vector<int>, std::string> seen;
  for (const auto& clip : image.program().clips) {
    const std::string name(image.program().string(clip.name));
    const auto [it, fresh] = seen.try_emplace(look(image.program(), clip), name);
    EXPECT_TRUE(fresh) << name << " looks like " << it->second;
  }
  EXPECT_GT(seen.size(), 15U);
}

TEST(StandardLibrary, AQuestionFurrowsTheBrowThroughItsClause) {
  const auto image = compile_text(
      "utterance u in asl { signs { topic[ BOOK@0.00s..0.62s ] wh[ IX-3@0.70s..0.95s WHERE{wh}@0.95s..1.20s~1.60s ] } "
      "}");
  const program::Program& p = image.program();
  const program::Clip* clip = p.find_clip("u");
  ASSERT_NE(clip, nullptr);
  std::size_t au4 = 0, au1 = 0;
  for (std::size_t i = 0; i < p.channels.size(); ++i) {
    if (p.string(p.channels[i].name) == "AU4L") au4 = i;
    if (p.string(p.channels[i].name) == "AU1L") au1 = i;
  }
  std::vector<float> values(p.channels.size());
  program::Player player(p, *clip);
  for (std::int64_t t = 700; t <= 1600; t += 10) {
    player.advance(t * 1'000'000, values);
    EXPECT_NEAR(values[au4], 0.8F, 1e-5F) << t << " ms";
  }
  player.advance(300'000'000, values);
  EXPECT_NEAR(values[au1], 0.7F, 1e-5F);
  EXPECT_EQ(values[au4], 0.0F);
  player.advance(1'200'000'000, values);
  EXPECT_EQ(values[au1], 0.0F);
}

/// What a FACS string asks of each channel at its strongest.
std::map<std::string, float> strongest(const std::string& facs) {
  const auto image = compile_text("timeline t 2s { facs \"" + facs + "\" over 0.5s..1.5s }");
  const program::Program& p = image.program();
  std::map<std::string, float> out;
  const program::Clip* clip = p.find_clip("t");
  if (clip == nullptr) return out;
  std::vector<float> values(p.channels.size());
  program::Player player(p, *clip);
  for (std::int64_t t = clip->start_ns; t <= clip->end_ns; t += 10'000'000) {
    player.advance(t, values);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (std::abs(values[i]) > 1e-4F) {
        float& most = out[std::string(p.string(p.channels[i].name))];
        most = std::max(most, std::abs(values[i]));
      }
  }
  return out;
}

TEST(FacsStrings, AreReadAsCodersWriteThem) {
  using Units = std::map<std::string, float>;
  const std::vector<std::pair<std::string, Units>> samples = {
      {"6+12", {{"AU6L", 1.0F}, {"AU6R", 1.0F}, {"AU12L", 1.0F}, {"AU12R", 1.0F}}},
      {"R12A+R14A", {{"AU12R", 0.2F}, {"AU14R", 0.2F}}},
      {"5B+26", {{"AU5L", 0.4F}, {"AU5R", 0.4F}, {"AU26", 1.0F}}},
      {"6+12*", {{"AU6L", 1.0F}, {"AU6R", 1.0F}, {"AU12L", 0.6F}, {"AU12R", 0.6F}}},
      {"17+23 or 24", {{"AU17", 1.0F}, {"AU23", 1.0F}}},
      {"9, 9+16+25, 26", {{"AU9L", 1.0F}, {"AU9R", 1.0F}}},
      {"U14", {{"AU14R", 1.0F}}},
      {"AU25 26b", {{"AU25", 1.0F}, {"AU26", 0.4F}}},
      {"M60", {{"head_yaw", 12.0F / 75.0F}}},
  };
  for (const auto& [text, wanted] : samples) {
    const Units got = strongest(text);
    EXPECT_EQ(got.size(), wanted.size()) << text;
    for (const auto& [channel, value] : wanted) {
      ASSERT_TRUE(got.contains(channel)) << text << ": " << channel;
      EXPECT_NEAR(got.at(channel), value, 1e-3F) << text << ": " << channel;
    }
  }
}

/// A file of strings found in the wild, name and string in each line with a tab between; `#` begins a remark.
TEST(FacsStrings, OfTheWildAreAllRead) {
  const char* const given = std::getenv("NMS_FACS_STRINGS");
  const std::string path =
      given != nullptr ? given : std::string(NMS_SOURCE_DIR) + "/../shared/data/facs/facs_strings.txt";
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << "no strings (set NMS_FACS_STRINGS to a file of them)";
  std::size_t read = 0;
  for (std::string line; std::getline(file, line);) {
    const std::size_t tab = line.find('\t');
    if (line.starts_with('#') || tab == std::string::npos) continue;
    ++read;
    EXPECT_FALSE(strongest(line.substr(tab + 1)).empty()) << line;
  }
  EXPECT_GT(read, 0U) << path;
}

TEST(StandardLibrary, ANodGoesDownFirst) {
  const auto image = compile_text("timeline t 2s { nod(1x) at 0s }");
  const program::Program& p = image.program();
  std::vector<float> values(p.channels.size());
  program::Player player(p, *p.find_clip("t"));
  player.advance(125'000'000, values);  // a quarter of the first cycle
  for (std::size_t i = 0; i < p.channels.size(); ++i) {
    if (p.string(p.channels[i].name) == "head_pitch") {
      EXPECT_NEAR(values[i], -8.0F / 45.0F, 1e-5F);
    }
  }
}

}  // namespace
