// SPDX-License-Identifier: Apache-2.0
// hapsix.hpp - the contract for C++17 and later: handles that destroy themselves, and spans.
//
// There is no second meaning of anything: a handle is a C pointer that is destroyed in its
// destructor, and it converts to that pointer, so every function of hapsix.h, batch.h and io.h takes it.
// A handle that cannot be made throws hapsix::Error.
//
// All handles are here, in whatever order headers are included, since formatters sort them. The handles
// of io.h need no io.h: it is another library's, and a program that does not link that one leaves them
// alone.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>
#if __cplusplus >= 202002L
#include <span>
#else
#include <iterator>
#include <type_traits>
#include <utility>
#endif

#include "batch.h"
#include "hapsix.h"

extern "C" {
// io.h declares these, too. This header may not include it: the engine does not know its library.
typedef struct h6Mesh h6Mesh;
typedef struct h6Field h6Field;
typedef struct h6Shell h6Shell;
typedef struct h6Scene h6Scene;
typedef struct h6Recorder h6Recorder;
typedef struct h6Recording h6Recording;
H6_API void h6DestroyMesh(h6Mesh* mesh);
H6_API void h6DestroyField(h6Field* field);
H6_API void h6DestroyShell(h6Shell* shell);
H6_API void h6DestroyScene(h6Scene* scene);
H6_API void h6DestroyRecorder(h6Recorder* recorder);
H6_API void h6DestroyRecording(h6Recording* recording);
}

namespace hapsix {

#if __cplusplus >= 202002L
using std::span;
#else
// The part of std::span that C++17 lacks: rows of memory that something else keeps.
template <class T>
class span {
  template <class Rows>
  using RowOf = std::remove_pointer_t<decltype(std::data(std::declval<Rows&>()))>;

 public:
  constexpr span() = default;
  constexpr span(T* first, std::size_t count) : first_(first), count_(count) {}
  // Of an array or a container of T; of const T also of a temporary one.
  template <class Rows, class = std::enable_if_t<
                            std::is_convertible_v<RowOf<Rows> (*)[], T (*)[]> &&
                            (std::is_const_v<T> || std::is_lvalue_reference_v<Rows>)>>
  constexpr span(Rows&& rows) : first_(std::data(rows)), count_(std::size(rows)) {}  // NOLINT
  constexpr T* data() const { return first_; }
  constexpr std::size_t size() const { return count_; }
  constexpr bool empty() const { return count_ == 0; }
  constexpr T* begin() const { return first_; }
  constexpr T* end() const { return first_ + count_; }
  constexpr T& operator[](std::size_t i) const { return first_[i]; }
  constexpr T& front() const { return *first_; }
  constexpr T& back() const { return first_[count_ - 1]; }
  constexpr span first(std::size_t count) const { return {first_, count}; }
  constexpr span subspan(std::size_t from) const { return {first_ + from, count_ - from}; }

 private:
  T* first_ = nullptr;
  std::size_t count_ = 0;
};
#endif

class Error : public std::runtime_error {
 public:
  explicit Error(const h6Error& error) : std::runtime_error(error.message), code(error.code) {}
  h6ErrorCode code;
};

// Owns a C object. Moves; does not copy.
template <class T, void (*destroy)(T*)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(T* object) : object_(object) {}
  // make(error) is a call of a create function: Session s = Session::make([&](h6Error* e) {...});
  template <class Make>
  static Handle make(Make&& create) {
    h6Error error{};
    T* const object = create(&error);
    if (!object) throw Error(error);
    return Handle(object);
  }
  operator T*() const { return object_.get(); }  // NOLINT: a handle is its pointer
  T* get() const { return object_.get(); }
  T* release() { return object_.release(); }

 private:
  struct Destroy {
    void operator()(T* object) const { destroy(object); }
  };
  std::unique_ptr<T, Destroy> object_;
};

