// SPDX-License-Identifier: Apache-2.0
// bindings.h - what the parts of the Python module share: numbers, views, objects that hold others.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/batch.h"
#include "hapsix/io.h"
// After batch.h and io.h, for their handles.
#include "hapsix/hapsix.hpp"

namespace hapsix::python {

namespace py = pybind11;

// A tuple, dict or list with the type that its signature, and so the stub, has. NumPy's arrays in
// it are called as pybind11 calls them.
template <std::size_t N>
struct Text {
  char text[N];
  constexpr Text(const char (&from)[N]) {  // NOLINT: it is that text
    for (std::size_t i = 0; i < N; ++i) text[i] = from[i];
  }
};
template <class Object, Text type>
struct Typed : Object {
  Typed(Object object) : Object(std::move(object)) {}  // NOLINT: it is that object
};
using NumberTuple = Typed<py::tuple, "Tuple[float, ...]">;
using NameTuple = Typed<py::tuple, "Tuple[str, ...]">;

// A struct of doubles, as a tuple that nobody can change in vain, and back.
template <class T>
inline constexpr std::size_t kNumbers = sizeof(T) / sizeof(double);
template <class T>
using Numbers = std::array<double, kNumbers<T>>;
template <class T>
NumberTuple tuple_of(const T& value) {
  Numbers<T> numbers;
  std::memcpy(&numbers, &value, sizeof value);
  py::tuple out(kNumbers<T>);
  for (std::size_t i = 0; i < kNumbers<T>; ++i) out[i] = py::float_(numbers[i]);
  return out;
}
template <class T>
T struct_of(const Numbers<T>& numbers) {
  T value;
  std::memcpy(&value, &numbers, sizeof value);
  return value;
}

// A handle that is destroyed without the interpreter's lock: that may take milliseconds.
template <class Handle>
struct Unlocked : Handle {
  Unlocked() = default;
  Unlocked(Handle&& handle) : Handle(std::move(handle)) {}  // NOLINT: it is that handle
  Unlocked(Unlocked&&) = default;
  Unlocked& operator=(Unlocked&&) = default;
  ~Unlocked() {
    if (!this->get() || !PyGILState_Check()) return;
    py::gil_scoped_release release;
    static_cast<Handle&>(*this) = Handle();
  }
};

// An array over memory that `owner` keeps. Strides in bytes.
template <class T>
py::array_t<T> view(const T* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                    py::handle owner, bool writable = false) {
  py::array_t<T> array(std::move(shape), std::move(strides), data, owner);
  if (!writable)
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
template <class T>
py::array_t<T> column(const T* data, std::size_t count, py::handle owner, bool writable = false) {
  return view(data, {static_cast<py::ssize_t>(count)}, {sizeof(T)}, owner, writable);
}

// The rows of an array argument; a ValueError with a sentence where the shape is another.
template <class T>
using Rows = py::array_t<T, py::array::c_style | py::array::forcecast>;
template <class T>
std::size_t rows_of(const Rows<T>& array, py::ssize_t columns, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != columns)
    throw py::value_error(std::string(name) + " must have the shape (rows, " +
                          std::to_string(columns) + ")");
  return static_cast<std::size_t>(array.shape(0));
}

// A long piece of work calls this: it lets Ctrl-C through, and asks `callable`, which may be None.
class ProgressOf {
 public:
  explicit ProgressOf(py::object callable) : callable_(std::move(callable)) {}
  template <class Def>
  void enter(Def& def) {
    def.progress = call, def.user = this;
  }
  // Runs work(error) without the interpreter's lock, and throws what stopped it.
  template <class Work>
  auto run(Work&& work) {
    h6Error error{};
    auto result = [&] {
      py::gil_scoped_release release;
      return work(&error);
    }();
    if (raised_) std::rethrow_exception(raised_);
    if (!result) throw Error(error);
    return result;
  }

 private:
  static bool call(void* user, const char* what, double done) {
    ProgressOf& self = *static_cast<ProgressOf*>(user);
    py::gil_scoped_acquire acquire;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return self.callable_.is_none() || !self.callable_(what, done).is(py::bool_(false));
    } catch (...) {
      self.raised_ = std::current_exception();
      return false;
    }
  }
  py::object callable_;
  std::exception_ptr raised_;
};

// A model that a program made, or that of a scene, which must live as long.
struct PyScene {
  Unlocked<Scene> scene;
};
struct PyModel {
  Unlocked<Model> own;
  std::shared_ptr<PyScene> scene;
  const h6Model* get() const { return scene ? h6GetSceneModel(scene->scene) : own.get(); }
};

// A session's definition with what it points to.
struct Definition {
  std::vector<std::shared_ptr<h6BodyDef>> bodies;
  std::vector<std::shared_ptr<h6HandDef>> hands;
  std::vector<std::array<std::int32_t, 2>> pairs;
  h6SessionDef def = h6DefaultSessionDef();

  Definition() = default;
  explicit Definition(const h6SessionDef& from);
  // A copy shares no body and no hand. A call that lets go of the interpreter's lock needs one:
  // another Python thread may change the original then.
  Definition(const Definition& from);
  Definition& operator=(const Definition&) = delete;
  // Calls use(def) with a definition that points to everything.
  template <class Use>
  auto with(Use&& use) const {
    std::vector<h6BodyDef> b;
    std::vector<h6HandDef> h;
    std::vector<h6PairDef> p;
    for (const auto& body : bodies) b.push_back(*body);
    for (const auto& hand : hands) h.push_back(*hand);
    for (const auto& pair : pairs) p.push_back({pair[0], pair[1], {}});
    h6SessionDef whole = def;
    whole.bodies = b.data(), whole.body_count = b.size();
    whole.hands = h.data(), whole.hand_count = h.size();
    whole.pairs = p.data(), whole.pair_count = p.size();
    return use(whole);
  }
};

struct PySession {
  // A session belongs to one thread at a time, so Python's threads take turns, call by call.
  // A call that has let go of the interpreter's lock holds the mutex itself.
  mutable std::mutex mutex;
  std::shared_ptr<PyModel> model;
  Unlocked<Session> session;
  std::size_t hands = 0, bodies = 0;
  double rate = 0;
  std::array<h6DeviceSample, H6_MAX_HANDS> samples;
  std::array<h6DeviceCommand, H6_MAX_HANDS> commands{};
  // The views show these. Steps fill them from the first view on.
  h6FrameReport report{};
  std::vector<h6BodyState> states;
  bool shows_report = false, shows_states = false;
  void show() {
    if (shows_report) report = h6GetFrame(session);
    for (std::size_t b = 0; shows_states && b < bodies; ++b)
      states[b] = h6GetBody(session, static_cast<std::int32_t>(b));
  }
};
// The turn of a call that keeps the interpreter's lock. It lets go of that lock while it waits,
// since the turn's owner may wait for the lock.
class SessionTurn {
 public:
  explicit SessionTurn(const PySession& s) : lock_(s.mutex, std::try_to_lock) {
    if (lock_) return;
    py::gil_scoped_release release;
    lock_.lock();
  }

 private:
  std::unique_lock<std::mutex> lock_;
};
std::shared_ptr<PySession> make_session(std::shared_ptr<PyModel> model, const Definition& of);

void add_definitions(py::module_& m);
void add_assets(py::module_& m);
void add_session(py::module_& m);
void add_batch(py::module_& m);
void add_recordings(py::module_& m);

}  // namespace hapsix::python

template <class Object, hapsix::python::Text type>
struct pybind11::detail::handle_type_name<hapsix::python::Typed<Object, type>> {
  static constexpr auto name = const_name(type.text);
};
