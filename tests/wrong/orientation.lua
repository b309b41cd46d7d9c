-- expect: 13: constraints[1].target: missing, rd.orientation needs it
-- expect: 14: constraints[2].target[1]: "w" is no axis, x y z are
-- expect: 15: constraints[3].target[1]: a text, a number or an expression is needed
-- expect: 16: constraints[4].target: one turn by itself, a list of turns such as { { "x", s.t } } is needed
-- expect: 17: constraints[5].of: no point or link "F", the nearest known one is "E"
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
