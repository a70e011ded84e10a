#pragma once

#include <cstdint>
#include <type_traits>

/// The records of an AU curve program and of a rig description, as they lie in memory and in an `.auc` file.
///
/// Little-endian, naturally aligned, no padding bytes that are not named and zero. Every record is trivially copyable,
/// so a checked file is used where it is mapped. Times are nanoseconds on the clip's own clock, which may be negative.
namespace nms::program {

/// Index into the string table; 0 is the empty string.
enum class StringId : std::uint32_t {};
/// Index into the channel table.
enum class ChannelId : std::uint32_t {};
/// Index into the muscle table.
enum class MuscleId : std::uint32_t {};

/// "no such thing", for every 32-bit index.
inline constexpr std::uint32_t kNone = 0xFFFFFFFFU;

enum class Side : std::uint8_t { none, left, right };  ///< the signer's own side

enum class ChannelKind : std::uint8_t {
  action_unit,  ///< one AU (of one side); values in [0, 1], 1 is the FACS maximum
  axis,         ///< an opposed pair of AUs; values in [-1, 1], + is the first of the pair
};

/// What an axis turns or shifts.
enum class Motion : std::uint8_t { none, rotate_x, rotate_y, rotate_z, translate_x, translate_y, translate_z };

/// The rigid frame that an axis or a hinge moves.
enum class Frame : std::uint8_t { none, torso, head, jaw, eyes };

/// How values of one channel are merged within one layer.
enum class MergeOperator : std::uint8_t { strongest, sum, latest };

/// A track owns channels for merging, ownership and reports.
struct Track {
  StringId name{};
  MergeOperator merge = MergeOperator::strongest;
  std::uint8_t zero[3] = {};
};

/// One curve's subject: an AU of one side, or a signed axis.
///
/// `sample` prints an axis as its two AUs, each 0 to 1. `full_scale` is what a value of 1 means for an axis: radians
/// for a rotation, metres for a translation. AUs leave it 0.
struct Channel {
  StringId name{};      ///< "AU12L", "AU26", or the axis' name
  StringId title{};     ///< "Lip Corner Puller"
  StringId positive{};  ///< axis: name of the AU that + stands for ("AU51"); else 0
  StringId negative{};  ///< axis: name of the AU that - stands for ("AU52"); else 0
  std::uint32_t track = kNone;
  float full_scale = 0.0F;  ///< [rad] or [m]
  std::uint16_t au = 0;     ///< FACS number; of an axis: of its positive AU
  ChannelKind kind = ChannelKind::action_unit;
  Side side = Side::none;
  Motion motion = Motion::none;
  Frame frame = Frame::none;
  std::uint8_t zero[2] = {};
};

/// How a segment goes from its knot's value to the next knot's.
/// Any other `Knot::shape` counts in the handles of its curve: the two inner Bézier control values.
inline constexpr std::uint16_t kShapeSmooth = 0xFFFF;         ///< 3u^2 - 2u^3: inner values v0, v1
inline constexpr std::uint16_t kShapeLinear = 0xFFFE;         ///< inner values v0 + (v1-v0)/3, v0 + 2(v1-v0)/3
inline constexpr std::uint16_t kShapeHold = 0xFFFD;           ///< v0 up to, not including, the next knot (a step)
inline constexpr std::uint16_t kShapeFirstReserved = 0xFFF0;  ///< so this many different cubics in one curve at most

/// Times lie within 10^14 ns (27 hours) of a clip's origin: they fit 48 bits, and differences are exact in double.
inline constexpr std::int64_t kTimeLimit_ns = 100'000'000'000'000;

/// A knot of a curve: the value there, exactly, and the shape of the segment that starts there.
/// Times of one curve ascend; two knots (not three) may share a time: a jump, and the value there is the second's.
/// Before the first knot the first value holds, after the last knot the last one: neutral ends are knots of value 0.
struct Knot {
  std::uint32_t time_low = 0;  ///< the time's low 32 bits
  std::int16_t time_high = 0;  ///< and those above them: time_high * 2^32 + time_low  [ns]
  std::uint16_t shape = kShapeHold;
  float value = 0.0F;

