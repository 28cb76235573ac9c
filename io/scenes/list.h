// list.h - the generated scenes, one function each; scenes.cpp has them by name.
#pragma once
#include "io/scene.h"

namespace h6::io {

Scene box_on_wall();
Scene peg_in_hole();
Scene alpha_shortcut();

}  // namespace h6::io
