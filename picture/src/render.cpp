#include <nms/picture/render.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "embree_library.h"

namespace nms::picture {
namespace {

constexpr float kPi = 3.14159265F;
constexpr int kSamplesAcross = 3;         // rays a pixel: their square
constexpr float kOcclusionReach = 0.05F;  // [m] what is farther away does not darken the sky
constexpr float kLift = 0.0004F;          // [m] a ray starts this far off the surface it leaves
constexpr float kLens = 6.0F;             // camera's distance, in heights of the picture: a long lens

/// Lights stand in the world, so that a head that turns is lit anew.
const glm::vec3 kKeyDirection = glm::normalize(glm::vec3(-0.55F, 0.75F, 0.9F));
const glm::vec3 kFillDirection = glm::normalize(glm::vec3(0.4F, 0.05F, 0.95F));
const glm::vec3 kRimDirection = glm::normalize(glm::vec3(0.5F, 0.6F, -0.9F));
constexpr glm::vec3 kKeyColor{2.1F, 2.0F, 1.87F};
constexpr glm::vec3 kFillColor{0.72F, 0.74F, 0.78F};
constexpr glm::vec3 kRimColor{0.8F, 0.85F, 0.95F};
constexpr glm::vec3 kSkyColor{0.57F, 0.60F, 0.65F};
constexpr glm::vec3 kGroundColor{0.36F, 0.32F, 0.30F};
/// Where the sky is hidden, skin is what hides it, and sends some of its light on: a mouth is dark, not blue.
constexpr glm::vec3 kBounceColor{0.52F, 0.37F, 0.29F};
constexpr float kKeySpread = 0.22F;  // radius of the key's disc at distance 1
constexpr float kFillSpread = 0.5F;
constexpr int kFillRays = 9;  // for each vertex: a disc so wide casts no edges
constexpr int kEdgeRays = 3;  // to the key, from each ray of a pixel at a shadow's edge
constexpr glm::vec3 kBackdropTop{0.36F, 0.39F, 0.42F};
constexpr glm::vec3 kBackdropBottom{0.62F, 0.64F, 0.65F};
/// How far red, green and blue wrap round translucent skin.
constexpr glm::vec3 kWrap{0.32F, 0.14F, 0.08F};

/// How much light reaches one vertex from outside or, if the surface has two sides, from behind.
struct Reach {
  float sky;           ///< share of the hemisphere that is open
  std::uint16_t key;   ///< rays to the key light that arrive
  std::uint16_t fill;  ///< rays to the fill
};

/// The light at each vertex of a mesh, worked out when it is first asked for: much of a head is never seen. Whichever
/// thread does so writes the same.
class Reaches {
 public:
  explicit Reaches(std::size_t vertices) : known_(vertices) {
    for (std::atomic<std::uint64_t>& k : known_) k.store(kUnknown, std::memory_order_relaxed);
  }

  template <typename Find>
  Reach at(std::size_t vertex, const Find& find) {
    std::uint64_t bits = known_[vertex].load(std::memory_order_relaxed);
    Reach reach{};
    if (bits != kUnknown) {
      std::memcpy(&reach, &bits, sizeof reach);
      return reach;
    }
    reach = find();
    std::memcpy(&bits, &reach, sizeof bits);
    known_[vertex].store(bits, std::memory_order_relaxed);
    return reach;
  }

