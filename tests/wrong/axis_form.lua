-- expect: 14: constraints[1].a: a text; must be an axis such as { "arm", "z" }
-- expect: 15: constraints[2].a.direction: "w" is not an axis; use x, y or z
-- expect: 16: constraints[3].a.direction: length 0; must be a direction
-- expect: 17: constraints[4].line.direction: missing; an axis needs it
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.parallel { "a", { "a", "z" } },
      rd.parallel { { "a", "w" }, { "ground", "z" } },
      rd.perpendicular { { "a", { 0, 0, 0 } }, { "ground", "z" } },
      rd.on_line { "E", { "ground" } },
    }
  end,
}
