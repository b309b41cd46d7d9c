-- expect: 15: limits[1]: has neither a value nor a column; give one of value and column
-- expect: 16: limits[2]: has a value and a column; give one of value and column
-- expect: 17: limits[3].name: an expression; must be a text
-- expect: 18: limits[4]: a number; must be a table such as { "speed", s.qd.arm_psi, to = 2 }
-- expect: 19: limits[5].value: a table; must be a number or an expression
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 }, limits = { x = { from = -1 } } } },
  points = { E = "a" },
  courses = function(s) return { way = s.q.a_x } end,
  limits = function(s)
    return {
      { "neither", to = 1 },
      { "both", s.t, column = "a_x", to = 1 },
      { s.t, to = 1 },
      5,
      { "kind", {}, to = 1 },
    }
  end,
}
