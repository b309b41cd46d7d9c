-- expect: 12: constraints[1].alpha: value -1; must not be negative
-- expect: 12: constraints[1].beta: only position rows have it; remove it
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.velocity { s.qd.a_x, alpha = -1, beta = 2 },
    }
  end,
}