 private:
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0};  // no number of sky
  static_assert(sizeof(Reach) == sizeof(std::uint64_t));
  std::vector<std::atomic<std::uint64_t>> known_;
};

/// One ray of a pixel.
struct PixelSample {
  int turn;  ///< which of four neighbouring pixels
  int ray;
};

/// A disc that shines.
struct Lamp {
  glm::mat3 frame;  ///< its third column is the way to its middle
  float spread;     ///< radius at distance 1
};

struct Releaser {
  void operator()(RTCDevice device) const { embree()->rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { embree()->rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<RTCDeviceTy, Releaser>;
using Scene = std::unique_ptr<RTCSceneTy, Releaser>;

/// The i-th of n points of the Hammersley set: evenly spread, and always the same ones.
glm::vec2 hammersley(std::uint32_t i, std::uint32_t n) {
  std::uint32_t bits = i;
  bits = (bits << 16U) | (bits >> 16U);
  bits = ((bits & 0x55555555U) << 1U) | ((bits & 0xAAAAAAAAU) >> 1U);
  bits = ((bits & 0x33333333U) << 2U) | ((bits & 0xCCCCCCCCU) >> 2U);
  bits = ((bits & 0x0F0F0F0FU) << 4U) | ((bits & 0xF0F0F0F0U) >> 4U);
  bits = ((bits & 0x00FF00FFU) << 8U) | ((bits & 0xFF00FF00U) >> 8U);
  return {(static_cast<float>(i) + 0.5F) / static_cast<float>(n), static_cast<float>(bits) * 2.3283064e-10F};
}

/// A frame whose third column is `n`.
glm::mat3 frame_about(const glm::vec3& n) {
  const glm::vec3 side = std::fabs(n.x) < 0.7F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  const glm::vec3 u = glm::normalize(glm::cross(side, n));
  return {u, glm::cross(n, u), n};
}

RTCRay ray_from(const glm::vec3& origin, const glm::vec3& direction, float reach) {
  RTCRay ray{};
  ray.org_x = origin.x;
  ray.org_y = origin.y;
  ray.org_z = origin.z;
  ray.dir_x = direction.x;
  ray.dir_y = direction.y;
  ray.dir_z = direction.z;
  ray.tnear = 0.0F;
  ray.tfar = reach;
  ray.mask = 0xFFFFFFFFU;
  return ray;
}

/// Runs work(i) for i in [0, count) on `threads` threads. Each i writes only what is its own.
template <typename Work>
void spread(int threads, std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(run);
  run();
  for (std::thread& t : others) t.join();
}

std::uint8_t to_srgb(float linear) {
  const float x = std::clamp(linear, 0.0F, 1.0F);
  const float s = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(s * 255.0F + 0.5F);
}

/// Highlights roll off instead of being cut.
glm::vec3 tone_mapped(const glm::vec3& c) { return c * (1.0F + c * 0.12F) / (1.0F + c * 0.42F) * 1.12F; }

class Renderer {
 public:
  Renderer(const std::vector<Mesh>& meshes, const RenderOptions& options) : meshes_(meshes), options_(options) {}

  std::optional<RenderFailure> build() {
    for (const Mesh& m : meshes_)
      if (const char* wrong = defect(m)) return RenderFailure{wrong};
    if (options_.width < 1 || options_.height < 1 || options_.threads < 1)
      return RenderFailure{"a picture needs pixels and a thread"};
    if (options_.sky_rays < 1 || options_.key_rays < 1) return RenderFailure{"a picture needs rays of light"};
    if (options_.key_rays >= std::numeric_limits<std::uint16_t>::max())
      return RenderFailure{"so many rays are not counted", "ask for fewer rays to the key"};
    if (!embree()) return embree().error();
    embree_ = *embree();
    device_.reset(embree_.rtcNewDevice("threads=1"));
    if (!device_) return RenderFailure{"Embree found no device"};
    scene_.reset(embree_.rtcNewScene(device_.get()));
    embree_.rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    for (const Mesh& m : meshes_) add(m);
    embree_.rtcCommitScene(scene_.get());
    if (embree_.rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
      return RenderFailure{"Embree could not build the scene"};
    for (const Mesh& m : meshes_) {
      front_.emplace_back(m.positions.size());
      back_.emplace_back(m.two_sided ? m.positions.size() : 0);
    }
    return std::nullopt;
  }

  Image draw(const Camera& camera) const {
    Image image(options_.width, options_.height, {});
    const View view(camera, options_);
    spread(options_.threads, static_cast<std::size_t>(options_.height), [&](std::size_t row) {
      for (int column = 0; column < options_.width; ++column) {
        glm::vec3 sum(0.0F);
        for (int s = 0; s < kSamplesAcross * kSamplesAcross; ++s) {
          const float dx = (static_cast<float>(s % kSamplesAcross) + 0.5F) / kSamplesAcross;
          const float dy = (static_cast<float>(s / kSamplesAcross) + 0.5F) / kSamplesAcross;
          const PixelSample sample{static_cast<int>(row % 2) * 2 + column % 2, s};
          sum += tone_mapped(seen(view, static_cast<float>(column) + dx, static_cast<float>(row) + dy, sample));
        }
        const glm::vec3 mean = sum / static_cast<float>(kSamplesAcross * kSamplesAcross);
        const std::size_t at = (row * static_cast<std::size_t>(options_.width) + column) * 3;
        for (int c = 0; c < 3; ++c) image.pixels[at + c] = to_srgb(mean[c]);
      }
    });
    return image;
  }

 private:
  struct View {
    View(const Camera& camera, const RenderOptions& options)
        : pixel(camera.height_m / static_cast<float>(options.height)),
          middle(static_cast<float>(options.width) * 0.5F, static_cast<float>(options.height) * 0.5F),
          target(camera.target),
          height(static_cast<float>(options.height)) {
      const float cp = std::cos(camera.pitch_rad);
      back = {std::sin(camera.yaw_rad) * cp, std::sin(camera.pitch_rad), std::cos(camera.yaw_rad) * cp};
      right = {std::cos(camera.yaw_rad), 0.0F, -std::sin(camera.yaw_rad)};
      up = glm::cross(back, right);
      eye = target + back * (camera.height_m * kLens);
    }
    float pixel;  // [m] at the target
    glm::vec2 middle;
    glm::vec3 target;
    float height;
    glm::vec3 eye{}, back{}, right{}, up{};
  };

  static const char* defect(const Mesh& m) {
    if (m.normals.size() != m.positions.size()) return "a mesh has not one normal for each vertex";
    if (!m.colors.empty() && m.colors.size() != m.positions.size()) return "a mesh has not one colour for each vertex";
    if (m.triangles.size() % 3 != 0) return "a mesh ends in the middle of a triangle";
    for (const std::uint32_t i : m.triangles)
      if (i >= m.positions.size()) return "a triangle names a vertex that is not there";
    for (const glm::vec3& p : m.positions)
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return "a vertex is not a number";
    return nullptr;
  }

  void add(const Mesh& m) {
    RTCGeometry geometry = embree_.rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!m.triangles.empty()) {
      auto* vertices = static_cast<float*>(embree_.rtcSetNewGeometryBuffer(
          geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), m.positions.size()));
      for (const glm::vec3& p : m.positions)
        for (int c = 0; c < 3; ++c) *vertices++ = p[c];
      auto* indices = static_cast<std::uint32_t*>(embree_.rtcSetNewGeometryBuffer(
          geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), m.triangles.size() / 3));
      std::copy(m.triangles.begin(), m.triangles.end(), indices);
    }
    embree_.rtcCommitGeometry(geometry);
    embree_.rtcAttachGeometry(scene_.get(), geometry);  // ids count up: they are the meshes' indices
    embree_.rtcReleaseGeometry(geometry);
  }

  bool blocked(const glm::vec3& from, const glm::vec3& direction, float reach, float* distance = nullptr) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (distance == nullptr) {
      RTCRay ray = ray_from(from, direction, reach);
      embree_.rtcOccluded1(scene_.get(), &context, &ray);
      return ray.tfar < 0.0F;
    }
    RTCRayHit hit{};
    hit.ray = ray_from(from, direction, reach);
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree_.rtcIntersect1(scene_.get(), &context, &hit);
    *distance = hit.ray.tfar;
    return hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }

