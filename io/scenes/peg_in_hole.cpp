// peg_in_hole.cpp - a tight conforming fit with contacts all around (Fig. 10).
#include "io/scenes/list.h"
#include "io/scenes/shapes.h"

namespace h6::io {

Scene peg_in_hole() {
  Scene scene = common_scene(
      "peg-in-hole",
      "A peg (R = 10 mm) in a blind hole (R = 10.3 mm, 30 mm deep) is pressed 8 mm sideways, then "
      "20 mm down, 10 mm past the floor. Forbidden: the block, 3 mm under its surface.");
  const double side = 25 * kMm, height = 40 * kMm, hole = 10.3 * kMm, floor = 30 * kMm;
  scene.bodies.push_back(obstacle("block", block_with_hole(side, height, hole, floor, 128), kMm));

  const double radius = 10 * kMm, half_length = 15 * kMm;
  SceneBody peg;
  peg.name = "peg";
  peg.com = h6Vec3{0, 0, 0};
  peg.inertia = cylinder_inertia(peg.mass, radius, half_length);
  peg.pose = {{0, 0, -5 * kMm}, {1, 0, 0, 0}};  // its bottom 10 mm above the floor
  peg.shell.emplace();
  peg.shell->points.emplace();
  add_cylinder_side(*peg.shell->points, radius, half_length, 60, 40);
  add_disc(*peg.shell->points, radius, -half_length, 4 * kMm, {0, 0, 1});
  peg.shell->bake.levels = 5;
  scene.bodies.push_back(peg);

  const double speed = 40 * kMm;
  HandPath hand(peg.pose);
  hand.wait(0.05).move_by({8 * kMm, 0, 0}, speed).wait(0.15);
  hand.move_by({0, 0, -20 * kMm}, speed).wait(0.5);
  scene.hands.push_back(path_hand("peg", hand.rows()));

  // Under the floor, and the four sides of the block around the hole.
  const double deep = 3 * kMm, wall = hole + deep;
  scene.verdict.forbidden = {
      {{-side, -side, -height}, {side, side, -floor - deep}},
      {{wall, -side, -height}, {side, side, -deep}},
      {{-side, -side, -height}, {-wall, side, -deep}},
      {{-side, wall, -height}, {side, side, -deep}},
      {{-side, -side, -height}, {side, -wall, -deep}},
  };
  return scene;
}

}  // namespace h6::io
