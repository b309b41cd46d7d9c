-- Every kind of row made by a function of its own, on a body that floats at (1, 2, 3) and is turned by psi = 0.1.
-- They contradict each other: the option `entry` selects one of them. Their phi by hand, with c = cos 0.1, s = sin 0.1,
-- tip = (1 + c, 2 + s, 3):
--   loop "tip" to (2, 2, 3)                 c - 1, s, 0        keep = "x": c - 1
--   parallel x to the ground's x            against y and z:   s, 0
--   perpendicular x to the ground's y       s
--   on_line body, axis x through (0, 1, 1)  against y and z:   1, 2
--   on_plane body, normal (0, 3, 4)         (2 3 + 3 4) / 5 = 3.6
--   distance body to the origin, 3 m        sqrt(14) - 3
--   close hinge psi to (1, 2, 2.5)          0, 0, 0.5, and z against x and y: 0, 0
--   close slide x with turn phi             y, z of the gap in the ground's axes: 2, 3, and x against y and z: s, 0
--   close weld at the origin                1, 2, 3, and x against y, y against z, z against x: s, 0, 0
--   close universal psi, theta              1, 2, 3, and y against z: 0
--   close ball                              1, 2, 3
--   drive body_x to 0.25                    0.75
--   lock body_y at its start; lock body_z at 1: 0, 2
local rd = require "refdyn"
local entry = rd.option("entry", 1, { from = 1, to = 15 })

return rd.model {
  name = "closures",
  links = {
    { "body", joint = "free", start = { x = 1, y = 2, z = 3, psi = 0.1 }, mass = 1,
      inertia = { xx = 0.1, yy = 0.1, zz = 0.1 } },
  },
  points = { tip = { on = "body", at = { 1, 0, 0 } } },
  constraints = function(s)
    local function ground(x, y, z) return { on = "ground", at = { x, y, z } } end
    local all = {
      rd.loop { "tip", ground(2, 2, 3), alpha = 10, beta = 10 },
      rd.loop { "tip", ground(2, 2, 3), keep = "x", name = "kept" },
      rd.parallel { { "body", "x" }, { "ground", "x" } },
      rd.perpendicular { { "body", "x" }, { "ground", "y" } },
      rd.on_line { "body", { "ground", "x", at = { 0, 1, 1 } } },
      rd.on_plane { "body", { "ground", { 0, 3, 4 } } },
      { rd.distance { "body", "ground", 3 } },
      rd.close { "body", ground(1, 2, 2.5), joint = "psi" },
      rd.close { "body", "ground", joint = { "x", "phi" } },
      rd.close { "body", "ground", joint = "weld" },
      rd.close { "body", "ground", joint = "psi, theta" },
      rd.close { "body", "ground", joint = "ball" },
      rd.drive { "body_x", 0.25 },
      rd.lock { "body_y" },
      rd.lock { "body_z", 1 },
    }
    return { all[entry] }
  end,
}