  /// Near things darken more than far ones: 1 at once, 0 at the end of the reach.
  float openness(const glm::vec3& from, const glm::mat3& frame) const {
    float open = 0.0F;
    const auto rays = static_cast<std::uint32_t>(options_.sky_rays);
    for (std::uint32_t i = 0; i < rays; ++i) {
      const glm::vec2 h = hammersley(i, rays);
      const float r = std::sqrt(h.x);
      const glm::vec3 local(r * std::cos(2.0F * kPi * h.y), r * std::sin(2.0F * kPi * h.y),
                            std::sqrt(std::max(0.0F, 1.0F - h.x)));
      float distance = 0.0F;
      open += blocked(from, frame * local, kOcclusionReach, &distance) ? distance / kOcclusionReach : 1.0F;
    }
    return open / static_cast<float>(rays);
  }

  /// Whether a place of a lamp's disc is seen; h.x counts its area from the middle, h.y goes round.
  bool lamp_seen(const Lamp& lamp, const glm::vec3& from, const glm::vec2& h) const {
    const float r = lamp.spread * std::sqrt(h.x);
    const glm::vec3 local(r * std::cos(2.0F * kPi * h.y), r * std::sin(2.0F * kPi * h.y), 1.0F);
    return !blocked(from, glm::normalize(lamp.frame * local), 1.0F);
  }

