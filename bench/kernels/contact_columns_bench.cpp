// SPDX-License-Identifier: Apache-2.0
// contact_columns_bench.cpp - the work done once for each contact: sampling groups, making contacts
// of the touching points, torque directions.
#include "kernels/contact/contact_columns.h"

#include <memory>
#include <vector>

#include "bench/kernels/field_bench.h"
#include "kernels/contact/touch_groups.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

using Columns = std::vector<std::vector<float>>;
Columns columns(std::size_t count, std::size_t rows) {
  return Columns(count, std::vector<float>(rows + kGroup));
}

bool near(const Columns& got, const Columns& want, std::size_t rows, float tolerance) {
  for (std::size_t k = 0; k < got.size(); ++k)
    for (std::size_t i = 0; i < rows; ++i)
      if (!(std::fabs(got[k][i] - want[k][i]) <= tolerance)) return false;
  return true;
}

Columns directions(std::size_t vectors, std::size_t rows) {
  Random random(9);
  Columns c = columns(3 * vectors, rows);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t v = 0; v < vectors; ++v) {
      double u[3];
      random.direction(u);
      for (std::size_t k = 0; k < 3; ++k) c[3 * v + k][i] = float(u[k]);
    }
  return c;
}

// Points about a ball: half of them touch.
struct Touch {
  const test::AnalyticField& field;
  ShellPoints points;
  std::vector<std::uint32_t> groups, row;
  Columns out, want;  // distance and gradient
  std::vector<float> least;
  std::size_t count = 0, want_count = 0;

  Touch(std::size_t n, const test::AnalyticField& in)
      : field(in),
        points(n, 2),
        row(n),
        out(columns(4, n)),
        want(columns(4, n)),
        least(n / kGroup) {
    for (std::uint32_t g = 0; g < n / kGroup; ++g) groups.push_back(g);
    want_count = run(touch_groups_ref, want);
  }
  template <class Kernel>
  std::size_t run(const Kernel& kernel, Columns& to) {
    return kernel(field.view(), test::kIdentity,
                  PointsView{points.x.data(), points.y.data(), points.z.data(), points.x.size()},
                  groups.data(), groups.size(), 0.0f, false,
                  GroupLook{nullptr, least.data(), nullptr, nullptr, 0},
                  Touching{row.data(), to[0].data(), to[1].data(), to[2].data(), to[3].data()});
  }
};

Case touch(std::size_t n, const test::AnalyticField& field) {
  auto t = std::make_shared<Touch>(n, field);
  return {[=] { t->count = t->run(touch_groups, t->out); },
          [=] { t->count = t->run(touch_groups_ref, t->out); },
          [=] { return t->count == t->want_count && near(t->out, t->want, t->count, 1e-3f); }};
}

// Two thirds of the points of each group.
struct Make {
  Columns shell, hits, out, want;
  std::vector<std::uint32_t> point, row, out_point;

  explicit Make(std::size_t n) : out(columns(10, n)), want(columns(10, n)), out_point(n + kGroup) {
    const std::size_t rows = (n * 3 / 2 + kGroup) / kGroup * kGroup;
    shell = directions(2, rows);
    hits = directions(2, n);
    for (std::uint32_t i = 0; i < rows; ++i) {
      point.push_back(i);
      if (i % 3 != 1 && row.size() < n) row.push_back(i);
    }
    run(make_contacts_ref, want);
  }
  template <class Kernel>
  void run(const Kernel& kernel, Columns& to) {
    const auto s = [&](int k) { return shell[k].data(); };
    const ContactFrame frame{{0.6f, -0.8f, 0, 0.8f, 0.6f, 0, 0, 0, 1},
                             {1, 0, 0, 0, 0.8f, 0.6f, 0, -0.6f, 0.8f},
                             {0.1f, -0.2f, 0.3f},
                             5e-4f};
    kernel({s(0), s(1), s(2), s(3), s(4), s(5), point.data()},
           Touching{row.data(), hits[3].data(), hits[0].data(), hits[1].data(), hits[2].data()},
           row.size(), frame,
           MadeContacts{to[0].data(), to[1].data(), to[2].data(), to[3].data(), to[4].data(),
                        to[5].data(), to[6].data(), to[7].data(), to[8].data(), to[9].data(),
                        out_point.data()});
  }
};

Case make(std::size_t n) {
  auto m = std::make_shared<Make>(n);
  return {[=] { m->run(make_contacts, m->out); }, [=] { m->run(make_contacts_ref, m->out); },
          [=] { return near(m->out, m->want, n, 2e-6f); }};
}

Case torque(std::size_t n) {
  struct Torque {
    Columns in, out, want;
  };
  auto t = std::make_shared<Torque>(Torque{directions(3, n), columns(3, n), columns(3, n)});
  const auto run = [=](const auto& kernel, Columns& to) {
    const auto p = [&](int k) { return t->in[k].data(); };
    kernel({p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), p(8), n}, 5e-4f, 0.0f, to[0].data(),
           to[1].data(), to[2].data());
  };
  run(torque_directions_ref, t->want);
  return {[=] { run(torque_directions, t->out); }, [=] { run(torque_directions_ref, t->out); },
          [=] { return near(t->out, t->want, n, 1e-3f); }};
}

const bool registered = [] {
  for (std::size_t n : {1024, 10000}) {
    const std::string size = "/n:" + std::to_string(n);
    const std::size_t whole = n / kGroup * kGroup;
    add("kernels/touch_groups" + size, n, [=] { return touch(whole, ball_field()); });
    add("kernels/touch_groups/creased" + size, n, [=] { return touch(whole, cut_field(10)); });
    add("kernels/touch_groups/refined" + size, n, [=] { return touch(whole, cut_field(1)); });
    add("kernels/make_contacts" + size, n, [=] { return make(n); });
    add("kernels/torque_directions" + size, n, [=] { return torque(n); });
  }
  return true;
}();

}  // namespace
