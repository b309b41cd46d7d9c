-- expect: 9: points.E.turn[1]: "u" is not an axis; use x, y or z
-- expect: 9: points.F.at[3]: a text; must be a number or an expression
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = { on = "a", turn = { { "u", 1 } } }, F = { on = "a", at = { 0, 0, "high" } } },
}
