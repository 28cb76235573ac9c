// SPDX-License-Identifier: Apache-2.0
// bind_batch.cpp - many sessions of one model, their samples and results as columns that the batch
// owns.
#include <atomic>

#include "python/bindings.h"

namespace hapsix::python {
namespace {

class Batch {
 public:
  Batch(std::shared_ptr<PyModel> model, std::shared_ptr<Definition> definition, std::size_t count,
        std::uint32_t threads)
      : model_(std::move(model)),
        definition_(std::move(definition)),
        hands_(definition_->hands.size()) {
    h6WorkersDef workers = h6DefaultWorkersDef();
    workers.threads = threads;
    workers_ = Workers::make([&](h6Error* error) { return h6CreateWorkers(&workers, error); });
    for (std::size_t i = 0; i < count; ++i) sessions_.push_back(create(*definition_));
    for (const Session& session : sessions_) handles_.push_back(session);
    const std::size_t rows = hands_ * count;
    pose.resize(rows), velocity.resize(rows), wrench.resize(rows), buttons.resize(rows);
    command.resize(rows), command_pose.resize(rows), causes.resize(rows), body.resize(rows);
    status.resize(count), contacts.resize(count), max_depth.resize(count);
    max_depth_voxels.resize(count), state_hash.resize(count);
    for (std::size_t i = 0; i < count; ++i) put_start(i, *definition_);
    arrays_.sessions = handles_.data(), arrays_.count = count;
    arrays_.hands = static_cast<std::uint32_t>(hands_);
    arrays_.pose = pose.data(), arrays_.velocity = velocity.data(), arrays_.wrench = wrench.data();
    arrays_.buttons = buttons.data(), arrays_.command = command.data();
    arrays_.command_pose = command_pose.data(), arrays_.causes = causes.data();
    arrays_.body = body.data(), arrays_.status = status.data(), arrays_.contacts = contacts.data();
    arrays_.max_depth = max_depth.data(), arrays_.max_depth_voxels = max_depth_voxels.data();
    arrays_.state_hash = state_hash.data();
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  // Without the interpreter's lock, as `Unlocked`: thousands of sessions take milliseconds.
  ~Batch() {
    std::optional<py::gil_scoped_release> release;
    if (PyGILState_Check()) release.emplace();
    sessions_.clear();  // before the workers that they name
    workers_ = Workers();
  }

  h6Status step(std::uint32_t steps) {
    const Turn turn(busy_);
    arrays_.steps = steps;
    return h6StepMany(workers_, &arrays_);
  }

  // Sessions begin anew, the bodies of their hands at these poses.
  void reset(const std::vector<std::size_t>& which, const h6Pose* poses) {
    const Turn turn(busy_);
    const Definition at(*definition_);
    for (std::size_t k = 0; k < which.size(); ++k) {
      for (std::size_t h = 0; h < hands_ && poses; ++h)
        at.bodies.at(static_cast<std::size_t>(at.hands[h]->body))->pose = poses[hands_ * k + h];
      const std::size_t i = which[k];
      sessions_[i] = Session();  // the memory first
      sessions_[i] = create(at);
      handles_[i] = sessions_[i];
      put_start(i, at);
    }
  }

  std::size_t count() const { return sessions_.size(); }
  std::size_t hands() const { return hands_; }
  std::uint32_t threads() const { return h6WorkerThreads(workers_); }
  const std::shared_ptr<PyModel>& model() const { return model_; }

  std::vector<h6Pose> pose, command_pose;
  std::vector<h6Velocity> velocity;
  std::vector<h6Wrench> wrench, command;
  std::vector<std::uint32_t> buttons, causes, contacts;
  std::vector<h6BodyState> body;
  std::vector<h6Status> status;
  std::vector<double> max_depth, max_depth_voxels;
  std::vector<std::uint64_t> state_hash;

 private:
  // One call at a time: without the interpreter's lock two threads could meet here.
  struct Turn {
    explicit Turn(std::atomic<bool>& flag) : busy(flag) {
      if (busy.exchange(true)) throw std::runtime_error("another thread steps this batch");
    }
    ~Turn() { busy = false; }
    std::atomic<bool>& busy;
  };
  Session create(const Definition& of) const {
    return of.with([&](h6SessionDef def) {
      def.workers = workers_;
      return Session::make(
          [&](h6Error* error) { return h6CreateSession(model_->get(), &def, error); });
    });
  }
  void put_start(std::size_t i, const Definition& of) {
    for (std::size_t h = 0; h < hands_; ++h) {
      const std::size_t row = hands_ * i + h;
      const h6BodyDef& start = *of.bodies.at(static_cast<std::size_t>(of.hands[h]->body));
      pose[row] = start.pose, body[row] = {start.pose, start.velocity};
      velocity[row] = {}, wrench[row] = {}, buttons[row] = 0;
      command[row] = {}, command_pose[row] = start.pose, causes[row] = 0;
    }
    status[i] = 0, contacts[i] = 0, max_depth[i] = max_depth_voxels[i] = 0, state_hash[i] = 0;
  }

  std::shared_ptr<PyModel> model_;
  std::shared_ptr<Definition> definition_;
  std::size_t hands_;
  Workers workers_;
  std::vector<Session> sessions_;
  std::vector<h6Session*> handles_;
  h6StepArrays arrays_ = h6DefaultStepArrays();
  std::atomic<bool> busy_{false};
};

using BatchPtr = std::shared_ptr<Batch>;

// (count, hands, n) for structs of numbers, (count, hands) for single ones.
template <class T>
auto hand_rows(std::vector<T> Batch::*of, bool writable) {
  return [=](const BatchPtr& b) {
    const auto count = static_cast<py::ssize_t>(b->count()),
               hands = static_cast<py::ssize_t>(b->hands());
    const T* data = ((*b).*of).data();
    constexpr py::ssize_t size = sizeof(T);
    if constexpr (sizeof(T) > 8)
      return view(reinterpret_cast<const double*>(data), {count, hands, size / 8},
                  {hands * size, size, 8}, py::cast(b), writable);
    else
      return view(data, {count, hands}, {hands * size, size}, py::cast(b), writable);
  };
}
template <class T>
auto session_rows(std::vector<T> Batch::*of) {
  return [=](const BatchPtr& b) { return column(((*b).*of).data(), b->count(), py::cast(b)); };
}

void reset(Batch& batch, const std::optional<std::vector<std::int64_t>>& which,
           const std::optional<Rows<double>>& poses) {
  std::vector<std::size_t> rows;
  if (!which) {
    for (std::size_t i = 0; i < batch.count(); ++i) rows.push_back(i);
  } else {
    for (const std::int64_t i : *which) {
      if (i < 0 || static_cast<std::size_t>(i) >= batch.count())
        throw py::index_error("session " + std::to_string(i) + " does not exist: the batch has " +
                              std::to_string(batch.count()));
      rows.push_back(static_cast<std::size_t>(i));
    }
  }
  if (poses && (static_cast<std::size_t>(poses->size()) != 7 * batch.hands() * rows.size() ||
                poses->ndim() < 1 || poses->shape(poses->ndim() - 1) != 7))
    throw py::value_error("poses must have the shape (" + std::to_string(rows.size()) + ", " +
                          std::to_string(batch.hands()) + ", 7)");
  const auto* from = poses ? reinterpret_cast<const h6Pose*>(poses->data()) : nullptr;
  py::gil_scoped_release release;
  batch.reset(rows, from);
}

}  // namespace

void add_batch(py::module_& m) {
  py::class_<Batch, BatchPtr>(
      m, "Batch",
      "Many sessions of one model, stepped in one call on several threads. Each "
      "has the bits that it has alone, on any number of threads. Its arrays are "
      "views of what the batch owns; keep them.")
      .def(py::init([](std::shared_ptr<PyModel> model, const Definition& definition,
                       std::size_t count, std::uint32_t threads) {
             auto copy = std::make_shared<Definition>(definition);
             py::gil_scoped_release release;
             return std::make_shared<Batch>(std::move(model), std::move(copy), count, threads);
           }),
           py::arg("model"), py::arg("definition"), py::arg("count"), py::arg("threads") = 0,
           "count sessions of this definition; threads: 1 .. 64, 0: one for each core. Keep "
           "definition.max_contacts small: that is most of a session's memory.")
      .def(
          "step",
          [](Batch& batch, std::uint32_t steps) {
            py::gil_scoped_release release;
            return batch.step(steps);
          },
          py::arg("steps") = 1,
          "Each session takes `steps` frames with its samples; returns the status bits of all.")
      .def("reset", &reset, py::arg("which") = py::none(), py::arg("poses") = py::none(),
           "Begins sessions anew (None: all), the bodies of their hands at poses (which, hands, "
           "7), or "
           "where the definition puts them. Samples start there, at rest.")
      .def("__len__", &Batch::count, "How many sessions there are.")
      .def_property_readonly("hands", &Batch::hands, "how many each session has")
      .def_property_readonly("threads", &Batch::threads, "that step the sessions")
      .def_property_readonly("model", &Batch::model, "that all sessions share")
      .def_property_readonly("pose", hand_rows(&Batch::pose, true),
                             "(count, hands, 7) samples, to be written [m]")
      .def_property_readonly("velocity", hand_rows(&Batch::velocity, true),
                             "(count, hands, 6) of the samples [m/s, rad/s]")
      .def_property_readonly("wrench", hand_rows(&Batch::wrench, true),
                             "(count, hands, 6) of the samples, admittance modes [N, N m]")
      .def_property_readonly("buttons", hand_rows(&Batch::buttons, true), "(count, hands)")
      .def_property_readonly("command", hand_rows(&Batch::command, false),
                             "(count, hands, 6) wrench on each hand [N, N m]")
      .def_property_readonly("command_pose", hand_rows(&Batch::command_pose, false),
                             "(count, hands, 7)")
      .def_property_readonly("causes", hand_rows(&Batch::causes, false), "(count, hands) bits")
      .def_property_readonly("body", hand_rows(&Batch::body, false),
                             "(count, hands, 13) pose and velocity of each hand's body")
      .def_property_readonly("status", session_rows(&Batch::status), "(count,) bits of the frames")
      .def_property_readonly("contacts", session_rows(&Batch::contacts),
                             "(count,) points that touch")
      .def_property_readonly("max_depth", session_rows(&Batch::max_depth), "(count,) [m]")
      .def_property_readonly("max_depth_voxels", session_rows(&Batch::max_depth_voxels), "(count,)")
      .def_property_readonly("state_hash", session_rows(&Batch::state_hash), "(count,) uint64");
}

}  // namespace hapsix::python