  /// How many of `count` rays arrive.
  std::uint16_t rays_to(const Lamp& lamp, const glm::vec3& from, int count) const {
    int seen = 0;
    const auto rays = static_cast<std::uint32_t>(count);
    for (std::uint32_t i = 0; i < rays; ++i) seen += lamp_seen(lamp, from, hammersley(i, rays)) ? 1 : 0;
    return static_cast<std::uint16_t>(seen);
  }

  Reach reach_at(const glm::vec3& position, const glm::vec3& normal) const {
    const glm::vec3 from = position + normal * kLift;
    return {openness(from, frame_about(normal)), rays_to(key_, from, options_.key_rays),
            rays_to(fill_, from, kFillRays)};
  }

  glm::vec3 seen(const View& view, float x, float y, const PixelSample& sample) const {
    const glm::vec3 at =
        view.target + view.right * ((x - view.middle.x) * view.pixel) + view.up * ((view.middle.y - y) * view.pixel);
    const glm::vec3 direction = glm::normalize(at - view.eye);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit hit{};
    hit.ray = ray_from(view.eye, direction, std::numeric_limits<float>::infinity());
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree_.rtcIntersect1(scene_.get(), &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return glm::mix(kBackdropTop, kBackdropBottom, y / view.height);
    return shade(hit, direction, sample);
  }

  /// The key's share where the corners of a triangle do not agree: looked for from the place itself. The place is
  /// lifted from the flat triangle to the round surface that the normals tell of, else facets shade one another:
  /// Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II (2021), ch. 4.
  float key_at_edge(const Mesh& mesh, const std::uint32_t* corner, const std::array<float, 3>& weight, float facing,
                    const glm::vec3& normal, const PixelSample& sample) const {
    glm::vec3 flat(0.0F);
    for (int i = 0; i < 3; ++i) flat += weight[i] * mesh.positions[corner[i]];
    glm::vec3 from = flat + normal * kLift;
    for (int i = 0; i < 3; ++i) {
      const glm::vec3 up = facing * mesh.normals[corner[i]];
      from -= weight[i] * std::min(0.0F, glm::dot(flat - mesh.positions[corner[i]], up)) * up;
    }
    // All places that a pixel looks to cover the disc; its neighbours' lie between them, so that no steps are seen.
    constexpr std::uint32_t kAll = kEdgeRays * kSamplesAcross * kSamplesAcross;
    const float shift = static_cast<float>(sample.turn) / 4.0F;
    int seen = 0;
    for (std::uint32_t i = 0; i < kEdgeRays; ++i) {
      glm::vec2 h = hammersley(static_cast<std::uint32_t>(sample.ray) * kEdgeRays + i, kAll);
      h += glm::vec2(shift - 0.375F, shift) / static_cast<float>(kAll);
      seen += lamp_seen(key_, from, h) ? 1 : 0;
    }
    return static_cast<float>(seen) / kEdgeRays;
  }

  glm::vec3 shade(const RTCRayHit& hit, const glm::vec3& direction, const PixelSample& sample) const {
    const Mesh& mesh = meshes_[hit.hit.geomID];
    const std::uint32_t* corner = &mesh.triangles[static_cast<std::size_t>(hit.hit.primID) * 3];
    const std::array<float, 3> weight{1.0F - hit.hit.u - hit.hit.v, hit.hit.u, hit.hit.v};
    glm::vec3 normal(0.0F);
    glm::vec3 color(0.0F);
    float open = 0.0F;
    float key_share = 0.0F;
    float fill_share = 0.0F;
    for (int i = 0; i < 3; ++i) {
      normal += weight[i] * mesh.normals[corner[i]];
      color += weight[i] * (mesh.colors.empty() ? glm::vec3(1.0F) : mesh.colors[corner[i]]);
    }
    normal = glm::normalize(normal);
    const bool behind = mesh.two_sided && glm::dot(normal, direction) > 0.0F;
    if (behind) normal = -normal;
    Reaches& reaches = (behind ? back_ : front_)[hit.hit.geomID];
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t v = corner[i];
      const Reach there =
          reaches.at(v, [&] { return reach_at(mesh.positions[v], (behind ? -1.0F : 1.0F) * mesh.normals[v]); });
      open += weight[i] * there.sky;
      key_share += weight[i] * static_cast<float>(there.key) / static_cast<float>(options_.key_rays);
      fill_share += weight[i] * static_cast<float>(there.fill) / static_cast<float>(kFillRays);
    }
    if (key_share > 0.001F && key_share < 0.999F)
      key_share = key_at_edge(mesh, corner, weight, behind ? -1.0F : 1.0F, normal, sample);
    color *= mesh.color;

    const auto lit = [&](const glm::vec3& to_light) {
      const glm::vec3 wrap = kWrap * mesh.translucence;
      return glm::max((glm::vec3(glm::dot(normal, to_light)) + wrap) / (1.0F + wrap), glm::vec3(0.0F));
    };
    // Light that is kept out is not black in skin: it comes through reddened.
    const glm::vec3 key =
        glm::mix(glm::vec3(key_share), glm::vec3(std::sqrt(key_share), key_share, key_share), mesh.translucence);
    const glm::vec3 sky = glm::mix(kGroundColor, kSkyColor, normal.y * 0.5F + 0.5F);
    const glm::vec3 light = kKeyColor * lit(kKeyDirection) * key + kFillColor * lit(kFillDirection) * fill_share +
                            kRimColor * lit(kRimDirection) * open + glm::mix(kBounceColor, sky, open);
    return color * light * 0.5F + highlight(normal, direction, mesh.roughness, kKeyDirection) * kKeyColor * key_share +
           highlight(normal, direction, mesh.roughness, kFillDirection) * kFillColor * fill_share;
  }

