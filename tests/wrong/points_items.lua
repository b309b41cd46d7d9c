-- expect: 12: points: has entries without a name, a table of points such as { E = "arm" } is needed
-- expect: 12: points.E[1]: a text without a name, { on = "arm", at = { 0, 0, 1 } } is needed
-- expect: 12: points.F[1]: a number without a name, { on = "arm", at = { 0, 0, 1 } } is needed
-- expect: 12: points.G: true or false, the name of a link or { on = ..., at = ... } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  points = { "arm", E = { "arm" }, F = { on = "arm", 5 }, G = true },
}
