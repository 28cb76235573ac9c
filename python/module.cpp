// SPDX-License-Identifier: Apache-2.0
// module.cpp - the Python module hapsix._hapsix: the contract, with NumPy arrays. hapsix.hpp does
// the work; here it gets names, checks of shapes and exceptions.
#include "python/bindings.h"

namespace {

namespace py = pybind11;
py::handle error_type;  // lives as long as the interpreter

constexpr const char* kCodes[] = {"",     "argument", "range",   "memory",   "system",
                                  "busy", "file",     "content", "cancelled"};

void raise(const hapsix::Error& error) {
  const auto code = static_cast<std::size_t>(error.code);
  const py::object raised = error_type(error.what());
  raised.attr("code") = code < std::size(kCodes) ? kCodes[code] : "";
  PyErr_SetObject(error_type.ptr(), raised.ptr());
}

py::object log_function;
void pass_on(void*, h6LogLevel level, const char* sentence) {
  py::gil_scoped_acquire acquire;
  try {
    if (log_function && !log_function.is_none())
      log_function(level == H6_LOG_WARNING ? "warning" : "note", sentence);
  } catch (py::error_already_set& error) {
    error.discard_as_unraisable("the function of hapsix.set_log");
  }
}

hapsix::python::NameTuple status_names(std::uint32_t status) {
  py::list names;
  for (unsigned bit = 0; bit < 32; ++bit)
    if (status & 1u << bit)
      if (const char* name = h6StatusName(1u << bit)) names.append(name);
  return py::tuple(names);
}
hapsix::python::NameTuple cause_names(std::uint32_t causes) {
  py::list names;
  for (unsigned i = 0; i < 32; ++i)
    if (causes & 1u << i)
      if (const char* name = h6CauseName(static_cast<h6Cause>(i))) names.append(name);
  return py::tuple(names);
}

}  // namespace

PYBIND11_MODULE(_hapsix, m) {
  m.doc() =
      "6-DoF haptic rendering. Units are SI; a pose is (x, y, z, qw, qx, qy, qz) of a mesh frame.";
  error_type = PyErr_NewExceptionWithDoc(
      "hapsix.Error", "Why a call failed, in one sentence; `code` names the kind of failure.",
      PyExc_RuntimeError, nullptr);
  m.add_object("Error", error_type);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const hapsix::Error& error) {
      raise(error);
    }
  });
  hapsix::python::add_definitions(m);
  hapsix::python::add_assets(m);
  hapsix::python::add_session(m);
  hapsix::python::add_batch(m);
  hapsix::python::add_recordings(m);
  m.def("build_info", &h6BuildInfo,
        "Version, compiler and SIMD targets of the library, as a line.");
  m.def("status_names", &status_names, py::arg("status"), "The names of the bits of a status.");
  m.def("cause_names", &cause_names, py::arg("causes"), "The names of the bits of `causes`.");
  m.def(
      "set_log",
      [](py::object function) {
        log_function = std::move(function);
        h6SetLogHandler(log_function.is_none() ? nullptr : pass_on, nullptr);
      },
      py::arg("function"),
      "Calls function(level, sentence) for what no call returns: what a bake repaired, how a "
      "session "
      "starts. level is 'note' or 'warning'. None, the default: silence.");
  // The handler must not outlive the interpreter.
  py::module_::import("atexit").attr("register")(py::cpp_function([] {
    h6SetLogHandler(nullptr, nullptr);
    log_function = py::object();
  }));
}