  /// Cook and Torrance's highlight with GGX's distribution, Schlick's Fresnel term and no masking; 2.8 % at right
  /// angles, as skin and cornea have it.
  static float highlight(const glm::vec3& n, const glm::vec3& direction, float roughness, const glm::vec3& to_light) {
    const glm::vec3 half = glm::normalize(to_light - direction);
    const float nl = glm::dot(n, to_light);
    const float nh = std::max(0.0F, glm::dot(n, half));
    if (nl <= 0.0F) return 0.0F;
    const float alpha = std::max(0.03F, roughness * roughness);
    const float d = nh * nh * (alpha * alpha - 1.0F) + 1.0F;
    const float distribution = alpha * alpha / (kPi * d * d);
    const float grazing = 1.0F - std::max(0.0F, glm::dot(to_light, half));
    const float fresnel = 0.028F + 0.972F * grazing * grazing * grazing * grazing * grazing;
    return distribution * fresnel * nl * 0.25F;
  }

  const std::vector<Mesh>& meshes_;
  RenderOptions options_;
  Lamp key_{frame_about(kKeyDirection), kKeySpread};
  Lamp fill_{frame_about(kFillDirection), kFillSpread};
  EmbreeLibrary embree_;
  Device device_;
  Scene scene_;
  mutable std::vector<Reaches> front_;  ///< by mesh
  mutable std::vector<Reaches> back_;   ///< by mesh; empty where it has one side
};

}  // namespace

tl::expected<std::vector<Image>, RenderFailure> render(const std::vector<Mesh>& meshes,
                                                       const std::vector<Camera>& cameras,
                                                       const RenderOptions& options) {
  Renderer renderer(meshes, options);
  if (auto failure = renderer.build()) return tl::unexpected(std::move(*failure));
  std::vector<Image> images;
  images.reserve(cameras.size());
  for (const Camera& c : cameras) images.push_back(renderer.draw(c));
  return images;
}

}  // namespace nms::picture
