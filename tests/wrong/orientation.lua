-- expect: 13: constraints[1].target: missing; rd.orientation needs it
-- expect: 14: constraints[2].target[1]: "w" is not an axis; use x, y or z
-- expect: 15: constraints[3].target[1]: a text; must be a number or an expression
-- expect: 16: constraints[4].target: a single turn; must be a list of turns such as { { "x", s.t } }
-- expect: 17: constraints[5].of: no point or link "F"; use one of E, a
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = "free", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } } },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.orientation { "E" },
      rd.orientation { "E", { { "w", s.t } } },
      rd.orientation { "E", { { "x", "y" } } },
      rd.orientation { "E", { "x", s.t } },
      rd.orientation { "F", {} },
    }
  end,
}
