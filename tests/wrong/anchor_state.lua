-- expect: 11: parameter x0: depends on the motion; use s.start for values at its start
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.q.a_x - rd.parameter("x0", s.q.a_x, "m") },
    }
  end,
}
