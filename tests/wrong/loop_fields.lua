-- expect: 14: constraints[1].b: missing; rd.loop needs it
-- expect: 15: constraints[2].keep: "u" is not an axis; use x, y or z
-- expect: 16: constraints[3].b: no point or link "nowhere"; use one of E, a
-- expect: 17: constraints[4].b: a number; must be the name of a link or point, or { on = ..., at = ... }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.loop { "E" },
      rd.loop { "E", "ground", keep = "x, u" },
      rd.loop { "E", "nowhere" },
      rd.loop { "E", 3 },
    }
  end,
}
