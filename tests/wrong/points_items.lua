-- expect: 12: points: has entries without a name ("arm"); must be a table of points such as { E = "arm" }
-- expect: 12: points.E[1]: a text without a name; write { on = "arm", at = { 0, 0, 1 } }
-- expect: 12: points.F[1]: a number without a name; write { on = "arm", at = { 0, 0, 1 } }
-- expect: 12: points.G: a truth value; must be the name of a link, or { on = ..., at = ... }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  points = { "arm", E = { "arm" }, F = { on = "arm", 5 }, G = true },
}