using Model = Handle<h6Model, h6DestroyModel>;
using Session = Handle<h6Session, h6DestroySession>;
using Loop = Handle<h6Loop, h6DestroyLoop>;

inline Model create_model(span<const h6FieldDef> fields, span<const h6ShellDef> shells,
                          h6ModelDef def = h6DefaultModelDef()) {
  def.fields = fields.data(), def.field_count = fields.size();
  def.shells = shells.data(), def.shell_count = shells.size();
  return Model::make([&](h6Error* error) { return h6CreateModel(&def, error); });
}

inline Session create_session(const h6Model* model, span<const h6BodyDef> bodies,
                              span<const h6HandDef> hands,
                              h6SessionDef def = h6DefaultSessionDef(),
                              span<const h6PairDef> pairs = {}) {
  def.bodies = bodies.data(), def.body_count = bodies.size();
  def.hands = hands.data(), def.hand_count = hands.size();
  def.pairs = pairs.data(), def.pair_count = pairs.size();
  return Session::make([&](h6Error* error) { return h6CreateSession(model, &def, error); });
}

// One device a hand; they and the session must outlive the loop.
inline Loop start_loop(h6Session* session, span<const h6Device> devices,
                       const h6LoopDef& def = h6DefaultLoopDef()) {
  return Loop::make(
      [&](h6Error* error) { return h6StartLoop(session, devices.data(), &def, error); });
}

// The contacts of a shell body in the last frame, valid until the next step.
struct Contacts {
  explicit Contacts(const h6Contacts& c) : columns(c) {}
  std::size_t size() const { return columns.count; }
  span<const float> column(const float* first) const { return {first, columns.count}; }
  span<const float> depth() const { return column(columns.depth); }
  span<const float> weight() const { return column(columns.weight); }
  span<const float> load() const { return column(columns.load); }
  span<const std::uint32_t> point() const { return {columns.point, columns.count}; }
  span<const std::int32_t> field_body() const { return {columns.field_body, columns.count}; }
  // Of row i: the inward unit normal, the field's unit gradient outward, the arm from the centre of mass
  // [m] and the torque direction. World frame. The columns themselves: column(columns.gx), ...
  h6Vec3 normal(std::size_t i) const { return {columns.nx[i], columns.ny[i], columns.nz[i]}; }
  h6Vec3 gradient(std::size_t i) const { return {columns.gx[i], columns.gy[i], columns.gz[i]}; }
  h6Vec3 arm(std::size_t i) const { return {columns.rx[i], columns.ry[i], columns.rz[i]}; }
  h6Vec3 torque_direction(std::size_t i) const { return {columns.tx[i], columns.ty[i], columns.tz[i]}; }
  h6Contacts columns;
};
inline Contacts contacts(const h6Session* session, std::int32_t shell_body) {
  return Contacts(h6GetContacts(session, shell_body));
}

inline std::vector<h6Overlap> overlaps(const h6Session* session) {
  std::vector<h6Overlap> rows(h6GetOverlaps(session, nullptr, 0));
  h6GetOverlaps(session, rows.data(), rows.size());
  return rows;
}

// Records of a loop, oldest first: the part of `room` that was filled.
inline span<const h6FrameRecord> read_records(h6Loop* loop, span<h6FrameRecord> room) {
  return room.first(h6ReadRecords(loop, room.data(), room.size()));
}

using Workers = Handle<h6Workers, h6DestroyWorkers>;

// Of the library hapsix::io.
using Mesh = Handle<h6Mesh, h6DestroyMesh>;
using Field = Handle<h6Field, h6DestroyField>;
using Shell = Handle<h6Shell, h6DestroyShell>;
using Scene = Handle<h6Scene, h6DestroyScene>;
using Recorder = Handle<h6Recorder, h6DestroyRecorder>;
using Recording = Handle<h6Recording, h6DestroyRecording>;

}  // namespace hapsix