  Knot() = default;
  /// @pre the time is within kTimeLimit_ns of 0; another is kept modulo 2^48
  constexpr Knot(std::int64_t time_ns, float value_at, std::uint16_t shape_from)
      : time_low(static_cast<std::uint32_t>(time_ns)),
        time_high(static_cast<std::int16_t>(time_ns >> 32U)),
        shape(shape_from),
        value(value_at) {}
  [[nodiscard]] constexpr std::int64_t time_ns() const {
    return static_cast<std::int64_t>(time_high) * 0x1'0000'0000 + static_cast<std::int64_t>(time_low);
  }
};

/// Inner control values b1, b2 of a cubic Bézier segment: (1-u)^3 v0 + 3(1-u)^2 u b1 + 3(1-u) u^2 b2 + u^3 v1.
struct Handles {
  float b1 = 0.0F;
  float b2 = 0.0F;
};

/// One channel's curve in one clip: knots [first_knot, first_knot + knot_count), at least one.
/// A clip's curves are ordered by channel; a channel occurs once in a clip.
/// Curves share out the handle table in their order: a curve's begin at `first_handle`, and each is first used in its
/// turn, so a knot's shape is at most one past the shapes of the knots before it.
struct Curve {
  ChannelId channel{};
  std::uint32_t first_knot = 0;
  std::uint32_t knot_count = 0;
  std::uint32_t first_handle = 0;
};

enum class ClipKind : std::uint8_t { pose, expression, timeline, entry, utterance, discourse };

/// A thing that can be played. It is defined on [start_ns, end_ns]; start may be negative (a lead before the first
/// sign).
struct Clip {
  StringId name{};
  ClipKind kind = ClipKind::expression;
  std::uint8_t zero[3] = {};
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
  std::uint32_t first_curve = 0;
  std::uint32_t curve_count = 0;
  std::uint32_t first_marker = 0;
  std::uint32_t marker_count = 0;
  std::uint64_t content_hash = 0;  ///< XXH3-64 over all that the clip's declaration depends on
};

enum class MarkerKind : std::uint8_t {
  mark,
  sign_start,
  stroke_end,  ///< what follows, up to the sign's end, is its hold
  sign_end,
  onset,
  apex,
  offset,
  release,
  use_start,  ///< of an entry over a span of an utterance, without its leads and lags
  use_end,
  utterance_start,  ///< of one utterance of a discourse: its first sign
  utterance_end,
};

/// Whose sign a marker is of. What is no sign's is the signing hand's.
enum class Hand : std::uint8_t {
  signing,
  other,  ///< of `signs nd { }`
};

/// A named moment of a clip; a clip's markers ascend in time.
/// Starts and ends pair by name and hand, the first to start is the first to end. At the same time the outer use stands first.
struct Marker {
  std::int64_t time_ns = 0;
  StringId name{};
  MarkerKind kind = MarkerKind::mark;
  Hand hand = Hand::signing;
  std::uint8_t zero[2] = {};
};

/// Where a segment came from. The source map holds one index into this table for each knot (or kNone).
struct Source {
  StringId file{};           ///< relative path
  std::uint32_t line = 0;    ///< from 1
  std::uint32_t column = 0;  ///< from 1, in bytes
  StringId entry{};          ///< the lexicon entry, expression or pose that made it; may be empty
};

/// One file a compiler read, and how it came to: the text called `name` in the file `from` was found at `path`.
/// While every name still leads to the same path and the same text, the same compiler makes the same program of them.
struct Input {
  StringId name{};  ///< as written after `use`; of a file named on the command line: its path
  StringId from{};  ///< path of the file that uses it; empty: named on the command line
  StringId path{};  ///< relative, or "stdlib/..."
  std::uint8_t zero[4] = {};
  std::uint64_t hash = 0;  ///< text_hash() of its text
};

// ------------------------------------------------------------------------------------------------ rig

enum class MuscleKind : std::uint8_t {
  linear,     ///< pulls towards the attachment           (Barker 2005, 4.4.2; Waters 1987)
  sheet,      ///< pulls along the muscle vector           (Barker 2005, 4.4.2)
  sphincter,  ///< pulls towards the centre of an ellipse  (Barker 2005, 4.4.2; Waters' fall-off)
  eyelid,     ///< turns a lid about the eyeball           (Barker 2005, 4.4.2)
  hinge,      ///< turns and slides a frame, the skin following by its region's shares (the jaw)
  bulge,      ///< pushes outwards along the surface's normal (a puffed cheek)
  roll,       ///< turns a lip about its own length, a parabola through its middle and the corners, and shifts it
};

/// Radial fall-off laws, by name in the source.
enum class Falloff : std::uint8_t {
  smooth,  ///< default: the thesis's law times a smooth fall to 0 at the edge of the angle of influence
  thesis,  ///< as printed: jumps from cos(theta) to 0 at the edge of the zone
};

/// One muscle of one side. Which fields count depends on its kind; the others are 0.
/// Places are landmarks of the face by name, plus an offset in the face's own directions
/// (x away from the midline on the muscle's side, y up, z forward).
struct Muscle {
  StringId name{};  ///< "zygomatic_major_L"
  MuscleKind kind = MuscleKind::linear;
  Side side = Side::none;
  Falloff falloff = Falloff::smooth;
  Frame frame = Frame::none;  ///< hinge: the frame it moves
  StringId attachment{};  ///< linear, sheet: `from`; sphincter, bulge: centre; eyelid: eyeball's centre; hinge: axis;
                          ///< roll: the lip's middle
  StringId insertion{};   ///< linear, sheet: `to`; sphincter: end of the major half axis; eyelid: middle of the margin;
                          ///< roll: the mouth's corner
  StringId region{};      ///< only points of this region move, times their weight; 0 = all
  StringId except{};      ///< points of this region do not move (1 - weight); 0 = none
  float attachment_offset[3] = {};  ///< [m]
  float insertion_offset[3] = {};   ///< [m]
  float angle = 0.0F;  ///< linear: angle of influence; eyelid: turn at full contraction, + down; hinge: turn, + opens,
                       ///< of a side: about the vertical, + towards that side; roll: turn about +x [rad]
  float insertion_radius = 0.0F;      ///< I; 0 = |m|                                                       [m]
  float dissipation_radius = 0.0F;    ///< D; of a sphincter 0                                              [m]
  float perpendicular_radius = 0.0F;  ///< sheet: D perpendicular; roll: half width that takes all of it    [m]
  float major_radius = 0.0F;          ///< sphincter, bulge: half axis along insertion; 0 = |m|                    [m]
  float minor_radius = 0.0F;          ///< sphincter, bulge: half axis across it                                   [m]
  float limit = 0.0F;   ///< contraction at full activation, share of |m| (of the way, for a sphincter; of 1 else) [-]
  float amount = 0.0F;  ///< bulge: push at the centre; sphincter: push forward (protrusion)         [m]
  float slide[3] = {};  ///< hinge: shift of the frame at full contraction; roll: of the lip          [m]
  float closes = 0.0F;  ///< eyelid: share of the way to the other lid's margin; 0 = `angle` alone   [-]
};

/// An AU drives a muscle by a share of its contraction; many to many. Ordered by channel, then muscle.
struct Actuation {
  ChannelId channel{};
  MuscleId muscle{};
  float share = 0.0F;  ///< may exceed 1 only where the source says so; negative relaxes
};

/// A named place on the face, at rest: a position, a vertex of the geometry, or a place on one of its surfaces.
struct Landmark {
  StringId name{};               ///< sided ones carry "_L" or "_R"
  float position[3] = {};        ///< in the face's coordinates [m]; on a surface: u and v, shares of its domain, and 0
  std::uint32_t vertex = kNone;  ///< of the file, in its order, from 0; kNone: `position` says where
  StringId surface{};            ///< name of the surface that `position` counts on; 0: none
};

/// A direction along an axis of a face's file.
enum class Axis : std::uint8_t { x, y, z, minus_x, minus_y, minus_z };

/// The face this rig was made for. One at most.
struct FaceReference {
  StringId name{};         ///< "ada"
  StringId surface{};      ///< path of its geometry, relative to the file that declares it
  float unit = 1.0F;       ///< what 1 in the file stands for                                  [m]
  Axis up = Axis::y;       ///< the file's direction that is up in the face
  Axis forward = Axis::z;  ///< and forward; not along `up`
  std::uint8_t zero[2] = {};
  float origin[3] = {};  ///< what is at the face's origin: taken off, once turned and in metres         [m]
  float low[3] = {};     ///< the skin is what lies between these, in the face's coordinates; both 0: all of it [m]
  float high[3] = {};    ///< [m]
};

/// What a part of a face's geometry is.
enum class FacePartKind : std::uint8_t {
  skin,         ///< deforms
  lashes,       ///< ride on the skin next to them
  brows,        ///< likewise
  eye_left,     ///< turns about the centre of the sphere through it
  eye_right,    ///< likewise
  teeth_upper,  ///< rigid with the head
  gums_upper,   ///< likewise
  teeth_lower,  ///< rigid with the jaw
  gums_lower,   ///< likewise
  tongue,       ///< bends, with the jaw
  head,         ///< anything else that is rigid with the head: hair
};

/// A part of a face's geometry: all that has this name, or these vertices of it.
struct FacePart {
  FacePartKind kind = FacePartKind::skin;
  std::uint8_t zero[3] = {};
  StringId name{};          ///< of a group, an object, a mesh, a material or a surface; 0: any. * stands for any text
  std::uint32_t first = 0;  ///< first vertex, in the file's order, from 0
  std::uint32_t last = kNone;  ///< last vertex
};

static_assert(sizeof(Track) == 8 && sizeof(Channel) == 32 && sizeof(Knot) == 12 && sizeof(Handles) == 8);
static_assert(sizeof(Curve) == 16 && sizeof(Clip) == 48 && sizeof(Marker) == 16 && sizeof(Source) == 16 &&
              sizeof(Input) == 24);
static_assert(sizeof(Muscle) == 96 && sizeof(Actuation) == 12 && sizeof(Landmark) == 24 &&
              sizeof(FaceReference) == 52 && sizeof(FacePart) == 16);
static_assert(std::is_trivially_copyable_v<Knot> && std::is_trivially_copyable_v<Muscle> &&
              std::is_trivially_copyable_v<Clip>);

}  // namespace nms::program
